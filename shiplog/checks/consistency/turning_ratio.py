"""Ratio of the turns that two channels measure, with its standard error, and their lag."""

from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

from .window_fit import fit_windows

MIN_WINDOWS = 12  # independent ones
MAX_ROWS = 4000


@dataclass(frozen=True)
class TurningRatio:
    """The turn of one channel over that of another.

    Attributes
    ----------
    ratio
        The ratio; negative where the senses are opposite.
    error
        Its standard error.
    correlation
        Correlation of the two over the windows.
    turns
        Standard deviation of the second channel's turns over the windows, rad.
    lag_secs, lag_error_secs
        By how much the second channel lags the first, with its standard error.
    """

    ratio: float
    error: float
    correlation: float
    turns: float
    lag_secs: float
    lag_error_secs: float


def turning_ratio(dt: float, x: FloatArray, y: FloatArray) -> TurningRatio | None:
    """Fit y(t) - y(t - W) = k [x(t) - x(t - W)] + c - k T [x'(t) - x'(t - W)].

    Parameters
    ----------
    dt
        Step of the clock, s.
    x, y
        (n,) angles, rad; NaN where unknown.

    Returns
    -------
    TurningRatio or None
        The ratio k and the lag T, over the window W with the highest correlation; None where the
        channels turn too little.
    """
    best: TurningRatio | None = None
    for window_secs in (10.0, 30.0, 90.0):
        length = max(round(window_secs / dt), 2)
        result = _over_windows(dt, x, y, length)
        if result and (best is None or abs(result.correlation) > abs(best.correlation) + 0.02):
            best = result
    return best


def _over_windows(dt: float, x: FloatArray, y: FloatArray, length: int) -> TurningRatio | None:
    half = max(round(1.0 / dt), 1)
    if len(x) < MIN_WINDOWS * length // 2 + 2 * half:
        return None
    slope = np.full_like(x, np.nan)
    slope[half:-half] = (x[2 * half :] - x[: -2 * half]) / (2 * half * dt)
    complete = _complete(x + y + slope, length)
    step = max(length // 10, len(x) // MAX_ROWS, 1)
    dx, dy, ds = (
        (each[length:] - each[:-length])[::step][complete[::step]] for each in (x, y, slope)
    )
    lags = -(-length // step)
    if len(dx) < MIN_WINDOWS * lags / 2 or min(np.std(dx), np.std(dy)) <= 1e-12:
        return None
    dy = dy - dy.mean()
    fit = fit_windows(np.column_stack((dx - dx.mean(), ds - ds.mean())), dy, lags)
    if fit is None or fit[0][0] == 0:
        return None
    (ratio, product), errors = fit
    correlation = float(np.corrcoef(dx, dy)[0, 1])
    return TurningRatio(
        float(ratio), float(errors[0]), correlation, float(np.std(dy)),
        float(-product / ratio), float(errors[1] / abs(ratio)),
    )  # fmt: skip


def _complete(values: FloatArray, length: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which windows of `length` steps have no NaN, (n - length,)."""
    missing = np.concatenate(([0], np.cumsum(np.isnan(values))))
    return np.asarray(missing[length + 1 :] == missing[: -length - 1])
