"""Packets: what a transport receives, with the time of reception."""

from collections.abc import Iterator
from typing import NamedTuple

END_NS = 2**63  # in the year 2262: times are 64-bit numbers
NO_TIME = -1  # `received_ns` of a packet whose time is not known (a file without stamps)
MAX_PACKET_BYTES = 4096  # a longer line is cut there, and rejected by its decoder
_FEW_LINES = 8  # a packet may have so many lines of any length
_SHORTEST_LINE_BYTES = 8  # of further ones, on the average


class Packet(NamedTuple):
    """A line without its end, a datagram, or a frame.

    Attributes
    ----------
    data
        The bytes, at most `MAX_PACKET_BYTES` of a line; a line of that length was cut.
    received_ns
        The time of reception, ns since 1970-01-01 UTC, or `NO_TIME`.
    origin
        The address of the sender, where there are several; else empty.
    """

    data: bytes
    received_ns: int
    origin: str = ""


def packet_lines(data: bytes) -> list[bytes]:
    r"""Return the lines of a packet, without those that are empty.

    A packet with more lines than can mean anything is returned as one line, which its decoder
    rejects: with a few such datagrams a second, one sender would hold up all streams.

    Examples
    --------
    >>> packet_lines(b"$HEHDT,1,T*30\r\n\r\n$HEHDT,2,T*33"), len(packet_lines(b"a\n" * 30_000))
    ([b'$HEHDT,1,T*30', b'$HEHDT,2,T*33'], 1)
    """
    if b"\n" not in data and b"\r" not in data:
        return [data]
    lines = [line for line in data.splitlines() if line] or [b""]
    return [data] if has_too_many(len(lines), data) else lines


def has_too_many(lines: int, data: bytes) -> bool:
    """Whether a packet has more lines, or starts of them, than can mean anything."""
    return lines > _FEW_LINES + len(data) // _SHORTEST_LINE_BYTES


Batches = Iterator[list[Packet]]
"""Batches of packets in the order of reception. A live transport yields an empty batch when nothing
was received for a while, so that what follows can act on time; a file ends the iteration."""
