"""A ship model of another package, as docs/how_to_add_a_ship_model.md makes it."""

import sys
import tomllib
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest
from extensions import EXTENSIONS, code_blocks, import_from, installed, run_shiplog
from places import PROJECT

from analysis import ReadingOptions, identify
from shiplog import load_vessel, open_log
from shiplog.cli.main import main
from shiplog.ships import ship_model

VESSEL = """
name = "a quadratic ship"
length = 180.0
approach_rpm = 90.0
[model]
name = "quadratic"
speed = 8.0
rpm = 90.0
a = -0.5
a2 = -1.5
k = 0.5
f = -0.5
g = -0.05
h = 0.05
"""
TRUTH = {"a": -0.5, "a2": -1.5, "k": 0.5, "f": -0.5, "g": -0.05, "h": 0.05}


@pytest.fixture(scope="module")
def environment(pytestconfig: pytest.Config) -> Mapping[str, str]:
    return installed("ship_model", pytestconfig)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, environment: Mapping[str, str]) -> Path:
    """A folder with a vessel file of the model and a simulated run of it."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "ship.toml").write_text(VESSEL, encoding="utf-8")
    simulate = "record simulate pseudo-random --duration 150 --noise none --vessel ship.toml"
    done = run_shiplog(environment, folder, *simulate.split(), "-o", "run.mcap")
    assert done.returncode == 0, done.stderr
    return folder


def test_the_page_shows_the_files_of_the_package() -> None:
    blocks = code_blocks(PROJECT / "docs" / "how_to_add_a_ship_model.md")
    assert blocks == {
        name: (EXTENSIONS / "ship_model" / name).read_text(encoding="utf-8")
        for name in ("pyproject.toml", "quadratic_nomoto.py")
    }


@pytest.fixture
def package(
    environment: Mapping[str, str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> ModuleType:
    """The module of the model, whose package this process finds for the time of a test."""
    import_from(environment, monkeypatch)
    monkeypatch.chdir(folder)
    monkeypatch.delitem(sys.modules, "quadratic_nomoto", raising=False)
    return import_module("quadratic_nomoto")


@pytest.mark.usefixtures("package")
def test_the_command_line_identifies_the_model_by_its_name() -> None:
    identify = "identify run.mcap --model quadratic --vessel ship.toml -o found.toml"
    assert main(identify.split()) == 0
    model = tomllib.loads(Path("found.toml").read_text(encoding="utf-8"))["model"]
    assert model["name"] == "quadratic"
    assert {name: model[name] for name in TRUTH} == pytest.approx(TRUTH, rel=0.02)


def test_python_identifies_the_model_itself(package: ModuleType) -> None:
    assert ship_model("quadratic") is package.QUADRATIC
    options = ReadingOptions(load_vessel("ship.toml")[0])
    ship = identify([open_log("run.mcap")], model=package.QUADRATIC, options=options)
    assert ship.model.name == "quadratic"
    found = ship.parameters
    assert (found["a"], found["k"]) == pytest.approx((-0.5, 0.5), abs=0.05)


@pytest.mark.usefixtures("package")
def test_an_unknown_name_is_reported_with_the_new_one_among_the_known(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["identify", "run.mcap", "--model", "quadratics"]) == 2
    assert "did you mean 'quadratic'" in capsys.readouterr().err
