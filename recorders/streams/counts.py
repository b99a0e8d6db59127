"""Counts of what a stream received: packets by kind, and rejected packets by reason."""

from collections import Counter
from collections.abc import Mapping

MAX_KINDS = 256  # names come from the wire; more than these are counted together
_OTHER = "other kinds"


class StreamCounts:
    """Counts of packets, bounded in number whatever is received.

    Examples
    --------
    >>> counts = StreamCounts()
    >>> counts.accept("HEROT")
    >>> counts.reject("wrong checksum")
    >>> dict(counts.accepted), dict(counts.rejected)
    ({'HEROT': 1}, {'wrong checksum': 1})
    """

    def __init__(self) -> None:
        self._accepted: Counter[str] = Counter()
        self._rejected: Counter[str] = Counter()
        self._unused: Counter[str] = Counter()

    @property
    def accepted(self) -> Mapping[str, int]:
        """The number of packets from which samples were decoded, by kind (talker and sentence)."""
        return self._accepted

    @property
    def rejected(self) -> Mapping[str, int]:
        """The number of packets that are not what they should be, by reason."""
        return self._rejected

    @property
    def unused(self) -> Mapping[str, int]:
        """The number of valid packets of a kind that is not decoded, or of no value, by kind."""
        return self._unused

    def accept(self, kind: str) -> None:
        """Count a packet from which samples were decoded."""
        _count(self._accepted, kind)

    def reject(self, reason: str, packets: int = 1) -> None:
        """Count packets that are not what they should be."""
        self._rejected[reason] += packets

    def skip(self, kind: str) -> None:
        """Count a valid packet that is not decoded."""
        _count(self._unused, kind)


def _count(counter: Counter[str], kind: str) -> None:
    counter[kind if kind in counter or len(counter) < MAX_KINDS else _OTHER] += 1
