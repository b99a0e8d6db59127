"""A ship model of another package, as docs/how_to_add_a_ship_model.md makes it."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest
from extensions import EXTENSIONS, code_blocks, installed, run_python, run_shiplog
from places import PROJECT

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
IN_PYTHON = """
from analysis import ReadingOptions, identify
from quadratic_nomoto import QUADRATIC
from shiplog import load_vessel, open_log
from shiplog.ships import ship_model

assert ship_model("quadratic") is QUADRATIC
options = ReadingOptions(load_vessel("ship.toml")[0])
ship = identify([open_log("run.mcap")], model=QUADRATIC, options=options)
print(ship.model.name, *(round(value, 1) for value in ship.parameters.values()))
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


def test_the_command_line_identifies_the_model_by_its_name(
    environment: Mapping[str, str], folder: Path
) -> None:
    identify = "identify run.mcap --model quadratic --vessel ship.toml -o found.toml"
    done = run_shiplog(environment, folder, *identify.split())
    assert done.returncode == 0, done.stderr
    text = (folder / "found.toml").read_text(encoding="utf-8")
    model = tomllib.loads(text)["model"]
    assert model["name"] == "quadratic"
    assert {name: model[name] for name in TRUTH} == pytest.approx(TRUTH, rel=0.02)


def test_python_identifies_the_model_itself(environment: Mapping[str, str], folder: Path) -> None:
    done = run_python(environment, folder, "-c", IN_PYTHON)
    assert done.returncode == 0, done.stderr
    name, a, _, k, *_ = done.stdout.split()
    assert (name, float(a), float(k)) == ("quadratic", -0.5, 0.5)


def test_an_unknown_name_is_reported_with_the_new_one_among_the_known(
    environment: Mapping[str, str], folder: Path
) -> None:
    done = run_shiplog(environment, folder, "identify", "run.mcap", "--model", "quadratics")
    assert done.returncode == 2
    assert "did you mean 'quadratic'" in done.stderr
