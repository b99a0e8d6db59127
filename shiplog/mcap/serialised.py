"""Serialised messages: raw packets and events, before they are laid out in MCAP chunks.

The message of a raw packet has one field of bytes. It is made by hand, since a ship's networks send
tens of thousands of packets a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from shiplog.types import Event, RawPackets, TimeArray

_DATA_TAG = b"\x0a"  # field 1, a length and as many bytes


@dataclass(frozen=True, eq=False)
class SerialisedMessages:
    """Messages of one channel of the file, of any lengths.

    Attributes
    ----------
    received_ns, measured_ns
        (n,) times, ns since 1970-01-01 UTC.
    messages
        n serialised messages.
    """

    received_ns: TimeArray
    measured_ns: TimeArray
    messages: Sequence[bytes]

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.messages)

    def part(self, start: int, stop: int) -> "SerialisedMessages":
        """Return the messages with the numbers `start` to `stop` - 1."""
        rows = slice(start, stop)
        return SerialisedMessages(
            self.received_ns[rows], self.measured_ns[rows], self.messages[rows]
        )


def serialise_packets(packets: RawPackets) -> SerialisedMessages:
    """Return raw packets as messages ``shiplog.Raw``.

    Examples
    --------
    >>> packets = RawPackets("gyro", "nmea0183", np.array([0]), (b"$HEROT,1.5,A*2E",))
    >>> len(serialise_packets(packets).messages[0]) - len(packets.data[0])
    2
    """
    messages = [_raw_head(len(data)) + data for data in packets.data]
    return SerialisedMessages(packets.received_ns, packets.received_ns, messages)


def packet_of(message: bytes) -> bytes:
    """Return the packet of a message ``shiplog.Raw``.

    Raises
    ------
    ValueError
        It is no such message.

    Examples
    --------
    >>> packet_of(serialise_packets(RawPackets("a", "b", np.array([0]), (b"$X",))).messages[0])
    b'$X'
    """
    for head_size in (2, 3, 4):
        if message[:head_size] == _raw_head(len(message) - head_size):
            return message[head_size:]
    from .messages import decode_packet  # noqa: PLC0415 - written by another program

    return decode_packet(message)


def serialise_events(events: Sequence[Event], earliest_received_ns: int) -> SerialisedMessages:
    """Return events as messages ``foxglove.Log``, in the order of their times.

    Parameters
    ----------
    events
        The events.
    earliest_received_ns
        The time of reception, ns, of events before it: an event may be reported late, while a file
        is in the order of reception.
    """
    from .messages import encode_event  # noqa: PLC0415 - protobuf takes long to import

    events = sorted(events, key=lambda event: event.time_ns)
    times = np.array([event.time_ns for event in events], np.int64)
    received = np.maximum(times, earliest_received_ns)
    return SerialisedMessages(received, times, [encode_event(event) for event in events])


def concatenate_messages(parts: Sequence[SerialisedMessages]) -> SerialisedMessages:
    """Join consecutive messages of one channel of the file."""
    if len(parts) == 1:
        return parts[0]
    return SerialisedMessages(
        np.concatenate([part.received_ns for part in parts]),
        np.concatenate([part.measured_ns for part in parts]),
        [message for part in parts for message in part.messages],
    )


@cache
def _raw_head(length: int) -> bytes:
    """Return the tag and the length (a varint) before the bytes of a packet."""
    if length < 0:
        return b""
    head = bytearray(_DATA_TAG)
    while length > 0x7F:
        head.append(length & 0x7F | 0x80)
        length >>= 7
    head.append(length)
    return bytes(head)
