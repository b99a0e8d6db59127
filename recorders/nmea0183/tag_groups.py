r"""Groups of sentences (``g:`` of a TAG block): they share the sender and time of their first one.

The sentences ``\g:1-2-34,s:GR0001,c:1401836000*hh\...`` and ``\g:2-2-34*hh\...`` are number 1 and 2
of 2, of the group 34; between them may stand sentences of others (IEC 61162-450).
"""

from collections.abc import Sequence
from typing import NamedTuple

from recorders.streams.packets import NO_TIME, Batches, Packet

from .framing import TagBlock
from .sentence_times import sentences_of

_MAX_GROUPS = 256  # that have begun and are not complete
_MOST = 0.5  # a share of lines


class _Begun(NamedTuple):
    """A group that has begun: the TAG block of its first sentence, and the last number heard."""

    first: TagBlock
    number: int
    total: int


class TagGroups:
    """Completion of the TAG blocks of groups.

    A sentence whose predecessor in the group was lost is not completed: the code of a group is used
    again for a later one. Neither is one of two groups that two senders begin under the same code.
    """

    def __init__(self) -> None:
        self._begun: dict[int, _Begun] = {}

    def complete(self, tag: TagBlock) -> TagBlock:
        """Return a TAG block with sender and time of its group where it has none itself."""
        if tag.group is None:
            return tag
        number, total, code = tag.group
        before = self._begun.pop(code, None)
        if number == 1:
            if before is not None and before.first.source != tag.source:
                return tag  # whose the next sentences are is not known
            first = tag
        elif before is not None and (before.number + 1, before.total) == (number, total):
            first = before.first
            time_ns = first.time_ns if tag.time_ns is None else tag.time_ns
            tag = tag._replace(source=tag.source or first.source, time_ns=time_ns)
        else:
            return tag
        if number < total:
            if len(self._begun) >= _MAX_GROUPS:
                del self._begun[next(iter(self._begun))]  # the oldest one
            self._begun[code] = _Begun(first, number, total)
        return tag


def has_tag_times(head: Sequence[Packet]) -> bool:
    """Whether most lines have a time in their TAG block or that of their group."""
    groups = TagGroups()
    tags = (s.tag for s in sentences_of([packet for packet in head if b"\\" in packet.data]))
    return sum(groups.complete(tag).time_ns is not None for tag in tags) > _MOST * len(head)


def tag_times(batches: Batches) -> Batches:
    """Yield lines with the times of their TAG blocks, or of the group of these.

    A line without one has that of the last line.
    """
    time_ns, groups = NO_TIME, TagGroups()
    for batch in batches:
        done = []
        for packet in batch:
            for sentence in sentences_of([packet]):
                stated_ns = groups.complete(sentence.tag).time_ns
                time_ns = time_ns if stated_ns is None else stated_ns
            if time_ns != NO_TIME:
                done.append(packet._replace(received_ns=time_ns))
        yield done
