"""Order in which the MCAP chunks of a file were written, by the sequence numbers of its messages.

A clock that is set back shows as times that run back while the sequence numbers go on. Where those
run back too, the MCAP chunks were exchanged after the recording.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

from .contents import McapContents, SampleBlock
from .damage import Damage


def restore_order(contents: McapContents) -> None:
    """Number the MCAP chunks in the order in which they were written, and report it if it differs.

    Parameters
    ----------
    contents
        What the scan of a whole file has collected. Files whose messages have no sequence numbers,
        or several with the same one, are left as they are.
    """
    ranges = [_ranges(blocks) for blocks in contents.blocks.values()]
    if all(_is_ascending(each) for each in ranges):
        return
    order = _common_order(ranges)
    if order is None:
        return
    rank = dict(zip(order, sorted(order), strict=True))
    contents.blocks = {
        channel_id: sorted(_renumbered(blocks, rank), key=lambda block: block.number)
        for channel_id, blocks in contents.blocks.items()
    }
    contents.event_messages = [
        replace(event, position=event.position + (_moved(event.position >> 32, rank) << 32))
        for event in contents.event_messages
    ]
    misplaced = [contents.block_starts[number] for number in order if rank[number] != number]
    text = (
        "the MCAP chunks are not in the order in which they were written; "
        "they were put in it by the sequence numbers of their messages"
    )
    damage = Damage(min(misplaced), max(misplaced), text, is_lost=False)
    contents.damage.append(damage)


def _ranges(blocks: Iterable[SampleBlock]) -> list[tuple[int, int, int]]:
    """Return the first and last sequence number of each block, and the number of its chunk."""
    return [(*block.sequences, block.number) for block in blocks if len(block.received)]


def _is_ascending(ranges: Sequence[tuple[int, int, int]]) -> bool:
    return all(before[1] < after[0] for before, after in pairwise(ranges))


def _common_order(ranges: Iterable[list[tuple[int, int, int]]]) -> list[int] | None:
    """Return the numbers of the chunks in the order of all sequences; None if they contradict."""
    before: TopologicalSorter[int] = TopologicalSorter()
    for each in map(sorted, ranges):
        if not _is_ascending(each):
            return None
        for earlier, later in pairwise(each):
            before.add(later[2], earlier[2])
    try:
        return list(before.static_order())
    except CycleError:
        return None


def _renumbered(blocks: Iterable[SampleBlock], rank: Mapping[int, int]) -> list[SampleBlock]:
    return [replace(block, number=rank.get(block.number, block.number)) for block in blocks]


def _moved(number: int, rank: Mapping[int, int]) -> int:
    return rank.get(number, number) - number
