"""Uncertainty of the indices of a manoeuvre, by source, and their 95 % intervals.

The indices are computed again from signals with other noise and other sampling instants (a
parametric bootstrap), and with each systematic error changed by its standard deviation (the
propagation of JCGM 100:2008, "Guide to the expression of uncertainty in measurement", 5.1.2).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shiplog.types import FloatArray

from .execute import APPROACH_SECS, smooth_heading
from .found_manoeuvre import FoundManoeuvre
from .manoeuvre_values import VALUES, IndexCase, index_case, smoothed
from .start_rules import Execute
from .trial_signals import TrialSignals
from .water_velocity import VelocityErrors, corrected_signals

MIN_DRAWN_SHARE = 0.5  # of the draws that reach an index: fewer give no bias of it
DRAWS = 40  # of the noise and the sampling instants
SEED = 1
COVERAGE_FACTOR = 1.959963984540054  # of 95 %, normal distribution
NOISE, VELOCITY, START, APPROACH, COMPASS, GYRO, NEUTRAL = (
    "sensor noise and sampling", "current, log and compass", "start rule", "approach heading",
    "slow error of the compass", "gyro bias", "neutral rudder",
)  # fmt: skip
GYRO_BIAS_STD = np.radians(0.005)  # rad/s, of a heading that is the integral of the yaw rate
WANDER_SECS = 60.0  # before the execute, over which the wander of the heading is taken
WANDER_SMOOTHING_SECS = 5.0  # half width: helm moves a heading more slowly
WANDER_SHARE = 0.5  # of its variance, that a mean over 30 s of periods of a minute keeps
SMOOTHING_GAIN = 9 / 4  # of n samples' noise variance over that of their parabola, times n
SAMPLED = ("heading", "yaw_rate", "speed", "sway", "positions")


@dataclass(frozen=True, eq=False)
class IndexInputs:
    """What the indices of a manoeuvre are computed from.

    Attributes
    ----------
    signals
        As measured, of the manoeuvre and its approach, without NaN where measured.
    found
        The manoeuvre; its samples are those of the signals.
    execute
        The execute.
    switch
        Of a zig-zag the switch heading, rad; else NaN.
    half_secs
        Half width of the heading's smoothing, s.
    errors
        Current and systematic errors.
    antenna
        Place of the antenna ahead and to starboard of the midship point, m.
    compass_change_std
        Assumed standard deviation of the compass's error in a change of heading, rad; None where
        the heading is the integral of the yaw rate.
    """

    signals: TrialSignals
    found: FoundManoeuvre
    execute: Execute
    switch: float
    half_secs: float
    errors: VelocityErrors
    antenna: tuple[float, float]
    compass_change_std: float | None

    def case(
        self,
        *,
        signals: TrialSignals | None = None,
        errors: FloatArray | None = None,
        execute: float | None = None,
    ) -> IndexCase:
        """Return the case of these inputs, or of others."""
        corrected = corrected_signals(
            self.signals if signals is None else signals,
            self.errors.mean if errors is None else errors,
            self.antenna,
        )
        at = self.execute.sample if execute is None else execute
        return index_case(corrected, self.found, at, self.half_secs, self.switch)


@dataclass(frozen=True)
class NoiseDraws:
    """Indices of a manoeuvre's smoothed signals, and of those with noise and sampling once more.

    Attributes
    ----------
    smooth
        By name, of the smoothed signals.
    drawn
        The same for each draw; NaN for what it does not reach.
    """

    smooth: Mapping[str, float]
    drawn: Sequence[Mapping[str, float]]

    def of(self, name: str) -> FloatArray:
        """Return the finite values of an index, (k,)."""
        values = np.array([each[name] for each in self.drawn])
        finite: FloatArray = values[np.isfinite(values)]
        return finite


def index_values(case: IndexCase) -> dict[str, float]:
    """Compute the indices of a case, whatever manoeuvre it is."""
    return VALUES[case.found.kind](case)


def index_stds(
    inputs: IndexInputs, values: Mapping[str, float], draws: NoiseDraws
) -> dict[str, dict[str, float]]:
    """Estimate the standard uncertainty of each index by source.

    Parameters
    ----------
    inputs
        Signals, execute and systematic errors.
    values
        The indices of `inputs.case()`.
    draws
        As of `noise_draws`.

    Returns
    -------
    dict
        By the name of the index: standard deviations, in its unit, by the name of the source.
    """
    changes: dict[str, list[dict[str, float]]] = {
        NOISE: [_deviation(values, draws)],
        START: [_start_change(inputs, values)],
        APPROACH: [_heading_change(inputs, values, approach_std(inputs))],
        VELOCITY: _velocity_changes(inputs, values),
    }
    if len(inputs.found.levels):
        changes[NEUTRAL] = [_neutral_change(inputs, values)]
    if inputs.compass_change_std is None:
        changes[GYRO] = [_gyro_change(inputs, values)]
    else:
        std = float(np.hypot(inputs.compass_change_std, inputs.signals.heading_step / np.sqrt(6.0)))
        changes[COMPASS] = [_deflection_change(inputs, values, std)]
    return {
        name: {
            source: float(np.sqrt(sum(change.get(name, 0.0) ** 2 for change in each)))
            for source, each in changes.items()
        }
        for name in values
    }


def _difference(
    values: Mapping[str, float], changed: Callable[[float], IndexCase]
) -> dict[str, float]:
    """Return half the difference of the indices for a change up and down; one-sided if need be."""
    up, down = (index_values(changed(sign)) for sign in (1.0, -1.0))
    found = {}
    for name, value in values.items():
        sides = [abs(each[name] - value) for each in (up, down) if np.isfinite(each[name])]
        both = np.isfinite(up[name]) and np.isfinite(down[name])
        found[name] = abs(up[name] - down[name]) / 2 if both else max(sides, default=0.0)
    return found


def _start_change(inputs: IndexInputs, values: Mapping[str, float]) -> dict[str, float]:
    shift = inputs.execute.std_secs / inputs.signals.dt_secs
    if shift == 0:
        return {}
    return _difference(
        values, lambda sign: inputs.case(execute=inputs.execute.sample + sign * shift)
    )


def _heading_change(
    inputs: IndexInputs, values: Mapping[str, float], std: float
) -> dict[str, float]:
    """Return the changes of the indices where the approach heading has an error, rad."""
    base = inputs.case()
    return _difference(values, lambda sign: replace(base, approach=base.approach + sign * std))


def _deflection_change(
    inputs: IndexInputs, values: Mapping[str, float], std: float
) -> dict[str, float]:
    """Return the changes of the indices where the compass errs after the execute, rad.

    The approach heading and with it the axes of the track stay: only the instants change at which
    a heading is reached.
    """
    base = inputs.case()
    after = np.arange(len(base.signals)) > base.first

    def deflected(sign: float) -> IndexCase:
        heading = base.signals.heading + sign * std * after
        return replace(base, signals=replace(base.signals, heading=heading))

    return _difference(values, deflected)


def approach_std(inputs: IndexInputs) -> float:
    """Estimate the standard uncertainty of the approach heading, rad, from its wander."""
    signals, dt, noise = inputs.signals, inputs.signals.dt_secs, inputs.signals.noise
    execute, heading_noise = round(inputs.execute.sample), noise.get("heading", 0.0)
    window = signals.heading[max(0, execute - round(WANDER_SECS / dt)) : execute + 1]
    half = min(round(WANDER_SMOOTHING_SECS / dt), (len(window) - 1) // 2)
    if half < 2:
        return float(heading_noise)
    per_sample = dt / signals.interval("heading")
    smooth_noise = heading_noise**2 * SMOOTHING_GAIN / max(1.0, (2 * half + 1) * per_sample)
    wander = max(0.0, float(np.var(smooth_heading(window, half))) - smooth_noise)
    samples = max(1.0, min(len(window) * dt, APPROACH_SECS) / signals.interval("heading"))
    return float(np.sqrt(WANDER_SHARE * wander + heading_noise**2 / samples))


def _neutral_change(inputs: IndexInputs, values: Mapping[str, float]) -> dict[str, float]:
    """Return the changes of the indices where the neutral rudder of a spiral has an error."""
    signals, base = inputs.signals, inputs.case()
    window = signals.rudder[max(0, base.first - round(WANDER_SECS / signals.dt_secs)) : base.first]
    if len(window) < 3:
        return {}
    noise = signals.noise.get("rudder", 0.0)
    std = float(np.sqrt(WANDER_SHARE * max(0.0, float(np.var(window)) - noise**2)))
    found = inputs.found

    def shifted(sign: float) -> IndexCase:
        level = found.approach_level + sign * std
        return replace(base, found=replace(found, approach_level=level))

    return _difference(values, shifted)


def _velocity_changes(inputs: IndexInputs, values: Mapping[str, float]) -> list[dict[str, float]]:
    sizes, directions = np.linalg.eigh(inputs.errors.covariance)
    mean = inputs.errors.mean

    def changed(step: FloatArray) -> Callable[[float], IndexCase]:
        return lambda sign: inputs.case(errors=mean + sign * step)

    steps = (np.sqrt(np.maximum(sizes, 0.0)) * directions).T
    return [_difference(values, changed(step)) for step in steps]


def _gyro_change(inputs: IndexInputs, values: Mapping[str, float]) -> dict[str, float]:
    signals = inputs.signals
    time = np.arange(len(signals)) * signals.dt_secs

    def drifted(sign: float) -> IndexCase:
        heading = signals.heading + sign * GYRO_BIAS_STD * time
        return inputs.case(signals=replace(signals, heading=heading))

    return _difference(values, drifted)


def noise_draws(inputs: IndexInputs) -> NoiseDraws:
    """Compute the indices of signals with other noise and other sampling instants."""
    rng = np.random.default_rng(SEED)
    base = smoothed(inputs.signals, inputs.half_secs)
    names = (*SAMPLED, "rudder") if len(inputs.found.levels) else SAMPLED
    drawn = [
        index_values(inputs.case(signals=_sampled_anew(base, rng, names))) for _ in range(DRAWS)
    ]
    return NoiseDraws(index_values(inputs.case(signals=base)), drawn)


def _sampled_anew(
    signals: TrialSignals, rng: np.random.Generator, names: Sequence[str]
) -> TrialSignals:
    """Return signals of which some are sampled at other instants, with other noise."""
    dt, count = signals.dt_secs, len(signals)
    grid = np.arange(count) * dt
    changed: dict[str, Any] = {}
    for name in names:
        key = "position" if name == "positions" else name
        values = getattr(signals, name)
        columns = values.reshape(count, -1)
        if not np.isfinite(columns).all():
            continue
        interval, std = signals.interval(key), signals.noise.get(key, 0.0)
        times = grid
        if interval > 1.01 * dt:
            times = np.arange(-rng.uniform(0.0, interval), grid[-1] + 2 * interval, interval)
        sampled = [
            np.interp(times, grid, column) + rng.normal(0.0, std, len(times))
            for column in columns.T
        ]
        changed[name] = np.column_stack(
            [np.interp(grid, times, column) for column in sampled]
        ).reshape(values.shape)
    return replace(signals, **changed)


def without_noise_bias(values: Mapping[str, float], draws: NoiseDraws) -> dict[str, float]:
    """Return the indices less the bias that noise and sampling give them.

    The largest of noisy headings is too large, the sum of noisy steps too long: the mean of the
    draws exceeds the index of the signals from which they are drawn by as much (Efron and
    Tibshirani, "An introduction to the bootstrap", 1993, chapter 10).

    Parameters
    ----------
    values
        The indices, finite.
    draws
        As of `noise_draws`.
    """
    corrected = dict(values)
    for name, value in values.items():
        drawn = draws.of(name)
        if len(drawn) > MIN_DRAWN_SHARE * DRAWS and np.isfinite(draws.smooth[name]):
            corrected[name] = value - (float(np.mean(drawn)) - draws.smooth[name])
    return corrected


def _deviation(values: Mapping[str, float], draws: NoiseDraws) -> dict[str, float]:
    """Return the standard deviation of each index over the draws."""
    drawn = {name: draws.of(name) for name in values}
    return {
        name: float(np.std(each, ddof=1)) if len(each) > 2 else 0.0 for name, each in drawn.items()
    }
