"""Tests of recorders.streams.packets: the lines of a packet, bounded in number."""

import pytest
from decoded_streams import decode_live
from sentences import sentence

from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.nmea2000.cli import NMEA2000
from recorders.signalk.cli import SIGNALK
from recorders.streams.format import StreamFormat
from recorders.streams.packets import packet_lines


def test_empty_lines_are_none() -> None:
    assert packet_lines(b"\r\na\r\n\nb\n") == [b"a", b"b"]


@pytest.mark.parametrize("data", [b"", b"a"])
def test_a_packet_without_line_ends_is_one_line(data: bytes) -> None:
    assert packet_lines(data) == [data]


def test_a_packet_of_line_ends_is_one_empty_line() -> None:
    assert packet_lines(b"\r\n" * 1000) == [b""]


@pytest.mark.parametrize("flood", [b"$", b"!a", b"\\$", b"$\n", b"a\n", b"a\r"])
@pytest.mark.parametrize("stream_format", [NMEA0183, NMEA2000, SIGNALK], ids=lambda f: f.name)
def test_a_datagram_of_very_short_lines_is_rejected_as_one(
    stream_format: StreamFormat, flood: bytes
) -> None:
    counts = decode_live(stream_format, [flood * (65_000 // len(flood))]).counts
    assert sum(counts.rejected.values()) == 1
    assert not counts.accepted


def test_a_datagram_full_of_sentences_is_read() -> None:
    line = sentence("TIROT,6.0,A") + b"\r\n"
    counts = decode_live(NMEA0183, [line * (65_000 // len(line))]).counts
    assert counts.accepted == {"TIROT": 65_000 // len(line)}
