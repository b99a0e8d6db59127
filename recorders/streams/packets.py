"""Packets: what a transport receives, with the time of reception."""

from collections.abc import Iterator
from typing import NamedTuple

END_NS = 2**63  # in the year 2262: times are 64-bit numbers
NO_TIME = -1  # `received_ns` of a packet whose time is not known (a file without stamps)
MAX_PACKET_BYTES = 4096  # a longer line is cut there, and rejected by its decoder


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


Batches = Iterator[list[Packet]]
"""Batches of packets in the order of reception. A live transport yields an empty batch when nothing
was received for a while, so that what follows can act on time; a file ends the iteration."""
