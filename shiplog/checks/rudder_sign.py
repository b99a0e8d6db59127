"""Check of the rudder's sign: a positive rudder must turn the bow to starboard."""

import numpy as np

from shiplog.types import Channel, FloatArray, Log

from .channel_stats import ChannelStats, LogStats
from .interpolate import Interpolator, valid_samples
from .log_stats import compute_log_stats

WINDOW_SECS = 10.0  # over which the rudder's effect on the yaw rate is measured
MIN_WINDOWS = 12  # that a record must have room for
MIN_RUDDER_STD = 0.015  # rad, of the mean rudder over a window: with less the sign is not decided
SIGNIFICANT_ERRORS = 3.0  # standard errors by which the effect must be negative
MIN_AHEAD_SHARE = 0.2  # of the median speed: below it the ship counts as stopped
MAX_CONDITION = 1e6  # of the regression: beyond it rudder and yaw rate cannot be separated


def rudder_sign_warning(log: Log) -> str | None:
    """Warn if a positive rudder turns the bow to port.

    Over windows of length W, the equation r(t + W) - r(t) = a ∫U r + b ∫U² δ + c W is solved for
    a, b and c by least squares. U is the speed over its median, or 1 where it is not measured: the
    forces on hull and rudder grow with it in this way. b is positive where the signs follow the
    convention. The equation is in integral form because derivatives of the measured yaw rate
    would be mostly noise. The standard error of b accounts for the overlap of the windows.

    Returns
    -------
    str or None
        One line with the finding and the remedy. None where the sign is right, where a channel is
        missing, or where the rudder moved too little.

    References
    ----------
    W. K. Newey and K. D. West, A simple, positive semi-definite, heteroskedasticity and
    autocorrelation consistent covariance matrix, Econometrica 55 (1987).

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> rudder_sign_warning(log) is None
    True
    """
    check = RudderSignCheck(compute_log_stats(log))
    for chunk in log.chunks():
        check.add(chunk)
    return check.result()


class RudderSignCheck:
    """The check of `rudder_sign_warning` for a log that comes chunk by chunk.

    Parameters
    ----------
    stats
        Statistics of the whole log.
    """

    def __init__(self, stats: LogStats) -> None:
        self._rudder, yaw_rate = stats.get("rudder"), stats.get("yaw_rate")
        self._dt, self._start = 0.0, 0
        self._interpolators: dict[ChannelStats, Interpolator] = {}
        if self._rudder is None or yaw_rate is None:
            return
        sampled = [channel for channel in (yaw_rate, self._rudder) if not channel.hold]
        if min((channel.valid for channel in sampled), default=0) < 2 * MIN_WINDOWS:
            return
        start = max(yaw_rate.valid_span_ns[0], self._rudder.valid_span_ns[0])
        span = (min(channel.valid_span_ns[1] for channel in sampled) - start) * 1e-9
        dt = max(yaw_rate.interval_secs, WINDOW_SECS / 100, span / 100_000)
        if span < 2 * MIN_WINDOWS * dt:
            return
        self._dt, self._start, at = dt, start, np.arange(int(span / dt) + 1) * dt
        self._interpolators = {
            channel: Interpolator(at, channel.gap_threshold_secs, hold=channel.hold is not None)
            for channel in (yaw_rate, self._rudder)
        }
        self._names = ["yaw_rate", "rudder"]
        for name in ("speed", "rpm"):
            channel = stats.get(name)
            if channel is not None and channel.valid:
                self._interpolators[channel] = Interpolator(at)
                self._names.append(name)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        for stats, interpolator in self._interpolators.items():
            channel = stats.select(chunk)
            if channel is not None:
                interpolator.add(*valid_samples(channel, self._start))

    def result(self) -> str | None:
        """Return the warning, or None, once all samples were added."""
        ratio = self.significance()
        if self._rudder is None or ratio > -SIGNIFICANT_ERRORS:
            return None
        return (
            f"{self._rudder.topic}: its sign is reversed, a positive rudder turns the bow to port "
            f"(by {-ratio:.0f} standard errors) and must turn it to starboard; "
            "reverse the rudder's sign in the layout (sign = -1, or 1 where it is -1) "
            "or in the recorder"
        )

    def significance(self) -> float:
        """Return the rudder's effect over its standard error; 0 where it is not determined.

        Stretches astern or stopped do not count: there the rudder acts weakly or the other way.
        """
        if not self._interpolators:
            return 0.0
        values = {
            name: each.result()
            for name, each in zip(self._names, self._interpolators.values(), strict=True)
        }
        r, delta, speed = values["yaw_rate"], values["rudder"], values.get("speed")
        if speed is not None and np.any(speed):
            r = np.where(speed > MIN_AHEAD_SHARE * np.median(np.abs(speed)), r, np.nan)
        if "rpm" in values:
            r = np.where(values["rpm"] >= 0, r, np.nan)
        relative = np.ones_like(r) if speed is None else _relative_speed(speed)
        window = min(WINDOW_SECS, len(r) * self._dt / MIN_WINDOWS)
        length = max(round(window / self._dt), 1)
        effect = _rudder_effect(self._dt, r, delta, relative, length)
        return effect[0] / effect[1] if effect is not None and effect[1] > 0 else 0.0


def _relative_speed(speed: FloatArray) -> FloatArray:
    """Return the speed over its median, (n,), limited to 0.1 to 10; 1 if the ship lay still."""
    median = float(np.median(speed))
    return np.clip(speed / median, 0.1, 10.0) if median > 0 else np.ones_like(speed)


def _rudder_effect(
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
    X = (integrals[length:] - integrals[:-length])[complete]
    y = (r[length:] - r[:-length])[complete]
    if len(y) < length * MIN_WINDOWS / 2 or np.std(X[:, 1]) < MIN_RUDDER_STD * length * dt:
        return None
    scale = np.sqrt(np.mean(X**2, axis=0))
    if np.any(scale == 0) or np.linalg.cond(X / scale) > MAX_CONDITION:
        return None
    X /= scale
    solution, *_ = np.linalg.lstsq(X, y, rcond=None)
    error = _standard_errors(X, y - X @ solution, 2 * length)[1]
    return float(solution[1] / scale[1]), float(error / scale[1])


def _standard_errors(X: FloatArray, residual: FloatArray, lags: int) -> FloatArray:
    """Newey-West standard errors of least squares, (k,), with residuals correlated over `lags`.

    A copy of `analysis.regression.newey_west`, which this package must not import; these few rows
    need no compiled loop.
    """
    moments = X * residual[:, None]
    middle = moments.T @ moments
    for lag in range(1, min(lags, len(X) - 1)):
        cross = moments[lag:].T @ moments[:-lag]
        middle += (1 - lag / lags) * (cross + cross.T)
    inverse = np.linalg.inv(X.T @ X)
    errors: FloatArray = np.sqrt(np.abs(np.diag(inverse @ middle @ inverse)))
    return errors
