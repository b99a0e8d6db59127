"""Whether a positive rudder turns the bow to starboard, as the convention has it."""

import numpy as np

from shiplog.types import Channel, FloatArray, Log

from .channel_stats import ChannelStats, LogStats
from .interpolate import Interpolator, valid_samples
from .log_stats import compute_log_stats

WINDOW_SECS = 10.0  # over which the rudder's effect on the yaw rate is looked at
WINDOWS = 12  # at least so many of them must fit into a record
RUDDER_STD = 0.015  # rad: with less movement of the rudder nothing can be said
SIGNIFICANT = 3.0  # standard errors
MAX_CONDITION = 1e6  # beyond it rudder and yaw rate cannot be told apart


def rudder_sign_warning(log: Log) -> str | None:
    """A sentence if the data say that a positive rudder turns the bow to port, else None.

    Over windows of length W, r(t + W) - r(t) = a ∫U r + b ∫U² δ + c W is solved for a, b and c by
    least squares, U being the speed over its median (1 where there is none): so the forces on hull
    and rudder grow. b is positive where the signs follow the convention. Integrals stand where
    derivatives would only show the noise, and the standard error of b takes the windows' overlap
    into account (Newey and West, 1987). None where a channel is missing, or the rudder moved too
    little to tell.
    """
    watch = RudderSignCheck(compute_log_stats(log))
    for chunk in log.chunks():
        watch.add(chunk)
    return watch.result()


class RudderSignCheck:
    """Looks at rudder, yaw rate and speed as they come, and gives `rudder_sign_warning`'s answer.

    `found` is the log_stats of the log that comes.
    """

    def __init__(self, found: LogStats) -> None:
        self._rudder, yaw_rate = found.get("rudder"), found.get("yaw_rate")
        self._dt, self._start = 0.0, 0
        self._probes: dict[ChannelStats, Interpolator] = {}
        if self._rudder is None or yaw_rate is None:
            return
        if min(yaw_rate.valid, self._rudder.valid) < 2 * WINDOWS:
            return
        start = max(yaw_rate.valid_span_ns[0], self._rudder.valid_span_ns[0])
        span = (min(yaw_rate.valid_span_ns[1], self._rudder.valid_span_ns[1]) - start) * 1e-9
        dt = max(yaw_rate.interval_secs, WINDOW_SECS / 100, span / 100_000)
        if span < 2 * WINDOWS * dt:
            return
        self._dt, self._start, at = dt, start, np.arange(int(span / dt) + 1) * dt
        self._probes = {
            channel: Interpolator(at, channel.gap_threshold_secs)
            for channel in (yaw_rate, self._rudder)
        }
        speed = found.get("speed")
        if speed is not None and speed.valid:
            self._probes[speed] = Interpolator(at)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Take the next samples."""
        for surveyed, probe in self._probes.items():
            channel = surveyed.select(chunk)
            if channel is not None:
                probe.add(*valid_samples(channel, self._start))

    def result(self) -> str | None:
        """What there is to say, once all samples were added."""
        if not self._probes or self._rudder is None:
            return None
        r, delta, *speed = (probe.result() for probe in self._probes.values())
        relative = _relative(speed[0]) if speed else np.ones_like(r)
        window = min(WINDOW_SECS, len(r) * self._dt / WINDOWS)
        length = max(round(window / self._dt), 1)
        effect = _rudder_effect(self._dt, r, delta, relative, length)
        if effect is None or effect[0] > -SIGNIFICANT * effect[1]:
            return None
        return (
            f"{self._rudder.topic}: its sign is contrary, positive turns the bow to port, "
            f"by {-effect[0] / effect[1]:.0f} standard errors; "
            "turn the rudder's sign in the layout (sign = -1, or 1 where it is -1), "
            "or in the recorder"
        )


def _relative(speed: FloatArray) -> FloatArray:
    """The speed over its median; 1 where the ship did not make way."""
    usual = float(np.median(speed))
    return np.clip(speed / usual, 0.1, 10.0) if usual > 0 else np.ones_like(speed)


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
    """Of least squares whose residuals stay alike over so many rows (Newey and West, 1987).

    The core does not know `analysis.regression.newey_west`, and needs no compiled loop here.
    """
    moments = X * residual[:, None]
    middle = moments.T @ moments
    for lag in range(1, min(lags, len(X) - 1)):
        cross = moments[lag:].T @ moments[:-lag]
        middle += (1 - lag / lags) * (cross + cross.T)
    inverse = np.linalg.inv(X.T @ X)
    errors: FloatArray = np.sqrt(np.abs(np.diag(inverse @ middle @ inverse)))
    return errors
