"""The current that a filter finds where positions are among its measurements."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, hypot, nan, pi

MIN_STDS = 2.0  # standard deviations by which the speed of a current must exceed zero


@dataclass(frozen=True)
class Current:
    """The current at the end of a trial, and the ship's drift length.

    Attributes
    ----------
    north, east
        Its velocity over ground, m/s.
    north_std, east_std
        Standard deviations, m/s.
    drift_length, drift_length_std
        The sway to port over the yaw rate, and its standard deviation, m.
    reason
        Why the standard deviations are too small; empty where they are right.
    """

    north: float
    east: float
    north_std: float
    east_std: float
    drift_length: float
    drift_length_std: float
    reason: str = ""

    @property
    def speed(self) -> float:
        """Speed, m/s: what a navigator calls drift."""
        return hypot(self.north, self.east)

    @property
    def direction(self) -> float:
        """Direction into which it flows, 0 to 2π rad from north to east: its set."""
        return atan2(self.east, self.north) % (2 * pi)

    @property
    def speed_std(self) -> float:
        """Standard deviation of the speed, m/s, if north and east err alike; else it is smaller."""
        along = abs(self.north) * self.north_std + abs(self.east) * self.east_std
        return along / self.speed if self.speed else nan

    @property
    def direction_std(self) -> float:
        """Standard deviation of the direction, rad, if north and east err alike; likewise."""
        across = abs(self.east) * self.north_std + abs(self.north) * self.east_std
        return across / self.speed**2 if self.speed else nan

    @property
    def determined(self) -> bool:
        """Whether it differs from none, so that it has a direction."""
        least = MIN_STDS * max(self.north_std, self.east_std)
        return not self.reason and self.speed > least


def current_of(last: Mapping[str, tuple[float, float]], reason: str = "") -> Current | None:
    """Return the current, from value and standard deviation of each further estimate at the end.

    None where the filter has no current; `reason` is that of the `Current`.

    Examples
    --------
    >>> last = {"current_north": (0.3, 0.1), "current_east": (-0.4, 0.1)}
    >>> last["drift_length"] = (60.0, 5.0)
    >>> round(current_of(last).speed, 3), current_of(last).determined, current_of({})
    (0.5, True, None)
    """
    if "current_north" not in last:
        return None
    (north, north_std), (east, east_std) = last["current_north"], last["current_east"]
    return Current(north, east, north_std, east_std, *last["drift_length"], reason)
