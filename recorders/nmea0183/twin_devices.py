"""Detection of two devices that send one quantity under one talker, and so alternate."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import pi

import numpy as np

from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, conversion_factor

CHECKED = frozenset(("yaw_rate", "speed", "rudder", "rpm", "heading", "magnetic_heading"))
_MIN_CHANGES = 50
_MIN_RATIO = 4.0  # of the changes to the next value and to the one after it
_BLOCK = 1024  # values that are summed up at once


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
        self._changes: dict[tuple[str, str], _Changes] = {}  # by topic

    def add(self, channel: str, source: str, value: float) -> None:
        """Add a valid value of a channel of `CHECKED`."""
        changes = self._changes.get((channel, source))
        if changes is None:
            changes = self._changes[channel, source] = _Changes(CATALOGUE[channel].circular)
        changes.values.append(value)
        if len(changes.values) >= _BLOCK:
            changes.sum_up()

    def findings(self) -> Iterator[str]:
        """Yield a warning for each topic that alternates."""
        for (channel, source), changes in self._changes.items():
            changes.sum_up()
            if changes.count >= _MIN_CHANGES and changes.step > _MIN_RATIO * changes.double_step:
                kind = CATALOGUE[channel]
                size = (
                    changes.step / changes.count / conversion_factor(kind.display_unit, kind.unit)
                )
                yield (
                    f"{channel} of {source} alternates by {size:.2g} {kind.display_unit}: two "
                    "devices send it under one talker; give one another"
                )


@dataclass
class _Changes:
    """The values of a topic that are not yet summed up, and sums of the changes between the others.

    Attributes
    ----------
    circular
        Whether the values are angles all around.
    values
        The last two values that were summed up, and those since.
    step, double_step
        Sums of the changes to the next value, and to the one after it.
    count
        The number of changes to the next value.
    """

    circular: bool
    values: list[float] = field(default_factory=list)
    step: float = 0.0
    double_step: float = 0.0
    count: int = 0

    def sum_up(self) -> None:
        """Add the changes up to the last value to the sums."""
        values = np.array(self.values)
        new = values[1:] if self.count else values  # the change before it is in the sum
        with np.errstate(over="ignore", invalid="ignore"):  # numbers from the wire have any size
            self.step += self._size(np.diff(new))
            self.double_step += self._size(values[2:] - values[:-2])
        self.count += max(len(new) - 1, 0)
        self.values = self.values[-2:]

    def _size(self, changes: FloatArray) -> float:
        """Return the sum of the sizes of changes."""
        if self.circular:
            changes = (changes + pi) % (2 * pi) - pi
        return float(np.abs(changes).sum())
