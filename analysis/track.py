"""Where the ship went."""

from dataclasses import dataclass

import numpy as np

from shiplog import Channel, TrialLog
from shiplog.schema import GEOGRAPHIC
from shiplog.types import FloatArray, Signals

EARTH_RADIUS = 6_371_008.8  # m, mean


@dataclass(frozen=True, eq=False)
class Track:
    """Positions in m from the first one."""

    time_secs: FloatArray  # (k,) since the signals' start
    north: FloatArray  # (k,)
    east: FloatArray  # (k,)
    origin: str  # how it is known, in words


def find_track(log: TrialLog, signals: Signals, yaw_rate: FloatArray, speed: FloatArray) -> Track:
    """The positions recorded, or else dead reckoning from heading and speed ahead.

    `yaw_rate` and `speed` are the filter's, (n,) on the signals' clock; where there is no heading
    the yaw rate is integrated.
    """
    position = log.get("position")
    if position is not None and np.isfinite(position.values).all(axis=1).sum() > 1:
        return _recorded(position, signals)
    heading = np.cumsum(yaw_rate) * signals.dt_secs
    origin = "dead reckoning from yaw rate and speed ahead"
    known = np.isfinite(signals["heading"]) if "heading" in signals else np.zeros(0, bool)
    if known.any():  # the yaw rate bridges where the compass was silent
        at = np.arange(len(signals))
        heading = heading + np.interp(at, at[known], (signals["heading"] - heading)[known])
        origin = "dead reckoning from heading and speed ahead"
    north = np.cumsum(speed * np.cos(heading)) * signals.dt_secs
    east = np.cumsum(speed * np.sin(heading)) * signals.dt_secs
    return Track(signals.time_secs, north - north[0], east - east[0], origin)


def _recorded(position: Channel, signals: Signals) -> Track:
    known = np.isfinite(position.values).all(axis=1)
    first, second = position.values[known, 0], position.values[known, 1]
    if position.fields == GEOGRAPHIC:
        second = np.radians(second) * EARTH_RADIUS * np.cos(np.radians(first[0]))
        first = np.radians(first) * EARTH_RADIUS
    at = (position.measured_ns[known] - signals.start_ns) * 1e-9
    return Track(at, first - first[0], second - second[0], "positions recorded")
