"""The results of a replay as a log: the reference of the regression check.

Series are means over blocks of time; each channel carries its own tolerance, in its own unit.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from analysis.filters.base import STATES
from analysis.filters.wind_terms import WIND_TERMS
from analysis.regression.coefficients import CoefficientFit
from analysis.regression.sliding import CoefficientHistory
from analysis.replay.replay_results import Analysis
from shiplog import Channel, TrialLog
from shiplog.ships.paper import COEFFICIENT_UNITS, PAPER_OUTPUTS
from shiplog.types import FloatArray, TimeArray
from shiplog.vessel.settings import SENSOR_ERRORS

BLOCK_SECS = 4.0
WEIGHT_PERIOD = 97  # samples, a prime: two samples of a block that change places have other weights

# The tolerance of each kind of channel, as a share of its largest value when the reference was
# made: the rounding of another processor, amplified by the condition of what is solved.
_TOLERANCES = {
    "measured": 1e-12,
    "weighted": 1e-12,
    "share": 1e-12,
    "model": 1e-12,
    "noise_model": 1e-6,
    "estimate": 1e-9,
    "std": 1e-9,
    "innovation": 1e-9,
    "residual_test": 1e-6,
    "trial": 1e-8,
    "trial_std": 1e-7,
    "history": 1e-7,
    "history_std": 1e-6,
    "track": 1e-9,
    "count": 1e-12,
}
_UNITS = {
    "yaw_acceleration": "rad/s²",
    "yaw_jerk": "rad/s³",
    "surge_acceleration": "m/s²",
    "yaw_disturbance": "rad/s³",
    "surge_disturbance": "m/s²",
    "yaw_wind_disturbance": "rad/s³",
    "surge_wind_disturbance": "m/s²",
    **dict.fromkeys(WIND_TERMS, "m²/s²"),  # as signals; the coefficients have their own unit
    "yaw_rate": "rad/s",
    "speed": "m/s",
    "rudder": "rad",
    "rpm": "rpm",
    "heading": "rad",
    "rudder_disturbance": "rad",
    "north": "m",
    "east": "m",
    **COEFFICIENT_UNITS,
}


def make_reference(analysis: Analysis) -> TrialLog:
    """Return the results of a replay as a log, in the order in which they are computed.

    Series are means over `BLOCK_SECS`, short enough that every change shows.

    Returns
    -------
    TrialLog
        A channel for each result: its name is the quantity, its source the kind of result, and its
        metadata hold the tolerance.
    """
    plan = analysis.findings.plan
    channels = [
        *_measured(analysis),
        *_model_and_noise(analysis),
        *_estimates(analysis),
        *_residual_tests(analysis),
        *_disturbances(analysis),
        *_coefficients(analysis, analysis.findings.yaw, analysis.yaw_history),
        *_coefficients(analysis, analysis.findings.surge, analysis.surge_history),
        *_track_and_warnings(analysis),
    ]
    metadata = {"reference_of": plan.name, "model": plan.model_origin}
    return TrialLog(plan.name, tuple(channels), metadata)


def _measured(analysis: Analysis) -> Iterator[Channel]:
    """For each signal: its mean, a mean that depends on the order, and the share measured."""
    for name, values in analysis.signals.values.items():
        weights = np.arange(len(values)) % WEIGHT_PERIOD / WEIGHT_PERIOD
        yield _blocks(analysis, name, "measured", values)
        yield _blocks(analysis, name, "weighted", values * weights)
        yield _blocks(analysis, f"{name}_measured", "share", np.isfinite(values).astype(float))


def _model_and_noise(analysis: Analysis) -> Iterator[Channel]:
    plan = analysis.findings.plan
    for name, value in plan.vessel.paper_coefficients._asdict().items():
        yield _single(analysis, name, "model", value)
    noise = plan.noise
    for i, name in enumerate(PAPER_OUTPUTS):
        std, ratio = float(noise.measurement_std[i]), float(noise.process_ratio[i])
        yield _single(analysis, f"{name}_measurement_std", "noise_model", std)
        yield _single(analysis, f"{name}_process_ratio", "noise_model", ratio)
    further = noise.further
    for name, std in zip(further.outputs, further.output_stds, strict=True):
        yield _single(analysis, f"{name}_measurement_std", "noise_model", std)
    for name, force in (("yaw_moment", further.yaw), ("surge_force", further.surge)):
        if force is not None:
            yield _single(analysis, f"{name}_frequency", "noise_model", force.frequency)


def _estimates(analysis: Analysis) -> Iterator[Channel]:
    estimates = analysis.estimates
    for i, name in enumerate(STATES):
        yield _blocks(analysis, name, "estimate", estimates.states[:, i])
        yield _blocks(analysis, name, "std", estimates.stds[:, i])
    further = estimates.further
    if further is None:
        return
    for i, (state, unit) in enumerate(zip(further.names, further.units, strict=True)):
        name = f"{state}_error" if state in SENSOR_ERRORS else state
        for kind, values in (("estimate", further.values), ("std", further.stds)):
            yield replace(_blocks(analysis, name, kind, values[:, i]), unit=unit)


def _residual_tests(analysis: Analysis) -> Iterator[Channel]:
    for i, residuals in enumerate(analysis.findings.residuals):
        name = residuals.name
        yield _blocks(analysis, name, "innovation", analysis.estimates.innovations[:, i])
        yield _single(analysis, f"{name}_rms", "residual_test", residuals.rms)
        yield _single(analysis, f"{name}_nis", "residual_test", residuals.mean_nis)
        yield _single(analysis, f"{name}_nis_limit", "residual_test", residuals.nis_band[1])
        yield _single(analysis, f"{name}_whiteness", "residual_test", residuals.whiteness_p)
        yield _single(analysis, f"{name}_rejected", "count", float(residuals.rejected))


def _disturbances(analysis: Analysis) -> Iterator[Channel]:
    for kind, summary in analysis.findings.disturbances.items():
        values = getattr(analysis.disturbance, kind)
        yield _blocks(analysis, f"{kind}_disturbance", "estimate", values)
        yield _single(analysis, f"{kind}_disturbance", "std", summary.noise_std)


def _coefficients(
    analysis: Analysis, fit: CoefficientFit, history: CoefficientHistory
) -> Iterator[Channel]:
    at = history.time_secs
    for i, (name, coefficient) in enumerate(fit.coefficients.items()):
        yield _single(analysis, name, "trial", coefficient.value)
        yield _single(analysis, name, "trial_std", coefficient.std)
        yield _blocks(analysis, name, "history", history.values[:, i], at)
        yield _blocks(analysis, name, "history_std", history.stds[:, i], at)


def _track_and_warnings(analysis: Analysis) -> Iterator[Channel]:
    track = analysis.track
    yield _blocks(analysis, "north", "track", track.north, track.time_secs)
    yield _blocks(analysis, "east", "track", track.east, track.time_secs)
    for error in (*analysis.findings.sensor_errors, *analysis.findings.wind):
        yield _single(analysis, f"{error.name}_determined", "count", float(error.determined))
    yield _single(analysis, "warnings", "count", float(len(analysis.findings.warnings)))


def _blocks(
    analysis: Analysis, name: str, kind: str, values: FloatArray, at: FloatArray | None = None
) -> Channel:
    """Return the mean of the finite values in each block of time; NaN where there are none.

    `at` are their times, s since the start; by default those of the signals.
    """
    time_secs = analysis.signals.time_secs if at is None else at
    block = (np.maximum(time_secs, 0) // BLOCK_SECS).astype(np.int64)
    finite = np.isfinite(values)
    size = int(np.max(block, initial=0)) + 1
    count = np.bincount(block[finite], minlength=size)
    total = np.bincount(block[finite], weights=values[finite], minlength=size)
    with np.errstate(invalid="ignore"):
        means = total / count
    starts = np.round(np.arange(size) * BLOCK_SECS * 1e9).astype(np.int64)
    return _channel(name, kind, analysis.signals.start_ns + starts, means)


def _single(analysis: Analysis, name: str, kind: str, value: float) -> Channel:
    """Return a number of the whole trial as a channel of one sample."""
    return _channel(name, kind, np.array([analysis.signals.start_ns]), np.array([value]))


def _channel(name: str, kind: str, timestamps: TimeArray, values: FloatArray) -> Channel:
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    tolerance = {"tolerance": repr(_TOLERANCES[kind] * largest)}
    unit = _UNITS.get(name, "1")
    return Channel(name, kind, unit, timestamps, timestamps, values, metadata=tolerance)
