"""A recorder of another package, as docs/how_to_add_a_recorder.md makes it."""

from collections.abc import Mapping
from math import radians
from pathlib import Path

import numpy as np
import pytest
from extensions import EXTENSIONS, code_blocks, installed, run_python, run_shiplog
from places import PROJECT

from shiplog import read

ROWS = 250
IN_PYTHON = """
from pathlib import Path
from csv_recorder import CsvSource
from recorders.record import record
print(record(CsvSource(Path("run.csv")), "python.mcap"))
"""


@pytest.fixture(scope="module")
def environment(pytestconfig: pytest.Config) -> Mapping[str, str]:
    return installed("recorder", pytestconfig)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a CSV file."""
    rows = [f"{k / 10},{k / 1000},{15 + k / 100}" for k in range(ROWS)]
    text = "\n".join(("time_s,yaw_rate_deg_s,speed_kn", *rows)) + "\n"
    (tmp_path / "run.csv").write_text(text, encoding="utf-8")
    return tmp_path


def test_the_page_shows_the_files_of_the_package() -> None:
    blocks = code_blocks(PROJECT / "docs" / "how_to_add_a_recorder.md")
    assert blocks == {
        name: (EXTENSIONS / "recorder" / name).read_text(encoding="utf-8")
        for name in ("pyproject.toml", "csv_recorder.py")
    }


def test_the_command_line_records_the_source(environment: Mapping[str, str], folder: Path) -> None:
    done = run_shiplog(environment, folder, "record", "csv", "run.csv", "-o", "run.mcap")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "run.mcap: 500 samples of 2 channels\n"
    log = read(folder / "run.mcap")
    assert log["speed"].values[0] == pytest.approx(15 * 1852 / 3600)
    np.testing.assert_allclose(log["yaw_rate"].values, np.radians(np.arange(ROWS) / 1000))
    assert log["yaw_rate"].measured_ns[-1] == 24_900_000_000
    assert log.metadata["file"] == "run.csv"
    assert radians(1) == pytest.approx(log["yaw_rate"].values[-1] / 0.249)


def test_python_records_the_source(environment: Mapping[str, str], folder: Path) -> None:
    done = run_python(environment, folder, "-c", IN_PYTHON)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Recording(samples=500, channels=2, interrupted=False")
    assert len(read(folder / "python.mcap")["speed"]) == ROWS


def test_it_is_listed_with_the_other_sources(environment: Mapping[str, str], folder: Path) -> None:
    done = run_shiplog(environment, folder, "record", "--help")
    assert done.returncode == 0, done.stderr
    assert "a CSV file of yaw rate and speed" in done.stdout
    assert "a simulated trial" in done.stdout


def test_a_failure_keeps_what_came_before_it(environment: Mapping[str, str], folder: Path) -> None:
    with (folder / "run.csv").open("a", encoding="utf-8") as file:
        file.write("25.0,much,15\n")
    done = run_shiplog(environment, folder, "record", "csv", "run.csv", "-o", "run.mcap")
    assert done.returncode == 1
    assert done.stderr.startswith("shiplog: a column or number is missing (could not convert")
    assert "at least 400 samples until then are in run.mcap.part" in done.stderr
    assert not (folder / "run.mcap").exists()
