"""Tests of recorders.streams.line_files."""

import io
import sys
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import pytest

from recorders.streams.line_files import peek, read_lines
from recorders.streams.packets import MAX_PACKET_BYTES, NO_TIME, Batches, Packet
from shiplog.errors import LogError


def _lines(batches: Batches) -> list[bytes]:
    return [packet.data for batch in batches for packet in batch]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lines_of_any_end_are_packets_without_times(tmp_path: Path, end: bytes) -> None:
    path = tmp_path / "gyro.log"
    path.write_bytes(b"$HEHDT,1,T" + end + b"\0\xff" + end + end + b"$HEHDT,2,T")
    packets = [packet for batch in read_lines(str(path)) for packet in batch]
    assert [packet.data for packet in packets] == [b"$HEHDT,1,T", b"\0\xff", b"$HEHDT,2,T"]
    assert {packet.received_ns for packet in packets} == {NO_TIME}


def test_lines_across_blocks_are_whole(tmp_path: Path) -> None:
    lines = [f"$HEHDT,{n},T".encode() for n in range(50_000)]
    path = tmp_path / "gyro.log"
    path.write_bytes(b"\n".join(lines))
    assert _lines(read_lines(str(path))) == lines


def test_a_file_without_line_ends_is_one_cut_line_in_bounded_memory(tmp_path: Path) -> None:
    path = tmp_path / "zeros.bin"
    path.write_bytes(bytes(20_000_000))
    tracemalloc.start()
    lines = _lines(read_lines(str(path)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert [len(line) for line in lines] == [MAX_PACKET_BYTES]
    assert peak < 2_000_000


def test_an_empty_file_has_no_batch(tmp_path: Path) -> None:
    path = tmp_path / "empty.log"
    path.touch()
    assert list(read_lines(str(path))) == []


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"cannot be read \(No such file.*none\.log"):
        list(read_lines(str(tmp_path / "none.log")))


def test_a_dash_is_the_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(b"a\nb")))
    assert _lines(read_lines("-")) == [b"a", b"b"]


@pytest.mark.parametrize("count", [0, 1, 2, 3, 9])
def test_a_peek_takes_nothing_from_the_stream(count: int) -> None:
    packets = [Packet(bytes([n]), NO_TIME) for n in range(5)]
    head, batches = peek(iter([packets[:2], packets[2:]]), count)
    assert head == packets[:count]
    assert [packet for batch in batches for packet in batch] == packets
