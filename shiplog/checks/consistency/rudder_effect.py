"""Effect of the rudder on the yaw rate: a positive rudder must turn the bow to starboard."""

import numpy as np

from shiplog.types import FloatArray

from .coarse_record import CoarseSignals
from .window_fit import fit_windows

WINDOW_SECS = 10.0  # over which the rudder's effect on the yaw rate is measured
MIN_WINDOWS = 12  # that a record must have room for
MIN_RUDDER_STD = 0.015  # rad, of the mean rudder over a window: with less the sign is not decided
MIN_AHEAD_SHARE = 0.2  # of the median speed: below it the ship counts as stopped
MAX_ROWS = 10_000


def rudder_significance(signals: CoarseSignals) -> float:
    """Return the rudder's effect on the yaw rate over its standard error.

    Over windows of length W, the equation r(t + W) - r(t) = a ∫U r + b ∫U² δ + c W is solved for
    a, b and c by least squares. U is the speed over its median, or 1 where it is not measured: the
    forces on hull and rudder grow with it in this way. b is positive where the signs follow the
    convention. The equation is in integral form because derivatives of the measured yaw rate
    would be mostly noise. The standard error of b accounts for the overlap of the windows.
    Stretches astern or stopped do not count: there the rudder acts weakly or the other way.

    Parameters
    ----------
    signals
        The channels of the log.

    Returns
    -------
    float
        b over its standard error: below zero where the rudder or the yaw rate has the wrong sign;
        0 where it is not determined, as when the rudder moved too little.
    """
    r = np.full_like(signals.yaw, np.nan)
    if len(r) > 2:
        r[1:-1] = (signals.yaw[2:] - signals.yaw[:-2]) / (2 * signals.dt_secs)
    r[_astern_or_stopped(signals)] = np.nan
    known = np.flatnonzero(np.isfinite(r + signals.rudder))
    if len(known) < 2 * MIN_WINDOWS:
        return 0.0
    part = slice(int(known[0]), int(known[-1]) + 1)
    r, rudder, speed = r[part], signals.rudder[part], _relative_speed(signals.speed)[part]
    window = min(WINDOW_SECS, len(r) * signals.dt_secs / MIN_WINDOWS)
    length = max(round(window / signals.dt_secs), 1)
    effect = _effect(signals.dt_secs, r, rudder, speed, length)
    return effect[0] / effect[1] if effect is not None and effect[1] > 0 else 0.0


def _astern_or_stopped(signals: CoarseSignals) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return where the ship does not go ahead, (n,); False where neither speed nor rpm is known."""
    speed = signals.speed
    known = np.isfinite(speed)
    typical = float(np.median(np.abs(speed[known]))) if known.any() else 0.0
    stopped = speed <= MIN_AHEAD_SHARE * typical if typical > 0 else np.zeros(len(speed), bool)
    return np.asarray(stopped | (signals.rpm < 0))


def _relative_speed(speed: FloatArray) -> FloatArray:
    """Return the speed over its median, (n,), limited to 0.1 to 10; 1 where it is not known."""
    known = np.isfinite(speed)
    median = float(np.median(speed[known])) if known.any() else 0.0
    if median <= 0:
        return np.ones_like(speed)
    return np.clip(np.where(known, speed / median, 1.0), 0.1, 10.0)


def _effect(
    dt: float, r: FloatArray, delta: FloatArray, speed: FloatArray, length: int
) -> tuple[float, float] | None:
    """Fit the rudder's coefficient b, 1/s^2, with its standard error; None if undetermined.

    The windows have `length` steps of `dt` seconds.
    """
    missing = np.isnan(r) | np.isnan(delta)
    r, delta = np.where(missing, 0.0, r), np.where(missing, 0.0, delta)
    forces = np.stack([speed * r, speed**2 * delta, np.ones_like(r)], axis=1)
    integrals = np.concatenate(
        [np.zeros((1, 3)), np.cumsum((forces[1:] + forces[:-1]) * (dt / 2), axis=0)]
    )
    missing_before = np.cumsum(missing)
    complete = (missing_before[length:] == missing_before[:-length]) & ~missing[:-length]
    step = max(length // 20, len(r) // MAX_ROWS, 1)
    rows = np.flatnonzero(complete[::step]) * step
    if len(rows) * step < length * MIN_WINDOWS / 2:
        return None
    X, y = integrals[rows + length] - integrals[rows], r[rows + length] - r[rows]
    if np.std(X[:, 1]) < MIN_RUDDER_STD * length * dt:
        return None
    fit = fit_windows(X, y, 2 * -(-length // step) - 1)
    return (float(fit[0][1]), float(fit[1][1])) if fit else None
