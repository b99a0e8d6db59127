"""Counts of what a stream received: packets by kind, rejected ones by reason, and warnings."""

from collections import Counter
from collections.abc import Mapping

MAX_WARNINGS = 100
MAX_KINDS = 256  # names come from the wire; more than these are counted together
MAX_KIND_CHARS = 100
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
        self._flagged: Counter[str] = Counter()
        self._notes: dict[str, str] = {}
        self._warnings: list[tuple[int | None, str]] = []
        self._taken = 0

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

    @property
    def flagged(self) -> Mapping[str, int]:
        """The number of accepted packets with values that the sender marks as invalid, by kind."""
        return self._flagged

    @property
    def notes(self) -> Mapping[str, str]:
        """What else is known of the stream, as texts by key, for the metadata of the log."""
        return self._notes

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is doubtful about the stream, one line each; the first `MAX_WARNINGS` of them."""
        return tuple(text for _, text in self._warnings)

    def accept(self, kind: str) -> None:
        """Count a packet from which samples were decoded."""
        if kind in self._accepted:
            self._accepted[kind] += 1
        else:
            _count(self._accepted, kind)

    def reject(self, reason: str, packets: int = 1) -> None:
        """Count packets that are not what they should be."""
        _count(self._rejected, reason, packets)

    def skip(self, kind: str, packets: int = 1) -> None:
        """Count valid packets that are not decoded."""
        _count(self._unused, kind, packets)

    def flag(self, kind: str) -> None:
        """Count an accepted packet with values that its sender marks as invalid."""
        _count(self._flagged, kind)

    def note(self, key: str, text: str) -> None:
        """Keep a text for the metadata of the log; a later one of the same key replaces it."""
        if key in self._notes or len(self._notes) < MAX_KINDS:
            self._notes[key] = text

    def warn(self, text: str, time_ns: int | None = None) -> None:
        """Keep a warning, with its time where it has one; it becomes an event of the log."""
        if len(self._warnings) < MAX_WARNINGS:
            self._warnings.append((time_ns, text))

    def take_warnings(self) -> list[tuple[int | None, str]]:
        """Return the warnings since the last call, with their times."""
        new, self._taken = self._warnings[self._taken :], len(self._warnings)
        return new


def _count(counter: Counter[str], kind: str, packets: int = 1) -> None:
    if kind not in counter:
        kind = kind[:MAX_KIND_CHARS]
    if packets:
        counter[kind if kind in counter or len(counter) < MAX_KINDS else _OTHER] += packets
