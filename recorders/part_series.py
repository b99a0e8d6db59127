"""Metadata of the parts of a divided recording: an index, by which a missing part is noticed."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from shiplog.mcap.damage import span_text
from shiplog.mcap.schema import PART_INDEX, PART_NEXT, PART_NUMBER, PART_SET
from shiplog.types import Event

from .source import Recordable


@dataclass
class PartSeries:
    """One part of a recording, and the parts before it.

    Attributes
    ----------
    set_id
        An identifier that only the parts of this recording have.
    number
        The number of the part, from 1 on.
    index
        What the parts before hold, by number, in words. This part adds itself at its end, so that
        the last part has the index of all.
    """

    set_id: str
    number: int
    index: dict[str, str]
    _messages: int = 0
    _first_ns: int = 2**63 - 1
    _last_ns: int = -(2**63)

    def beginning(self) -> dict[str, str]:
        """Return the metadata that are known when the part begins."""
        return {PART_SET: self.set_id, PART_NUMBER: str(self.number)} | self._index_metadata()

    def add(self, items: Iterable[Recordable]) -> None:
        """Count what was written to the part."""
        for item in items:
            times = np.array([item.time_ns]) if isinstance(item, Event) else item.received_ns
            if len(times):
                self._messages += len(times)
                self._first_ns = min(self._first_ns, int(times.min()))
                self._last_ns = max(self._last_ns, int(times.max()))

    @property
    def span_secs(self) -> float:
        """How long the part lasts by the times of reception in it, s."""
        return max(self._last_ns - self._first_ns, 0) * 1e-9

    def end(self, following: str) -> dict[str, str]:
        """Return the metadata of the end; `following` is the next part's name, empty for none."""
        content = f"{self._messages} messages"
        if self._messages:
            content += f" received {span_text((self._first_ns, self._last_ns))}"
        self.index[str(self.number)] = content
        return self._index_metadata() | ({PART_NEXT: following} if following else {})

    def _index_metadata(self) -> dict[str, str]:
        return {f"{PART_INDEX}{number}": text for number, text in self.index.items()}
