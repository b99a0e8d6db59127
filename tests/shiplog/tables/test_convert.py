"""Conversion between files: the possible formats, and the errors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_logs import LAYOUT, require_same, trial

from shiplog.errors import LayoutError, LogError, UsageError
from shiplog.mcap.reader import read
from shiplog.mcap.writer import write
from shiplog.tables.convert import convert, sorted_by_time
from shiplog.types import Channel, TrialLog


@pytest.fixture
def foreign(tmp_path: Path) -> tuple[Path, Path]:
    (tmp_path / "run.dat").write_text("0,1\n1,2\n")
    (tmp_path / "run.csv").write_text("0,1\n1,2\n")
    (tmp_path / "gyro.toml").write_text(LAYOUT)
    return tmp_path / "run.dat", tmp_path / "gyro.toml"


@pytest.mark.parametrize("source", ["run.dat", "run.csv"])
@pytest.mark.parametrize("target", ["a.mcap", "a.csv", "a.parquet"])
def test_a_foreign_table_is_converted_by_its_layout(
    foreign: tuple[Path, Path], source: str, target: str
) -> None:
    folder = foreign[0].parent
    log, warnings = convert(folder / source, folder / target, foreign[1])
    assert warnings == []
    np.testing.assert_allclose(log["yaw_rate"].values, np.radians([1, 2]))
    back, _ = convert(folder / target, folder / "back.mcap")
    assert back.metadata["converted_from"] == source


@pytest.mark.parametrize("source", ["run.dat", "run.csv"])
def test_a_foreign_table_without_layout_is_an_error_that_names_the_option(
    foreign: tuple[Path, Path], source: str
) -> None:
    folder = foreign[0].parent
    with pytest.raises(UsageError, match="--layout"):
        convert(folder / source, folder / "a.mcap")
    assert not (folder / "a.mcap").exists()


def test_a_layout_for_a_log_is_an_error(foreign: tuple[Path, Path]) -> None:
    folder = foreign[0].parent
    for name in ("a.csv", "a.parquet"):
        convert(foreign[0], folder / name, foreign[1])
        with pytest.raises(UsageError, match="omit --layout"):
            convert(folder / name, folder / "b.mcap", foreign[1])


def test_the_layout_of_a_table_is_not_that_of_an_mcap_file_and_the_reverse(
    foreign: tuple[Path, Path],
) -> None:
    folder = foreign[0].parent
    convert(foreign[0], folder / "a.mcap", foreign[1])
    with pytest.raises(LayoutError, match="a layout of a table, but the file is MCAP"):
        convert(folder / "a.mcap", folder / "b.mcap", foreign[1])
    bag = folder / "bag.toml"
    bag.write_text("[speed]\ntopic = '/log'\nfield = 'v'\nunit = 'kn'\n")
    with pytest.raises(LayoutError, match="a layout of an MCAP file, but the file is a table"):
        convert(foreign[0], folder / "b.mcap", bag)


def test_a_target_of_unknown_suffix_is_an_error_that_lists_the_others(tmp_path: Path) -> None:
    for name in ("a.xlsx", "a"):
        with pytest.raises(UsageError, match=r"possible are \.mcap, \.csv, \.parquet"):
            convert(tmp_path / "b.mcap", tmp_path / name)


def test_source_and_target_must_differ(tmp_path: Path) -> None:
    write(trial(), tmp_path / "a.mcap")
    (tmp_path / "sub").mkdir()
    with pytest.raises(UsageError, match="the target is the source"):
        convert(tmp_path / "a.mcap", tmp_path / "sub" / ".." / "a.mcap")
    assert len(read(tmp_path / "a.mcap").channels) == 4


@pytest.mark.parametrize("name", ["gone.mcap", "gone.csv", "gone.dat", "gone.parquet"])
def test_a_missing_source_is_an_error(tmp_path: Path, name: str) -> None:
    with pytest.raises(LogError, match="no such file"):
        convert(tmp_path / name, tmp_path / "b.mcap")


def test_mcap_to_mcap_sorts_by_measured_time_and_stays_sorted_when_read(tmp_path: Path) -> None:
    measured = np.array([10, 30, 20, 40, 25]) * 10**8
    received = np.array([11, 31, 32, 41, 42]) * 10**8
    late = Channel("speed", "log", "m/s", measured, received, np.array([1.0, 3, 2, 4, 2.5]))
    other = Channel("rpm", "engine", "rpm", measured[:2], received[:2], np.array([80.0, 81]))
    write(TrialLog("a", (late, other)), tmp_path / "a.mcap")
    _, warnings = convert(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert warnings == ["/speed/log: the measured times ran backwards 2 times; now sorted"]
    back = read(tmp_path / "b.mcap")
    assert back["speed"].values.tolist() == [1, 2, 2.5, 3, 4]
    assert back["speed"].measured_ns.tolist() == sorted(measured.tolist())
    assert np.all(back["speed"].received_ns >= back["speed"].measured_ns)
    assert back["rpm"].values.tolist() == [80, 81]


def test_a_sorted_log_stays_unchanged() -> None:
    log = replace(trial(), channels=trial().channels[:3])
    same, warnings = sorted_by_time(log)
    assert warnings == []
    require_same(log, same)
