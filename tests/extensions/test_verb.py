"""A verb of another package, as docs/how_to_add_a_verb.md makes it."""

from collections.abc import Mapping
from pathlib import Path

import pytest
from extensions import EXTENSIONS, code_blocks, declare, installed, run_shiplog
from places import PROJECT, SAMPLE_DATA

LOG = SAMPLE_DATA / "zigzag_20_20.mcap"


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("verb")


@pytest.fixture(scope="module")
def environment(packages: Path, pytestconfig: pytest.Config) -> Mapping[str, str]:
    return installed("verb", pytestconfig, packages)


def test_the_page_shows_the_files_of_the_package() -> None:
    blocks = code_blocks(PROJECT / "docs" / "how_to_add_a_verb.md")
    assert blocks == {
        name: (EXTENSIONS / "verb" / name).read_text(encoding="utf-8")
        for name in ("pyproject.toml", "duration_verb.py")
    }


def test_the_verb_is_listed_and_runs(environment: Mapping[str, str], tmp_path: Path) -> None:
    listed = run_shiplog(environment, tmp_path, "--help")
    assert "duration  print the duration of logs" in listed.stdout
    done = run_shiplog(environment, tmp_path, "duration", LOG)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[4].split() == ["zigzag_20_20.mcap", "600", "6"]


def test_an_error_of_the_verb_is_one_line_with_its_exit_code(
    environment: Mapping[str, str], tmp_path: Path
) -> None:
    done = run_shiplog(environment, tmp_path, "duration", "missing.mcap")
    assert done.returncode == 1
    assert done.stderr == "shiplog: no such file: missing.mcap\n"


def test_a_verb_that_cannot_be_loaded_breaks_no_other(
    packages: Path, environment: Mapping[str, str], tmp_path: Path
) -> None:
    declare(packages, "broken-package", "shiplog.verbs", broken="no_such_module:VERB")
    listed = run_shiplog(environment, tmp_path, "--help")
    assert listed.returncode == 0
    assert "broken-package" in listed.stdout
    assert run_shiplog(environment, tmp_path, "duration", LOG).returncode == 0
    asked = run_shiplog(environment, tmp_path, "broken")
    assert asked.returncode == 1
    assert asked.stderr.startswith("shiplog: the verb 'broken' cannot be loaded")
    assert asked.stderr.count("\n") == 1
