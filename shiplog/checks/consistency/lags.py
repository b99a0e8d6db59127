"""Lags between channels: heading against yaw rate, and speed against position fixes."""

from dataclasses import dataclass
from math import isfinite

from .ground_velocity import GroundVelocity
from .turning_ratio import TurningRatio

MIN_CORRELATION = 0.98  # of the turns of two channels, from which their lag is that of one signal
MIN_RATIO, MAX_RATIO = 0.8, 1.25  # of their turns: beyond it, a unit is wrong


@dataclass(frozen=True)
class Lag:
    """By how much one channel lags another.

    Attributes
    ----------
    channel, reference
        The names of the two.
    secs
        The lag, s; negative where the reference lags the channel.
    error_secs
        Its standard error, s.
    """

    channel: str
    reference: str
    secs: float
    error_secs: float


def heading_lag(turns: TurningRatio | None) -> Lag | None:
    """Return the lag of the heading against the yaw rate; None where the two turn unlike.

    Parameters
    ----------
    turns
        The turns of the heading over those of the yaw rate; None where either does not turn.
    """
    if turns is None or abs(turns.correlation) < MIN_CORRELATION:
        return None
    if not MIN_RATIO < turns.ratio < MAX_RATIO:
        return None
    return Lag("heading", "yaw_rate", turns.lag_secs, turns.lag_error_secs)


def speed_lag(velocity: GroundVelocity | None) -> Lag | None:
    """Return the lag of the speed against the fixes; None where their velocity was not fitted."""
    if velocity is None or not isfinite(velocity.lag_secs):
        return None
    return Lag("speed", "position", velocity.lag_secs, velocity.lag_error_secs)
