"""Velocity of the fixes against heading and speed, with the current eliminated."""

from dataclasses import dataclass

import numpy as np

from shiplog.types import FloatArray

from .coarse_record import CoarseSignals
from .window_fit import fit_windows

WINDOW_SECS = 10.0  # over which the velocity of the fixes is measured
MIN_WINDOWS = 12  # independent ones
MIN_TURN_SHARE = 0.15  # of all turning, to port and to starboard: drift depends on its side
MAX_ROWS = 4000
MAX_CONDITION = 50.0  # of the regressors; beyond it, heading offset and current are inseparable
MAX_OFFSET_ERROR_DEG = 3.0  # of a fit that is of use
MIN_AHEAD_SHARE = 0.2  # of the median speed: below it the ship, or its log, counts as stopped
MAX_RESIDUAL = 0.25  # root mean square over that of the velocity of a fit that is of use


@dataclass(frozen=True)
class GroundVelocity:
    """What the velocity of the fixes shows of heading and speed.

    Attributes
    ----------
    offset_deg, offset_error_deg
        By how much the heading must be increased, with its standard error.
    scale, scale_error
        The velocity of the fixes over the speed, with its standard error; the current is
        eliminated. NaN without a speed.
    lag_secs, lag_error_secs
        By how much the speed lags the velocity of the fixes, with its standard error; NaN
        without a speed.
    """

    offset_deg: float
    offset_error_deg: float
    scale: float
    scale_error: float
    lag_secs: float
    lag_error_secs: float


def ground_velocity(signals: CoarseSignals) -> GroundVelocity | None:
    """Fit the velocity of the fixes by heading, speed, turning and a steady current.

    With the heading as a direction h in the complex plane, the equation for the displacement over
    a window is Δp = (a + ib) ∫U h dt + d Δh + (e + if) ∫U' h dt + c W: the argument of a + ib is
    the offset of the heading, its absolute value the scale of the speed; d is the drift in turns
    and the distance of the antenna from midship; (e + if)/(a + ib) is the lag of the speed, and c
    the current.

    Parameters
    ----------
    signals
        The channels of the log.

    Returns
    -------
    GroundVelocity or None
        None where a channel is missing, where the ship turned too little or to one side only,
        where the fixes never move, or where the equation does not explain the velocity.
    """
    length = max(round(WINDOW_SECS / signals.dt_secs), 2)
    step = max(length // 10, len(signals.heading) // MAX_ROWS, 1)
    lags = -(-length // step)
    has_speed = bool(np.isfinite(signals.speed).any() and np.nanmax(np.abs(signals.speed)) > 0)
    regressors, displacement = _windows(signals, length, step, has_speed=has_speed)
    known = np.isfinite(regressors.sum(axis=1) + displacement)
    X, y = regressors[known], displacement[known]
    if len(y) < MIN_WINDOWS * lags or not _turns_both_ways(signals.heading[::length]):
        return None
    if not y.any():  # a stuck receiver: no scale, and no offset
        return None
    rows = np.concatenate([np.column_stack((X.real, -X.imag)), np.column_stack((X.imag, X.real))])
    # rows of one window follow each other, so that lags count windows
    order = np.arange(2 * len(y)).reshape(2, -1).T.ravel()
    rows, values = rows[order], np.concatenate([y.real, y.imag])[order]
    fit = fit_windows(rows, values, 2 * lags, MAX_CONDITION)
    if fit is None:
        return None
    residual = values - rows @ fit[0]
    if np.sqrt(np.mean(residual**2)) > MAX_RESIDUAL * np.sqrt(np.mean(values**2)):
        return None
    result = _interpreted(*fit, X.shape[1], has_speed=has_speed)
    return result if result.offset_error_deg < MAX_OFFSET_ERROR_DEG else None


def _windows(
    signals: CoarseSignals, length: int, step: int, *, has_speed: bool
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.complex128]], np.ndarray]:
    """Return the regressors, (n, k), and the displacement, (n,) m, of all windows."""
    dt = signals.dt_secs
    direction = np.exp(1j * signals.heading)
    speed = signals.speed if has_speed else np.ones_like(signals.heading)
    speed = np.where(np.abs(speed) > MIN_AHEAD_SHARE * np.nanmedian(np.abs(speed)), speed, np.nan)
    half = max(round(2.0 / dt), 1)
    columns = [_integral(speed * direction, dt, length)[::step]]
    columns.append((direction[length:] - direction[:-length])[::step])
    columns.append(np.full(len(columns[0]), length * dt, complex))
    if has_speed:
        slope = np.full_like(speed, np.nan)
        slope[half:-half] = (speed[2 * half :] - speed[: -2 * half]) / (2 * half * dt)
        columns.append(_integral(slope * direction, dt, length)[::step])
    track = signals.north + 1j * signals.east
    return np.column_stack(columns), (track[length:] - track[:-length])[::step]


def _integral(values: np.ndarray, dt: float, length: int) -> np.ndarray:
    """Integrate over each window of `length` steps, (n - length,); NaN where a value is missing."""
    missing = ~np.isfinite(values)
    sums = np.concatenate(([0], np.cumsum(np.where(missing, 0.0, values)) * dt))
    gaps = np.concatenate(([0], np.cumsum(missing)))
    trapezoids = sums[length + 1 :] - sums[: -length - 1]
    trapezoids = trapezoids - (values[length:] + values[:-length]) * dt / 2
    complete = gaps[length + 1 :] == gaps[: -length - 1]
    return np.where(complete, trapezoids, np.nan)


def _turns_both_ways(heading: FloatArray) -> bool:
    """Whether a fair share of the turning is to either side."""
    turns = np.diff(heading[np.isfinite(heading)])
    total = float(np.sum(np.abs(turns)))
    share = float(np.sum(turns[turns > 0])) / total if total > 0 else 0.0
    return MIN_TURN_SHARE < share < 1 - MIN_TURN_SHARE


def _interpreted(
    solution: FloatArray, errors: FloatArray, k: int, *, has_speed: bool
) -> GroundVelocity:
    """Return offset, scale and lag from the k complex coefficients, real parts first."""
    a, b = solution[0], solution[k]
    scale = float(np.hypot(a, b))
    offset = np.degrees(np.arctan2(b, a))
    error = float(np.hypot(errors[0], errors[k])) / scale
    lag = lag_error = np.nan
    if has_speed:
        lag = float(((solution[k - 1] + 1j * solution[2 * k - 1]) / (a + 1j * b)).real)
        lag_error = float(np.hypot(errors[k - 1], errors[2 * k - 1])) / scale
    else:
        scale = np.nan
    return GroundVelocity(
        float(offset), float(np.degrees(error)), scale, error * scale, lag, lag_error
    )
