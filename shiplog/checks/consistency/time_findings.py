"""Conclusion that the times have a wrong unit, from turns and distances that are wrong alike."""

from collections.abc import Iterator
from math import log

import numpy as np

from shiplog.types import FloatArray

from .findings import Finding

TIME_UNITS = {
    1e3: "ms read as s", 1e6: "us read as s", 60.0: "s read as min", 3600.0: "s read as h",
    1e-3: "s read as ms", 1e-6: "s read as us", 1 / 60: "min read as s", 1 / 3600: "h read as s",
}  # fmt: skip
MIN_SWING = np.radians(3.0)  # of the heading
MIN_DISTANCE = 50.0  # m, of the fixes
MIN_TIME_FACTOR = 500.0  # of the yaw rate, from which its units do not explain it
RAD_PER_DEG_MIN_FACTORS = 3000.0, 4000.0  # about 3438 of deg/min read as rad/s, and 3600 of hours
MIN_CORRELATION = 0.9  # of the turns by yaw rate and heading
# of their sizes where the yaw rate turns too little, as it may be reversed or fail for a while, too
MIN_DEAD_CORRELATION = 0.5
TRACK_LEGS = 40  # on which the distance is measured, so that the noise of the fixes is small in it
FACTOR_TOLERANCE, DISTANCE_TOLERANCE = 0.35, 0.4  # of the logarithms, for a biased yaw rate


def time_findings(
    dt: float,
    turned: FloatArray,
    heading: FloatArray,
    speed: FloatArray,
    track: tuple[FloatArray, FloatArray],
) -> Iterator[Finding]:
    """Report a wrong unit of the times.

    A wrong unit of the times makes the integral of the yaw rate wrong by the same factor as the
    integral of the speed, compared with the heading and with the fixes. Nothing is reported where
    the distances contradict the factor. Without fixes, only factors that no units of the yaw rate
    explain are reported, and only where yaw rate and heading turn alike: the integral of a biased
    yaw rate grows beyond all changes of the heading, that of a dead or stuck one is unrelated.

    Parameters
    ----------
    dt
        Step of the clock, s.
    turned, heading
        (n,) the integral of the yaw rate and the continuous heading, rad.
    speed
        (n,) m/s.
    track
        North and east, (n,) m each.
    """
    known = np.isfinite(turned + heading)
    if np.count_nonzero(known) < TRACK_LEGS or np.ptp(heading[known]) < MIN_SWING:
        return
    swing = float(np.ptp(heading[known]))
    factor = float(np.ptp(turned[known])) / swing
    unit, distances = _unit_of(factor), _distances(dt, speed, *track)
    if unit is None:
        return
    by_speed = ""
    if distances is not None:
        logged, fixed = distances
        if abs(log(logged / fixed / factor)) > DISTANCE_TOLERANCE:
            return
        by_speed = f", and the speed makes {logged:.3g} m where the fixes are {fixed:.3g} m apart"
    elif _explained_by_rate_units(factor) or not _turn_alike(turned, heading, factor):
        return
    yield Finding(
        "unit",
        "time",
        f"times: the integrated yaw rate is {factor:.3g} times the change of the heading{by_speed};"
        f" likely times in {unit}; change in the layout: unit of [time]",
    )


def _unit_of(factor: float) -> str | None:
    """Return the misread unit of time that explains a factor; None where none does."""
    if factor <= 0:
        return None
    best = min(TIME_UNITS, key=lambda each: abs(log(factor / each)))
    return TIME_UNITS[best] if abs(log(factor / best)) < FACTOR_TOLERANCE else None


def _explained_by_rate_units(factor: float) -> bool:
    """Whether a wrong unit of the yaw rate, such as deg/s or deg/min, explains the factor."""
    low, high = RAD_PER_DEG_MIN_FACTORS
    larger = max(factor, 1 / factor)
    return larger < MIN_TIME_FACTOR or low < larger < high


def _turn_alike(turned: FloatArray, heading: FloatArray, factor: float) -> bool:
    """Whether the turns by yaw rate and heading on the legs are correlated."""
    legs = np.linspace(0, len(heading) - 1, TRACK_LEGS + 1).astype(int)
    turns = np.diff(np.stack((turned, heading))[:, legs])
    turns = turns[:, np.isfinite(turns).all(axis=0)]
    if turns.shape[1] < TRACK_LEGS / 2 or np.any(np.std(turns, axis=1) == 0):
        return False
    correlation = float(np.corrcoef(turns)[0, 1])
    if factor > 1:  # a bias makes the integral of the yaw rate too large, never too small
        return correlation > MIN_CORRELATION
    return abs(correlation) > MIN_DEAD_CORRELATION


def _distances(
    dt: float, speed: FloatArray, north: FloatArray, east: FloatArray
) -> tuple[float, float] | None:
    """Return the distance by the speed and by the fixes over the same legs, m."""
    legs = np.linspace(0, len(speed) - 1, TRACK_LEGS + 1).astype(int)
    made_good = np.hypot(np.diff(north[legs]), np.diff(east[legs]))
    sums = np.concatenate(([0.0], np.cumsum(np.abs(np.nan_to_num(speed)) * dt)))
    logged = np.diff(sums[legs])
    known = np.isfinite(made_good) & (logged > 0)
    if np.count_nonzero(known) < TRACK_LEGS / 2 or made_good[known].sum() < MIN_DISTANCE:
        return None
    return float(logged[known].sum()), float(made_good[known].sum())
