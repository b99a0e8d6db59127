"""Detection of two devices that send one quantity under one talker, and so alternate."""

from collections.abc import Iterator
from math import pi, remainder

from shiplog.units import CATALOGUE, conversion_factor

CHECKED = frozenset(("yaw_rate", "speed", "rudder", "rpm", "heading", "magnetic_heading"))
_MIN_SAMPLES = 50
_MIN_RATIO = 4.0  # of the changes to the next value and to the one after it


class TwinDevices:
    """Changes from sample to sample, and from each to the next but one, of each topic.

    A sensor changes less in one step than in two. Where two devices alternate it is the reverse.

    Examples
    --------
    >>> twins = TwinDevices()
    >>> for n in range(100):
    ...     twins.add("rpm", "RC.shaft1", 70.0 + n % 2)
    >>> next(twins.findings())
    'rpm of RC.shaft1 alternates by 1 rpm: two devices send it under one talker; give one another'
    """

    def __init__(self) -> None:
        # by topic: the last value and the one before, sums of the changes, and their number
        self._changes: dict[tuple[str, str], tuple[float, float, float, float, int]] = {}

    def add(self, channel: str, source: str, value: float) -> None:
        """Add a valid value of a channel of `CHECKED`."""
        topic = channel, source
        last, before, step, double_step, count = self._changes.get(topic, (value, value, 0, 0, 0))
        change, double_change = value - last, value - before
        if CATALOGUE[channel].circular:
            change, double_change = remainder(change, 2 * pi), remainder(double_change, 2 * pi)
        sums = step + abs(change), double_step + abs(double_change)
        self._changes[topic] = (value, last, *sums, count + 1)

    def findings(self) -> Iterator[str]:
        """Yield a warning for each topic that alternates."""
        for (channel, source), (_, _, step, double_step, count) in self._changes.items():
            if count >= _MIN_SAMPLES and step > _MIN_RATIO * double_step:
                kind = CATALOGUE[channel]
                size = step / (count - 1) / conversion_factor(kind.display_unit, kind.unit)
                yield (
                    f"{channel} of {source} alternates by {size:.2g} {kind.display_unit}: two "
                    "devices send it under one talker; give one another"
                )
