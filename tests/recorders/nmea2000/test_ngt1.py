"""Tests of recorders.nmea2000.ngt1, on a pseudo-terminal in the place of the gateway."""

import os
import pty
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from decoded_streams import decode_file, decode_live

from recorders.nmea2000.canboat_library import ngt1_codec
from recorders.nmea2000.cli import NMEA2000
from recorders.nmea2000.ngt1 import NgtSplitter
from recorders.streams.reception_clock import ReceptionClock
from recorders.transports.transport import Transport
from shiplog.errors import LogError, UsageError

RATE = bytes.fromhex("0000000001ffffff")  # 0.524288 rad/s
ASKS_FOR_ALL = bytes.fromhex("1002a10311020049 1003")


def message(pgn: int, data: bytes, source: int = 27) -> bytes:
    """Return a message as an NGT-1 sends it: framed, with doubled DLE and a checksum."""
    content = bytes([2]) + pgn.to_bytes(3, "little") + bytes([255, source]) + bytes(4)
    content += bytes([len(data)]) + data
    body = bytes([0x93, len(content)]) + content
    body += bytes([-sum(body) & 0xFF])
    return b"\x10\x02" + body.replace(b"\x10", b"\x10\x10") + b"\x10\x03"


@contextmanager
def _gateway() -> Iterator[tuple[int, Transport]]:
    controller, port = pty.openpty()
    tty.setraw(port)
    transport = NMEA2000.open_transport(f"ngt1://{os.ttyname(port)}", ReceptionClock())
    assert transport is not None
    try:
        transport.open()
        yield controller, transport
    finally:
        transport.close()
        os.close(controller)
        os.close(port)


def test_a_gateway_is_asked_for_all_messages_and_its_messages_are_decoded() -> None:
    with _gateway() as (controller, transport):
        assert ASKS_FOR_ALL in os.read(controller, 1000)
        os.write(controller, b"\xff\x10\x03" + message(127251, RATE)[:9])
        os.write(controller, message(127251, RATE)[9:] + message(127251, RATE, 0x10))
        packets = [p.data for _ in range(5) for p in transport.receive(0.1)]
    decoded = decode_live(NMEA2000, packets)
    assert decoded.values("/yaw_rate/27") == [0.524288]
    assert decoded.values("/yaw_rate/16") == [0.524288]


def test_a_message_with_a_wrong_checksum_is_counted_and_the_next_one_read() -> None:
    splitter = NgtSplitter(ngt1_codec())
    wrong = message(127251, RATE).replace(b"\x00\x01\xff", b"\x00\x02\xff")
    lines = splitter.lines(message(127251, RATE) + wrong + message(127251, RATE))
    decoded = decode_live(NMEA2000, lines)
    assert decoded.values("/yaw_rate/27") == [0.524288] * 2
    assert decoded.counts.rejected == {"malformed line": 1}


def test_random_bytes_raise_nothing_and_need_no_memory() -> None:
    splitter, rng = NgtSplitter(ngt1_codec()), np.random.default_rng(1)
    for _ in range(2000):
        splitter.lines(rng.bytes(500))
    splitter.lines(b"\x10\x02" + b"x" * 1_000_000 + b"\x10\x03")
    assert splitter.lines(message(127251, RATE) * 2)[-1] == b"1BFF2 1F113 0000000001FFFFFF"


@pytest.mark.parametrize(
    "address",
    [
        "ngt1://",
        "ngt1://[",
        "ngt1:///dev/ttyUSB0?baud=fast",
        "ngt1:///dev/ttyUSB0?baud=",
        f"ngt1:///dev/ttyUSB0?baud={'9' * 5000}",
        "ngt1:///dev/ttyUSB0?bits=8",
    ],
)
def test_a_wrong_address_is_refused_with_the_form(address: str) -> None:
    with pytest.raises(UsageError, match=r"the address of an NGT-1 is ngt1:///dev/ttyUSB0"):
        NMEA2000.open_transport(address, ReceptionClock())


@pytest.mark.parametrize("start", [b"\x1b\x01", b"\x10\x02"])
def test_a_binary_log_is_refused_with_the_way_to_convert_it(start: bytes) -> None:
    with pytest.raises(LogError, match="export it as text, with its times, by Actisense's EBL"):
        decode_file(NMEA2000, [start + b"\x93\x13\x02\x01\xf1", b"\x01\xff"])
