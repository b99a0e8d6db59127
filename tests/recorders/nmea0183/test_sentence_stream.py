"""Tests of recorders.nmea0183.sentence_stream: the options, and how a file gets its times."""

import argparse
from pathlib import Path

import pytest
from sentences import sentence, tagged

from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.streams.format import OpenedFile
from recorders.streams.line_files import read_lines
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.errors import LogError, UsageError
from shiplog.types import Channel

SECOND_NS = 10**9
HDT = sentence("HEHDT,218.53,T").decode()
ZDA = sentence("GPZDA,120000,01,05,2026,,").decode()
LATER = sentence("GPZDA,120001,01,05,2026,,").decode()
NOON_NS = 1_777_636_800 * SECOND_NS  # 2026-05-01 12:00


def _options(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    NMEA0183.configure(parser)
    return parser.parse_args(words)


def _open(tmp_path: Path, lines: list[str], *words: str) -> OpenedFile:
    path = tmp_path / "trial.nmea"
    path.write_text("\r\n".join(lines), encoding="utf-8", newline="")
    return NMEA0183.open_file(read_lines(str(path)), _options(*words))


def _heading(opened: OpenedFile) -> Channel:
    samples = SampleBuffer()
    for batch in opened.batches:
        opened.decoder.decode(batch, samples)
    opened.decoder.finish(samples)
    [heading] = [c for c in samples.take() if isinstance(c, Channel) and c.name == "heading"]
    return heading


def test_stamps_are_times_of_reception(tmp_path: Path) -> None:
    opened = _open(tmp_path, [f"2026-05-01T12:00:00.{n}Z {HDT}" for n in range(3)])
    heading = _heading(opened)
    assert heading.received_ns.tolist() == [NOON_NS, NOON_NS + 10**8, NOON_NS + 2 * 10**8]
    assert heading.measured_ns.tolist() == heading.received_ns.tolist()
    assert opened.decoder.counts.warnings == ()


def test_times_without_stamps_are_those_of_the_sentences(tmp_path: Path) -> None:
    opened = _open(tmp_path, [ZDA, HDT, LATER])
    assert _heading(opened).measured_ns.tolist() == [NOON_NS + SECOND_NS // 2]
    assert opened.decoder.counts.warnings == (
        "no time stamps: times are those of GPZDA, interpolated by the order of lines",
    )


def test_a_file_without_times_needs_an_interval(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"the file has no time.*--interval"):
        _open(tmp_path, [HDT, HDT])
    opened = _open(tmp_path, [HDT, HDT], "--interval", "0.2", "--date", "2026-05-01")
    midnight_ns = NOON_NS - 12 * 3600 * SECOND_NS
    assert _heading(opened).measured_ns.tolist() == [midnight_ns, midnight_ns + SECOND_NS // 5]


def test_an_interval_without_a_date_is_counted_from_1970_with_a_warning(tmp_path: Path) -> None:
    opened = _open(tmp_path, [HDT, HDT], "--interval", "0.2")
    assert _heading(opened).measured_ns.tolist() == [0, SECOND_NS // 5]
    assert "counted from 1970-01-01; state it with --date" in opened.decoder.counts.warnings[1]


def test_times_of_tag_blocks_are_used(tmp_path: Path) -> None:
    line = tagged("c:1777636800", "HEHDT,218.53,T").decode()
    assert _heading(_open(tmp_path, [line])).measured_ns.tolist() == [NOON_NS]


def test_times_of_day_get_their_date_from_the_sentences(tmp_path: Path) -> None:
    opened = _open(tmp_path, [f"12:00:00.5 {ZDA}", f"12:00:00.75 {HDT}"])
    assert _heading(opened).measured_ns.tolist() == [NOON_NS + 3 * SECOND_NS // 4]
    assert opened.decoder.counts.warnings[0] == (
        "the time stamps have no date: counted from 2026-05-01; state it with --date"
    )


def test_stamps_without_a_zone_are_reported(tmp_path: Path) -> None:
    opened = _open(tmp_path, [f"2026-05-01 12:00:00 {HDT}"])
    assert opened.decoder.counts.warnings == ("the time stamps have no time zone, read as UTC",)


def test_a_file_without_any_checksum_is_read_with_a_warning(tmp_path: Path) -> None:
    lines = [line.split("*")[0] for line in (ZDA, HDT, LATER)]
    opened = _open(tmp_path, lines)
    assert len(_heading(opened)) == 1
    assert "no sentence has a checksum" in opened.decoder.counts.warnings[0]


def test_single_sentences_without_a_checksum_are_rejected_unless_accepted(tmp_path: Path) -> None:
    lines = [ZDA, HDT, HDT.split("*")[0], LATER]
    opened = _open(tmp_path, lines)
    assert len(_heading(opened)) == 1
    assert opened.decoder.counts.rejected == {"no checksum": 1}
    assert len(_heading(_open(tmp_path, lines, "--no-checksum"))) == 2


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="the file has no line"):
        _open(tmp_path, [])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--date", "01.05.2026"), r"--date takes YYYY-MM-DD, such as 2026-05-01, from 1970"),
        (("--interval", "0"), "--interval takes a time in s, such as 0.1, not '0'"),
        (("--interval", "nan"), "--interval takes a time in s"),
        (("--interval", "x"), "--interval takes a time in s"),
    ],
)
def test_malformed_options_are_usage_errors(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        _options(*words)


def test_a_live_decoder_requires_checksums_unless_switched_off() -> None:
    for words, count in ((), 0), (("--no-checksum",), 1):
        decoder, samples = NMEA0183.make_decoder(_options(*words)), SampleBuffer()
        decoder.decode([Packet(b"$HEHDT,1.0,T", 0)], samples)
        assert len(samples.take()) == count
