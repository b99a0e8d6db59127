"""A format of another package, as docs/how_to_add_a_stream_format.md makes it."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from extensions import EXTENSIONS, code_blocks, installed, run_shiplog
from places import PROJECT

from shiplog import read

TRIAL = """
[[source]]
name = "engine"
format = "torquemeter"
address = "shaft.log"
shaft = "port"
"""


@pytest.fixture(scope="module")
def environment(pytestconfig: pytest.Config) -> Mapping[str, str]:
    return installed("stream_format", pytestconfig)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a log of the device, and a trial file."""
    lines = [f"T{k / 10} N{80 + k} Q{950 + k}" for k in range(100)]
    lines[7] = "T0.7 N"
    (tmp_path / "shaft.log").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "trial.toml").write_text(TRIAL, encoding="utf-8")
    return tmp_path


def test_the_page_shows_the_files_of_the_package() -> None:
    blocks = code_blocks(PROJECT / "docs" / "how_to_add_a_stream_format.md")
    assert blocks == {
        name: (EXTENSIONS / "stream_format" / name).read_text(encoding="utf-8")
        for name in ("pyproject.toml", "torquemeter.py")
    }


def test_a_file_is_recorded_and_its_wrong_line_counted(
    environment: Mapping[str, str], folder: Path
) -> None:
    arguments = ("torquemeter", "shaft.log", "--shaft", "port", "-o", "shaft.mcap")
    done = run_shiplog(environment, folder, "record", *arguments)
    assert done.returncode == 0, done.stderr
    assert "not a line of the torquemeter" in done.stdout
    assert "shaft.mcap: 198 samples of 2 channels" in done.stdout
    log = read(folder / "shaft.mcap")
    assert log["torque/port"].values[:2].tolist() == [950e3, 951e3]
    assert log["rpm/port"].measured_ns[-1] == 9_900_000_000


def test_it_is_a_source_of_a_trial_file(environment: Mapping[str, str], folder: Path) -> None:
    done = run_shiplog(environment, folder, "record", "trial.toml", "-o", "trial.mcap")
    assert done.returncode == 0, done.stderr
    log = read(folder / "trial.mcap")
    assert len(log["rpm/engine.port"]) == 99
    assert log.metadata["engine.options"] == "--shaft=port"


def test_a_wrong_option_is_one_line_of_error(environment: Mapping[str, str], folder: Path) -> None:
    arguments = ("torquemeter", "shaft.log", "--shaft", "a/b", "-o", "shaft.mcap")
    done = run_shiplog(environment, folder, "record", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "shiplog: --shaft is a name of letters and digits, not 'a/b'\n"
