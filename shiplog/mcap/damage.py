"""Damaged parts of a file: where they are, and what was lost by them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .summary import McapSummary

MAX_NAMED = 200  # damaged parts with a warning each; a hostile file has 100,000


@dataclass(frozen=True)
class Damage:
    """A damaged part of a file.

    Attributes
    ----------
    start, end
        The offsets of its first byte and of the byte after its last.
    text
        What is damaged, and what that means, in words.
    is_lost
        Whether something of the file could not be read because of it.
    topics
        The topics that lost messages, as far as they are known.
    span_ns
        The times of reception of the lost messages, ns, the last included; None if unknown.
    file
        The name of the file, where a log has several.
    """

    start: int
    end: int
    text: str
    is_lost: bool = True
    topics: tuple[str, ...] = ()
    span_ns: tuple[int, int] | None = None
    file: str = ""

    def __str__(self) -> str:
        is_one = self.end == self.start + 1
        where = f"byte {self.start}" if is_one else f"bytes {self.start} to {self.end}"
        return f"damaged at {where}{f' of {self.file}' if self.file else ''}: {self.text}"


def span_text(span_ns: tuple[int, int]) -> str:
    """Return a span of times in words, to the millisecond.

    Examples
    --------
    >>> span_text((0, 1_500_000_000))
    'from 1970-01-01T00:00:00.000 to 1970-01-01T00:00:01.500'
    """
    first, last = np.array(span_ns, "M8[ns]").astype("M8[ms]")
    return f"from {first} to {last}"


def is_any_lost(damage: Iterable[Damage]) -> bool:
    """Whether something could not be read because of any of these."""
    return any(part.is_lost for part in damage)


def damage_warnings(damage: Sequence[Damage]) -> list[str]:
    """Return a warning for each damaged part, up to `MAX_NAMED`, and one for all others.

    Examples
    --------
    >>> damage_warnings([Damage(n, n + 1, "a wrong opcode") for n in range(300)])[-2:]
    ['damaged at byte 199: a wrong opcode', 'damaged in 100 further places, up to byte 300']
    """
    warnings = [str(each) for each in damage[:MAX_NAMED]]
    if more := damage[MAX_NAMED:]:
        place = f"up to byte {more[-1].end}{f' of {more[-1].file}' if more[-1].file else ''}"
        warnings.append(f"damaged in {len(more)} further places, {place}")
    return warnings


def lost_messages_text(messages: int, topics: Iterable[str], span_ns: tuple[int, int]) -> str:
    """Return in words what was lost; of an unknown number, 0, or span, of zeros, without it.

    Examples
    --------
    >>> lost_messages_text(20, ["/rudder/gauge"], (0, 1))[:29]
    'lost 20 messages of /rudder/g'
    >>> lost_messages_text(0, [], (0, 0))
    'lost the samples'
    """
    number = f"{messages} messages" if messages else "the samples"
    of_topics = f" of {', '.join(topics)}" if topics else ""
    received = f" received {span_text(span_ns)}" if any(span_ns) else ""
    return f"lost {number}{of_topics}{received}"


def gap_damage(start: int, end: int, summary: McapSummary | None) -> Damage:
    """Return what is lost where no record can be read, as far as the summary shows it.

    Parameters
    ----------
    start, end
        The offsets of the first byte and of the byte after the last.
    summary
        The summary, or None.
    """
    text = "no record can be read there"
    located = summary.mcap_chunk_locations() if summary and summary.is_verified else None
    if summary is None or located is None:
        return Damage(start, end, f"{text}; samples may be lost")
    lost = [each for each in located if start <= each.offset < end and each.channel_ids]
    if lost:
        ids = sorted(set().union(*(each.channel_ids for each in lost)))
        topics = tuple(summary.channels[id_].topic for id_ in ids if id_ in summary.channels)
        span = min(each.first_ns for each in lost), max(each.last_ns for each in lost)
        lost_text = lost_messages_text(0, topics, span)
        return Damage(start, end, f"{text}: {lost_text}", topics=topics, span_ns=span)
    others = (*summary.attachment_offsets, *summary.metadata_offsets)
    if any(start <= offset < end for offset in others):
        return Damage(start, end, f"{text}: an attachment or metadata are lost")
    return Damage(start, end, f"{text}, and no samples were there", is_lost=False)
