"""Tests of recorders.nmea2000.line_formats against the parsers of the library nmea2000."""

from pathlib import Path

import pytest
from decoded_streams import damaged, file_lines
from nmea2000 import _canboat

from recorders.nmea2000.canboat_library import FrameError
from recorders.nmea2000.line_formats import (
    FORMATS,
    StampKind,
    detect_format,
    find_format,
    is_assembled,
)
from shiplog.errors import UsageError

LINES = {  # our format: the library's parser, lines
    "canboat": (
        "plain",
        (
            b"2026-11-29T08:00:00.125Z,2,127250,27,255,8,ff,10,27,ff,7f,ff,7f,fc",
            b"2011-11-24-22:42:04.388,2,127251,36,255,8,7d,0b,7d,02,00,ff,ff,ff",
        ),
    ),
    "candump": (
        "candump",
        (
            b"(1745600961.335462) can0 09F1121B#FF1027FF7FFF7FFC",
            b"(1745600961.335462) can0 09F1121B#FF1027FF7FFF7FFC R",
            b"  can0  09F1121B   [8]  FF 10 27 FF 7F FF 7F FC",
            b"  vcan0  09F1121B   [3]  FF 10 27   '..'",
        ),
    ),
    "yacht-devices": ("ydwg02", (b"17:33:21.107 R 09F1121B FF 10 27 FF 7F FF 7F FC",)),
    "actisense-ascii": ("actisense_ascii", (b"A173321.107 1BFF2 1F112 FF1027FF7FFF7FFC",)),
    "ikonvert": ("ikonvert", (b"!PDGY,127250,2,27,255,481.734,/xAn/3//f/w=",)),
}
CASES = [(name, parser, line) for name, (parser, lines) in LINES.items() for line in lines]


@pytest.mark.parametrize(("name", "parser", "line"), CASES)
def test_a_line_has_the_frame_that_the_library_finds(name: str, parser: str, line: bytes) -> None:
    _, pgn, source, destination, data = _canboat.parse_line(parser, line.decode())
    frame = FORMATS[name].frame(line)
    assert frame is not None
    assert frame[:4] == (pgn, source, destination, data)


@pytest.mark.parametrize(("name", "parser", "line"), CASES)
def test_the_format_of_a_line_is_detected(name: str, parser: str, line: bytes) -> None:
    del parser
    found = detect_format([b"garbage", line])
    assert found is not None
    assert found.name == name


@pytest.mark.parametrize(
    ("name", "line", "reason"),
    [
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,17,255,8,00,ff", "differs"),
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,17,255,2,00,ff,7f", "differs"),
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,17,255,2,00,fg", "hexadecimal"),
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,17,255,0", "without data"),
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,256,255,1,00", "address"),
        ("canboat", b"2016-04-09T16:41:09.078Z,3,127257,17,255,9999,00", "1785 bytes"),
        ("canboat", b"2016-04-09T16:41", "malformed"),
        ("candump", b"(1.0) can0 123#00", "11-bit"),
        ("candump", b"(1.0) can0 20000004#0000000000000000", "error frame"),
        ("candump", b"(1.0) can0 09F1121B#FF102", "hexadecimal"),
        ("candump", b" can0  09F1121B   [8]  FF 10 27", "differs"),
        ("candump", b"(1.0) can0 09F1121B#", "without data"),
        ("yacht-devices", b"17:33:21.107 R FFFFFFFF 01", "error frame"),
        ("yacht-devices", b"17:33:21.107 R 123 01", "malformed"),
        ("yacht-devices", b"17:33:21.107 R 09F1121B 00 01 02 03 04 05 06 07 08", "malformed"),
        ("actisense-ascii", b"A173321.107 1BFF2 1F112 FF1", "hexadecimal"),
        ("ikonvert", b"!PDGY,127250,2,3,255,481.734,2C20A", "Base64"),
        ("ikonvert", b"!PDGY,127250,2,3$PDGY,000000,4,,5,603,1,0", "malformed"),
    ],
)
def test_a_malformed_line_is_rejected_with_its_reason(name: str, line: bytes, reason: str) -> None:
    with pytest.raises(FrameError, match=reason):
        FORMATS[name].frame(line)


@pytest.mark.parametrize("line", [b"# format=FAST", b"", b"  ", b"$PDGY,000000,4,,5,482,1,0"])
def test_comments_and_status_lines_are_no_frames(line: bytes) -> None:
    assert FORMATS["ikonvert"].frame(line) is None


def test_no_format_is_detected_in_other_text() -> None:
    assert detect_format([b"$HEHDT,123.4,T*12", b"\x00\xff\xaa\x55"]) is None


def test_an_unknown_name_of_a_format_is_answered_with_the_known_ones() -> None:
    with pytest.raises(UsageError, match=r"did you mean 'candump'.*yacht-devices"):
        find_format("candamp")


def _candump(stamps: list[float]) -> list[bytes]:
    return [b"(%010.6f) can0 09F1121B#FF1027FF7FFF7FFC" % stamp for stamp in stamps]


def test_small_stamps_of_candump_are_elapsed_times_where_they_never_decrease() -> None:
    found = detect_format(_candump([0.01 * n for n in range(30)]))
    assert found is not None
    assert found.stamp is StampKind.ELAPSED


def test_small_stamps_of_candump_are_intervals_where_they_decrease() -> None:
    found = detect_format(_candump([0.0, 0.02, 0.01, 0.03]))
    assert found is not None
    assert found.stamp is StampKind.INTERVAL


def test_too_few_small_stamps_of_candump_are_ambiguous() -> None:
    with pytest.raises(UsageError, match="--line-format candump-elapsed or candump-intervals"):
        detect_format(_candump([0.0, 0.01, 0.02]))


def test_a_long_line_or_the_header_of_canboat_shows_whole_messages() -> None:
    short, long = (
        b"2026-11-29T08:00:00.125Z,2,129029,27,255,%d" % length + length * b",00"
        for length in (8, 43)
    )
    assert not is_assembled([short])
    assert is_assembled([short, long])
    assert is_assembled([b"# format=FAST", short])


def test_no_damaged_line_raises_anything_but_a_rejection() -> None:
    lines = [line for _, _, line in CASES]
    rejected = accepted = 0
    for line in damaged(lines, 20_000, seed=1):
        for line_format in FORMATS.values():
            try:
                frame = line_format.frame(line)
            except FrameError:
                rejected += 1
            else:
                accepted += frame is not None
                assert frame is None or 0 < len(frame.data) <= 1785
    assert rejected > 100_000
    assert accepted > 500  # some damage hits what is no data, or makes other valid data


def test_the_frames_of_the_recordings_are_those_of_the_library(recordings: Path) -> None:
    files = {
        "furuno-130842-wide-turn.raw": ("canboat", "plain"),
        "actisense-522.candump.log": ("candump", "candump"),
        "ikonvert.log": ("ikonvert", "ikonvert"),
    }
    for name, (ours, theirs) in files.items():
        for line in file_lines(recordings / "nmea2000" / name)[:2000]:
            try:
                frame = FORMATS[ours].frame(line)
            except FrameError:
                continue
            if frame is not None:
                assert _canboat.parse_line(theirs, line.decode())[1:] == frame[:4]
