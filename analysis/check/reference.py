"""What a replay found, as a log: the reference of the regression check.

Series are means over blocks of time; each channel carries its own tolerance, in its own unit.
"""

from collections.abc import Iterator

import numpy as np

from analysis.filters.base import STATES
from analysis.regression.coefficients import CoefficientFit
from analysis.regression.sliding import History
from analysis.replay.replay import Analysis
from shiplog import Channel, TrialLog
from shiplog.ships.paper import COEFFICIENT_UNITS, PAPER_OUTPUTS
from shiplog.types import FloatArray, TimeArray

BLOCK_SECS = 4.0

# How far a channel may stray, as a share of its largest value when the reference was made: what
# another processor's rounding may do to it, amplified by the condition of what is solved.
_SHARES = {
    "measured": 1e-12,
    "moment": 1e-12,
    "share": 1e-12,
    "model": 1e-12,
    "assumed": 1e-6,
    "estimate": 1e-9,
    "std": 1e-9,
    "innovation": 1e-9,
    "verdict": 1e-6,
    "whole": 1e-8,
    "whole_std": 1e-7,
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
    """What a replay found, as a log: short blocks, in which nothing slips between."""
    channels = [
        *_measured(analysis),
        *_assumed(analysis),
        *_estimated(analysis),
        *_identified(analysis, analysis.findings.yaw, analysis.yaw_history),
        *_identified(analysis, analysis.findings.surge, analysis.surge_history),
        *_tracked(analysis),
    ]
    metadata = {
        "reference_of": analysis.findings.plan.name,
        "model": analysis.findings.plan.model_origin,
    }
    return TrialLog(analysis.findings.plan.name, tuple(channels), metadata)


def _measured(analysis: Analysis) -> Iterator[Channel]:
    """The mean of each block, a mean that minds the order, and the share that was measured."""
    for name, values in analysis.signals.values.items():
        place = np.arange(len(values)) % 97 / 97
        yield _blocks(analysis, name, "measured", values)
        yield _blocks(analysis, name, "moment", values * place)
        yield _blocks(analysis, f"{name}_known", "share", np.isfinite(values).astype(float))


def _assumed(analysis: Analysis) -> Iterator[Channel]:
    for name, value in analysis.findings.plan.vessel.paper_coefficients._asdict().items():
        yield _single(analysis, name, "model", value)
    noise = analysis.findings.plan.noise
    for i, name in enumerate(PAPER_OUTPUTS):
        yield _single(analysis, f"{name}_noise", "assumed", float(noise.measurement_std[i]))
        yield _single(analysis, f"{name}_ratio", "assumed", float(noise.process_ratio[i]))


def _estimated(analysis: Analysis) -> Iterator[Channel]:
    estimates, found = analysis.estimates, analysis.disturbance
    for i, name in enumerate(STATES):
        yield _blocks(analysis, name, "estimate", estimates.states[:, i])
        yield _blocks(analysis, name, "std", estimates.stds[:, i])
    for i, name in enumerate(PAPER_OUTPUTS):
        yield _blocks(analysis, name, "innovation", estimates.innovations[:, i])
        judged = analysis.findings.residuals[i]
        yield _single(analysis, f"{name}_rms", "verdict", judged.rms)
        yield _single(analysis, f"{name}_squared", "verdict", judged.mean_nis)
        yield _single(analysis, f"{name}_expected", "verdict", judged.nis_band[1])
        yield _single(analysis, f"{name}_whiteness", "verdict", judged.whiteness_p)
        yield _single(analysis, f"{name}_gated", "count", float(judged.gated))
    for kind, course in analysis.findings.disturbances.items():
        yield _blocks(analysis, f"{kind}_disturbance", "estimate", getattr(found, kind))
        yield _single(analysis, f"{kind}_disturbance", "std", course.std)


def _identified(analysis: Analysis, found: CoefficientFit, history: History) -> Iterator[Channel]:
    at = history.time_secs
    for i, (name, whole) in enumerate(found.coefficients.items()):
        yield _single(analysis, name, "whole", whole.value)
        yield _single(analysis, name, "whole_std", whole.std)
        yield _blocks(analysis, name, "history", history.values[:, i], at)
        yield _blocks(analysis, name, "history_std", history.stds[:, i], at)


def _tracked(analysis: Analysis) -> Iterator[Channel]:
    track = analysis.track
    yield _blocks(analysis, "north", "track", track.north, track.time_secs)
    yield _blocks(analysis, "east", "track", track.east, track.time_secs)
    yield _single(analysis, "warnings", "count", float(len(analysis.findings.warnings)))


def _blocks(
    analysis: Analysis, name: str, kind: str, values: FloatArray, at: FloatArray | None = None
) -> Channel:
    """The means of what was there in each block of time; NaN where there was nothing."""
    time_secs = analysis.signals.time_secs if at is None else at
    block = (np.maximum(time_secs, 0) // BLOCK_SECS).astype(np.int64)
    there = np.isfinite(values)
    size = int(np.max(block, initial=0)) + 1
    count = np.bincount(block[there], minlength=size)
    total = np.bincount(block[there], weights=values[there], minlength=size)
    with np.errstate(invalid="ignore"):
        means = total / count
    starts = np.round(np.arange(size) * BLOCK_SECS * 1e9).astype(np.int64)
    return _channel(name, kind, analysis.signals.start_ns + starts, means)


def _single(analysis: Analysis, name: str, kind: str, value: float) -> Channel:
    """A number that is of the whole trial."""
    return _channel(name, kind, np.array([analysis.signals.start_ns]), np.array([value]))


def _channel(name: str, kind: str, stamps: TimeArray, values: FloatArray) -> Channel:
    largest = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
    tolerance = {"tolerance": repr(_SHARES[kind] * largest)}
    unit = _UNITS.get(name, "1")
    return Channel(name, kind, unit, stamps, stamps, values, metadata=tolerance)
