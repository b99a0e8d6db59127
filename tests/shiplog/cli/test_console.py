"""Printed tables fit the console without breaking a word or a number."""

import re
import sys
from io import StringIO

import pytest

from shiplog.cli.console import print_tables, progress
from shiplog.printable import shortened
from shiplog.text_table import TextTable

NUMBERS = ("-2.22e-05", "0.00478", "62.7 s", "123.456", "± 0.0029")


def printed(
    table: TextTable,
    width: int,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> list[str]:
    monkeypatch.setenv("COLUMNS", str(width))
    print_tables([table])
    return capsys.readouterr().out.split("\n")


@pytest.mark.parametrize("width", [40, 60, 80, 100, 200])
@pytest.mark.parametrize("count", [2, 5, 9, 14])
def test_no_number_and_no_word_of_a_heading_is_broken(
    width: int, count: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    headings = tuple(f"yaw rate bias{i}\n[deg/s]" for i in range(count))
    rows = tuple(
        (f"zigzag_of_a_long_trial_{row}.mcap", *(NUMBERS[i % 5] for i in range(1, count)))
        for row in range(3)
    )
    lines = printed(TextTable("Fit", headings, rows), width, capsys, monkeypatch)
    assert all(len(line) <= width for line in lines)
    text = "\n".join(lines)
    assert all(number in text for number in NUMBERS[1 : min(count, 5)])
    words = set(re.findall(r"\S+", text))
    assert {f"bias{i}" for i in range(count)} <= words
    assert sum(line.count("…") for line in lines) in (0, *(3 * n for n in range(1, count)))


def test_a_long_name_keeps_its_beginning_and_its_end() -> None:
    assert shortened("zigzag_20_20.mcap", 17) == "zigzag_20_20.mcap"
    for size in range(3, 17):
        text = shortened("zigzag_20_20.mcap", size)
        assert len(text) == size
        head, tail = text.split("…")
        assert "zigzag_20_20.mcap".startswith(head)
        assert "zigzag_20_20.mcap".endswith(tail)


@pytest.mark.parametrize("width", [60, 80])
def test_two_different_names_never_look_alike(
    width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    quantities = ("apparent_wind_angle", "apparent_wind_speed", "air_temperature", "air_pressure")
    names = [f"/{name}/weather_station_{n}.WI" for name in quantities for n in (1, 2)]
    rows = tuple((name, *NUMBERS) for name in names)
    columns = ("topic", *(f"column{i}" for i in range(len(NUMBERS))))
    lines = printed(TextTable("Channels", columns, rows), width, capsys, monkeypatch)
    shown = [line.split()[0] for line in lines if line.startswith("  /")]
    assert len(set(shown)) == len(names)
    assert all(shown.count(name) == len(shown) // len(names) for name in shown)


def test_words_of_the_first_column_wrap_and_stay_whole(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    names = (
        "10/10 zig-zag, first overshoot",
        "10/10 zig-zag, second overshoot",
        "  time of the day",
    )
    columns = ("criterion", *(f"column{i}" for i in range(len(NUMBERS))))
    table = TextTable("Verdict", columns, tuple((name, *NUMBERS) for name in names))
    lines = printed(table, 74, capsys, monkeypatch)
    assert all(len(line) <= 74 for line in lines)
    cells = "\n".join(re.split(r" {3,}", line[2:])[0].rstrip() for line in lines)
    assert "10/10 zig-zag,\nsecond overshoot" in cells
    assert "…" not in "".join(lines)


def test_a_wrapped_cell_keeps_its_lines_beside_sentences(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    subject = "manoeuvre 1: time to 270°, time to 360°, speed at 270°, speed at 360°"
    reason = "the heading changes by 251° with the rudder held"
    table = TextTable("Not computed", ("subject", "reason"), ((subject, reason),), has_prose=True)
    lines = printed(table, 80, capsys, monkeypatch)
    assert any(line.startswith("  speed at 270°, speed at 360°   ") for line in lines)
    assert all(len(line) <= 80 for line in lines)


def test_sentences_of_the_last_column_wrap_between_words_beside_whole_cells(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "no connection to serial:///dev/ttyUSB0: device disconnected or multiple access"
    table = TextTable("Events", ("time (UTC)", "text"), (("23:13:45", text),), has_prose=True)
    lines = printed(table, 60, capsys, monkeypatch)
    assert all(len(line) <= 60 for line in lines)
    assert sum("23:13:45" in line for line in lines) == 1
    cells = [line[13:].strip() for line in lines if line[13:].strip() and "─" not in line]
    assert text in " ".join(cells)


def test_a_table_without_rows_is_its_headings(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "heading" in "\n".join(
        printed(TextTable("T", ("heading",), ()), 80, capsys, monkeypatch)
    )


def test_without_a_terminal_each_step_is_a_line_where_it_is_asked_for(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with progress(lines=True) as on_progress:
        on_progress("model 1 of 7", 0.0)
        on_progress("model 1 of 7", 0.1)
        on_progress("model 2 of 7", 0.2)
    assert capsys.readouterr().err.split("\n") == ["model 1 of 7", "model 2 of 7", ""]
    with progress() as on_progress:
        on_progress("read")
    assert capsys.readouterr().err == ""


def test_on_a_terminal_the_step_stands_beside_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = StringIO()
    monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    with progress() as on_progress:
        on_progress("model 1 of 7", 0.5)
    assert "model 1 of 7" in stream.getvalue()
    assert stream.getvalue().endswith("\x1b[2K")  # the bar is removed


def test_the_remaining_time_follows_from_the_share_that_is_done(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([0.0, 1.0, 10.0, 600.0])
    monkeypatch.setattr("shiplog.cli.console.time.monotonic", lambda: next(clock))
    with progress(lines=True) as on_progress:
        on_progress("a", 0.1)
        on_progress("b", 0.2)
        on_progress("c", 0.5)
    lines = capsys.readouterr().err.strip().split("\n")
    assert lines == ["a", "b, about 40 s left", "c, about 10 min left"]
