"""Whether a positive rudder turns the bow to starboard, as the convention has it."""

import numpy as np

from .clock import gap_threshold_secs, usual_period_secs
from .types import Channel, FloatArray, TimeArray, TrialLog

WINDOW_SECS = 10.0  # over which the rudder's effect on the yaw rate is looked at
WINDOWS = 12  # at least so many of them must fit into a record
RUDDER_STD = 0.015  # rad: with less movement of the rudder nothing can be said
SIGNIFICANT = 3.0  # standard errors
MAX_CONDITION = 1e6  # beyond it rudder and yaw rate cannot be told apart


def rudder_sign_warning(log: TrialLog) -> str | None:
    """A sentence if the data say that a positive rudder turns the bow to port, else None.

    Over windows of length W, r(t + W) - r(t) = a ∫U r + b ∫U² δ + c W is solved for a, b and c by
    least squares, U being the speed over its median (1 where there is none): so the forces on hull
    and rudder grow. b is positive where the signs follow the convention. Integrals stand where
    derivatives would only show the noise, and the standard error of b takes the windows' overlap
    into account (Newey and West, 1987). None where a channel is missing, or the rudder moved too
    little to tell.
    """
    rudder, yaw_rate = log.get("rudder"), log.get("yaw_rate")
    if rudder is None or yaw_rate is None:
        return None
    grid = _common_grid(rudder, yaw_rate, log.get("speed"))
    if grid is None:
        return None
    dt, r, delta, speed = grid
    window = min(WINDOW_SECS, len(r) * dt / WINDOWS)
    effect = _rudder_effect(dt, r, delta, speed, max(round(window / dt), 1))
    if effect is None or effect[0] > -SIGNIFICANT * effect[1]:
        return None
    return (
        f"{rudder.topic}: its sign is contrary, positive turns the bow to port, "
        f"by {-effect[0] / effect[1]:.0f} standard errors; "
        "set the rudder's sign = -1 in the layout, or turn it in the recorder"
    )


Grid = tuple[float, FloatArray, FloatArray, FloatArray]


def _common_grid(rudder: Channel, yaw_rate: Channel, speed: Channel | None) -> Grid | None:
    """A step, yaw rate and rudder at it, NaN in gaps, and relative speed; None for too little."""
    rate_at, rates = _measured(yaw_rate)
    rudder_at, angles = _measured(rudder)
    if min(len(rates), len(angles)) < 2 * WINDOWS:
        return None
    start, end = max(rate_at[0], rudder_at[0]), min(rate_at[-1], rudder_at[-1])
    span = (end - start) * 1e-9
    dt = max(usual_period_secs(yaw_rate), WINDOW_SECS / 100, span / 100_000)
    if span < 2 * WINDOWS * dt:
        return None
    at = np.arange(int(span / dt) + 1) * dt
    r = _between(at, (rate_at - start) * 1e-9, rates, gap_threshold_secs(yaw_rate))
    delta = _between(at, (rudder_at - start) * 1e-9, angles, gap_threshold_secs(rudder))
    return dt, r, delta, _relative_speed(at, start, speed)


def _measured(channel: Channel) -> tuple[TimeArray, FloatArray]:
    """The times and values of the samples that were measured, in order."""
    good = np.isfinite(channel.values)
    order = np.argsort(channel.measured_ns[good], kind="stable")
    return channel.measured_ns[good][order], channel.values[good][order]


def _between(at: FloatArray, times: FloatArray, values: FloatArray, gap_secs: float) -> FloatArray:
    """Linear between the samples, NaN in gaps."""
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    gap = times[after] - times[after - 1] > gap_secs
    return np.where(gap, np.nan, np.interp(at, times, values))


def _relative_speed(at: FloatArray, start: np.int64, speed: Channel | None) -> FloatArray:
    """The speed over its median; 1 where it is not known, or the ship did not make way."""
    if speed is None or not np.isfinite(speed.values).any():
        return np.ones_like(at)
    times, values = _measured(speed)
    placed = np.interp(at, (times - start) * 1e-9, values)
    usual = float(np.median(placed))
    return np.clip(placed / usual, 0.1, 10.0) if usual > 0 else np.ones_like(at)


def _rudder_effect(
    dt: float, r: FloatArray, delta: FloatArray, speed: FloatArray, length: int
) -> tuple[float, float] | None:
    """The rudder's coefficient, 1/s^2, and its standard error; None if nothing can be said."""
    gone = np.isnan(r) | np.isnan(delta)
    r, delta = np.where(gone, 0.0, r), np.where(gone, 0.0, delta)
    forces = np.stack([speed * r, speed**2 * delta, np.ones_like(r)], axis=1)
    sums = np.concatenate(
        [np.zeros((1, 3)), np.cumsum((forces[1:] + forces[:-1]) * (dt / 2), axis=0)]
    )
    lost = np.cumsum(gone)
    whole = (lost[length:] == lost[:-length]) & ~gone[:-length]
    X, y = (sums[length:] - sums[:-length])[whole], (r[length:] - r[:-length])[whole]
    if len(y) < length * WINDOWS / 2 or np.std(X[:, 1]) < RUDDER_STD * length * dt:
        return None
    scale = np.sqrt(np.mean(X**2, axis=0))
    if np.any(scale == 0) or np.linalg.cond(X / scale) > MAX_CONDITION:
        return None
    X /= scale
    solved, *_ = np.linalg.lstsq(X, y, rcond=None)
    error = _standard_errors(X, y - X @ solved, 2 * length)[1]
    return float(solved[1] / scale[1]), float(error / scale[1])


def _standard_errors(X: FloatArray, residual: FloatArray, lags: int) -> FloatArray:
    """Of least squares whose residuals stay alike over so many rows (Newey and West, 1987)."""
    moments = X * residual[:, None]
    middle = moments.T @ moments
    for lag in range(1, min(lags, len(X) - 1)):
        cross = moments[lag:].T @ moments[:-lag]
        middle += (1 - lag / lags) * (cross + cross.T)
    inverse = np.linalg.inv(X.T @ X)
    errors: FloatArray = np.sqrt(np.abs(np.diag(inverse @ middle @ inverse)))
    return errors
