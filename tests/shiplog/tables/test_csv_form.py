"""CSV of shiplog: its checksum, and cells that a spreadsheet would take for formulas."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import HOSTILE_CASES
from small_logs import require_same, trial

from shiplog.cli.main import main
from shiplog.errors import LogError
from shiplog.tables.csv_form import read_csv, write_csv
from shiplog.types import Channel, TrialLog

FORMULA = "=HYPERLINK(1)"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    write_csv(trial(), tmp_path / "a.csv")
    return tmp_path / "a.csv"


def edited(table: Path, old: str, new: str) -> TrialLog:
    text = table.read_text(encoding="utf-8")
    assert old in text
    table.write_text(text.replace(old, new, 1), encoding="utf-8", newline="")
    return read_csv(table)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (",0.3333333333333333\n", ",0.3433333333333333\n"),
        ("zig-zag 20/20", "zig-zag 10/10"),
        ("crc32 ", "crc32 0"),
    ],
)
def test_a_changed_table_is_read_with_a_warning(table: Path, old: str, new: str) -> None:
    if "crc32" in old:
        last = table.read_text(encoding="utf-8").splitlines()[-1]
        old, new = last, f"# end crc32 {int(last[-8:], 16) ^ 1:08x}"
    log = edited(table, old, new)
    assert len(log.warnings) == 1
    assert "was changed since shiplog wrote it" in log.warnings[0]


def test_conversion_of_a_changed_table_prints_the_warning(
    table: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edited(table, ",0.3333333333333333\n", ",0.3433333333333333\n")
    assert main(["convert", str(table), str(table.with_suffix(".mcap"))]) == 0
    assert "was changed since" in capsys.readouterr().err


def test_other_line_ends_are_no_change(table: Path) -> None:
    table.write_bytes(b"\xef\xbb\xbf" + table.read_bytes().replace(b"\n", b"\r\n"))
    require_same(trial(), log := read_csv(table))
    assert log.warnings == ()


def test_a_table_of_the_first_version_is_read_and_cannot_be_verified(table: Path) -> None:
    lines = table.read_text(encoding="utf-8").splitlines()
    old = ["# shiplog csv 1", *lines[1:-1], "# end", ""]
    table.write_text("\n".join(old), encoding="utf-8", newline="")
    require_same(trial(), log := read_csv(table))
    assert "the table has no checksum" in log.warnings[0]


@pytest.mark.parametrize("sign", ["=", "+", "-", "@", "＝", "\t=", "\r=", '"'])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_no_cell_begins_a_formula_however_the_lines_are_split(
    tmp_path: Path, sign: str, delimiter: str
) -> None:
    text, at = f"a{delimiter}{sign}cmd()", np.arange(3) * 10**9
    texts = {key: key for key in (text, f"{sign}b", f"a,  {sign}b", f'"{sign}b')}
    channels = tuple(Channel("rpm", key, key, at, at, -at * 1e-9, (), texts) for key in texts)
    log = TrialLog("a", channels, texts, f"{sign}1\na, {sign}1", events=trial().events)
    write_csv(log, tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream, delimiter=delimiter))
    numbers = {repr(value) for value in channels[0].values.tolist()}
    cells = {cell.strip().strip('"').strip() for row in rows for cell in row} - numbers
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@", "＝"))]
    require_same(log, read_csv(tmp_path / "a.csv"))


def test_control_characters_of_a_source_are_escaped_and_restored(tmp_path: Path) -> None:
    at = np.arange(3)
    hostile = "g\x1b[2J\x9b\u202e\n# end\r"
    log = TrialLog("a", (Channel("rpm", hostile, hostile, at, at, at * 1.0),), {hostile: hostile})
    write_csv(log, tmp_path / "a.csv")
    text = (tmp_path / "a.csv").read_text(encoding="utf-8")
    assert all(line.isprintable() for line in text.split("\n"))
    require_same(log, read_csv(tmp_path / "a.csv"))


def test_a_cell_longer_than_the_csv_reader_takes_is_an_error(tmp_path: Path) -> None:
    at = np.arange(3)
    write_csv(TrialLog("a", (Channel("rpm", "x" * 200_000, "", at, at, at * 1.0),)), tmp_path / "a")
    with pytest.raises(LogError, match="field larger than field limit"):
        read_csv(tmp_path / "a")


@pytest.mark.parametrize("name", ["c_vessel_int.csv", "c_dup_channel.csv"])
def test_hostile_tables_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path = HOSTILE_CASES / name
    if not path.exists():
        pytest.skip(f"no {path.name} beside the project")
    assert main(["convert", str(path), str(tmp_path / "a.mcap")]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_rows_that_were_removed_leave_the_other_samples_as_they_were(table: Path) -> None:
    lines = table.read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith("/yaw_rate/mems,")]
    table.write_text("".join(kept), encoding="utf-8", newline="")
    log = read_csv(table)
    assert log.warnings
    gone = trial().channels[3].take(slice(0))
    require_same(replace(trial(), channels=(*trial().channels[:3], gone)), log)
