"""Sensor errors and coefficients of the wind as the filter found them, determined or not."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, nan

import numpy as np

from analysis.filters.further_parts import HOUR, RandomWalk
from analysis.filters.wind_terms import SURGE, WIND_TERMS
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.units import display_conversion

from .residuals import ResidualSummary

DETERMINED_SHARE = 1 / 3  # of the standard deviation at the start
MAX_NIS = 2.0  # mean normalised innovation squared: above it the standard deviations are wrong
MAX_CHANGE_STDS = 5.0  # of an error in half a trial, in the standard deviations stated for it
SLOW_SENSOR_ERRORS = "heading or model have slow errors; state a larger filter.heading_std"
SLOW_WIND_ERRORS = "the wind measured on board is not that on the ship, or the model is wrong"
OTHER_MODEL = "give another model with --vessel"
LARGER_NOISE = {
    **dict.fromkeys(PAPER_OUTPUTS, "set filter.process_ratio to auto"),
    "heading": "state a larger filter.heading_std",
    **dict.fromkeys(("north", "east"), "state a larger filter.position_std"),
}
# the channels in whose units further estimates are shown
DISPLAYED_AS = {
    "gyro": "yaw_rate", "log": "speed", "current_north": "speed", "current_east": "speed",
}  # fmt: skip


WIND_DISPLAY_SPEED = 10.0  # m/s: a coefficient is shown as what it gives in such a wind


def further_display(name: str, unit: str) -> tuple[str, float]:
    """Return the unit in which a further estimate of a filter is shown, and the factor to it.

    Parameters
    ----------
    name, unit
        As in `FurtherStates`.

    Examples
    --------
    >>> further_display("log_scale", "1")
    ('%', 100.0)

    The coefficient of the wind's force is shown as the force in a relative wind of 10 m/s:

    >>> further_display("wind_head", "1/m")
    ('mm/s²', 100000.0)
    """
    if name in WIND_TERMS:
        square = WIND_DISPLAY_SPEED**2
        if WIND_TERMS[name].axis == SURGE:
            return "mm/s²", square * 1e3
        return "10⁻⁶ deg/s³", square * degrees(1) * 1e6
    return ("%", 100.0) if unit == "1" else display_conversion(DISPLAYED_AS.get(name, name), unit)


@dataclass(frozen=True)
class SlowState:
    """A sensor error or a coefficient of the wind found by the filter, at the end of the trial.

    Attributes
    ----------
    name, label, unit
        One of `SENSOR_ERRORS` or `WIND_TERMS`, its name in words, and its SI unit.
    value, std
        The estimate and its standard deviation; NaN where it was not estimated.
    prior_std
        Its standard deviation before the trial.
    determined
        Whether the log determines it: its standard deviation has fallen below a third.
    reason
        Why it is not determined; empty where it is.

    Examples
    --------
    >>> value, std, prior_std = 3.5e-4, 1.7e-6, 1.7e-3
    >>> print(SlowState("gyro", "gyro bias", "rad/s", value, std, prior_std, True))
    gyro bias: 0.02005 ± 9.7e-05 deg/s
    """

    name: str
    label: str
    unit: str
    value: float
    std: float
    prior_std: float
    determined: bool
    reason: str = ""

    def __str__(self) -> str:
        """Describe it in one line."""
        unit, factor = further_display(self.name, self.unit)
        if np.isnan(self.value):
            return f"{self.label}: not estimated: {self.reason}"
        size = f"{self.value * factor:.4g} ± {self.std * factor:.2g} {unit}"
        return f"{self.label}: {size}" + (f", not determined: {self.reason}" if self.reason else "")


@dataclass(frozen=True)
class Middle:
    """Value and standard deviation of each further estimate, `secs` before the end of a trial."""

    values: Mapping[str, tuple[float, float]]
    secs: float

    def change(self, name: str, walk: RandomWalk, value: float, std: float) -> float:
        """Return the change since then over the standard deviation stated for it; 0 if unknown."""
        if name not in self.values:
            return 0.0
        before, std_before = self.values[name]
        variance = std**2 + std_before**2 + walk.hourly_std**2 / HOUR * self.secs
        return float(abs(value - before) / np.sqrt(variance))


def slow_states(
    walks: Mapping[str, RandomWalk],
    estimated: tuple[str, ...],
    omitted: Mapping[str, str],
    last: Mapping[str, tuple[float, float]],
    middle: Middle,
    inconsistency: str,
) -> tuple[SlowState, ...]:
    """Return the sensor errors, or the coefficients of the wind, that were found.

    Parameters
    ----------
    walks
        All that there are, by name.
    estimated
        Those that are states of the filter.
    omitted
        Why some that were asked for are not estimated, or cannot be determined by this log.
    last
        Value and standard deviation of each at the end of the trial.
    middle
        The same at half time: an error that has changed by more than its standard deviations allow
        follows errors of model or heading that are not white.
    inconsistency
        Why the standard deviations are too small, as in `inconsistency_of`; empty where they are
        right.
    """
    found = []
    for name, walk in walks.items():
        if name in estimated:
            value, std = last[name]
            reason = inconsistency
            if middle.change(name, walk, value, std) > MAX_CHANGE_STDS:
                unit, factor = further_display(name, walk.unit)
                reason = (
                    f"it was {middle.values[name][0] * factor:.4g} {unit} at half time: "
                    f"{SLOW_WIND_ERRORS if name in WIND_TERMS else SLOW_SENSOR_ERRORS}"
                )
            if std >= DETERMINED_SHARE * walk.std:
                unit, factor = further_display(name, walk.unit)
                reason = f"without this log it is 0 ± {walk.std * factor:.2g} {unit}"
            reason = omitted.get(name, reason)
        elif name in omitted:
            value, std, reason = nan, nan, omitted[name]
        else:
            continue
        found.append(
            SlowState(name, walk.label, walk.unit, value, std, walk.std, not reason, reason)
        )
    return tuple(found)


def inconsistency_of(residuals: Sequence[ResidualSummary], tuned: tuple[bool, bool]) -> str:
    """Return why the standard deviations are too small; empty where they are right.

    Parameters
    ----------
    residuals
        The tests of the innovations, those of yaw rate and speed first.
    tuned
        Whether the process noise of yaw and surge was estimated from the log.
    """
    wrong = [residual.name for residual in residuals if residual.mean_nis > MAX_NIS]
    if not wrong:
        return ""
    remedies = dict.fromkeys(noise_remedy(name, tuned) for name in wrong)
    return (
        f"the innovations of {' and '.join(wrong)} are larger than expected: the model or the noise"
        f" does not fit; {', and '.join(remedies)}"
    )


def noise_remedy(output: str, tuned: tuple[bool, bool]) -> str:
    """Return what makes the innovations of an output as large as expected.

    Examples
    --------
    >>> noise_remedy("speed", (True, True)), noise_remedy("heading", (True, True))
    ('give another model with --vessel', 'state a larger filter.heading_std')
    """
    is_tuned = dict(zip(PAPER_OUTPUTS, tuned, strict=True))
    return OTHER_MODEL if is_tuned.get(output) else LARGER_NOISE[output]
