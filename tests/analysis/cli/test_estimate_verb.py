"""The verb estimate: tables, JSON and review of a log; bad inputs in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from places import SAMPLE_DATA
from rerun.chunk import RrdReader

from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

LOG = str(SAMPLE_DATA / "zigzag_20_20.mcap")
SURGE = """
[plant]
model = "surge"
vessel = "table1"
[outputs.speed]
[inputs.rpm]
[noise]
process = { speed = 1e-8 }
"""
REGULATED = """
[plant]
model = "yaw"
T = 90
K = 0.2
[outputs.yaw_rate]
[inputs.rudder]
[noise]
process = { yaw_rate = 1e-9 }
[method]
name = "kalman"
gain = "steady-state"
[regulator]
P = { yaw_rate = 1.0 }
R = { rudder = 0.01 }
cycles = 2
"""


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def system_file(text: str) -> str:
    Path("system.toml").write_text(text, encoding="utf-8")
    return "system.toml"


def test_speed_from_the_vessel_is_estimated_along_the_recorded_trajectory(
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments = ["estimate", LOG, "--system", system_file(SURGE), "--json", "s.json"]
    assert main(arguments) == ExitCode.OK
    assert "linearised along speed, yaw_rate" in " ".join(capsys.readouterr().out.split())
    found = json.loads(Path("s.json").read_text(encoding="utf-8"))
    assert found["outputs"]["speed"]["mean_nis"] == pytest.approx(1, abs=0.15)
    assert found["estimates"]["speed"]["mean"] == pytest.approx(8.3, abs=0.2)


def test_review_holds_outputs_estimates_innovations_inputs_and_the_tables(
    capsys: pytest.CaptureFixture[str],
) -> None:
    arguments = ["estimate", LOG, "--system", system_file(REGULATED), "-o", "yaw.rrd"]
    assert main(arguments) == ExitCode.OK
    assert "Regulator u = L x̂" in capsys.readouterr().out
    entities = {str(chunk.entity_path) for chunk in RrdReader("yaw.rrd").stream()}
    for entity in (
        "/summary",
        "/output_yaw_rate/outputs",
        "/state_yaw_rate/estimate",
        "/innovation_yaw_rate/normalised",
        "/input_rudder/inputs",
    ):
        assert entity in entities


def test_json_has_poles_gains_and_costs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", LOG, "--system", system_file(REGULATED), "--json", "-"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)
    estimator, regulator = found["estimator"], found["regulator"]
    assert estimator["poles"][0][0] < 0
    assert np.shape(estimator["correction"]) == (1, 1)
    costs = regulator["costs"]
    assert costs["recorded"]["state"] == costs["feedback"]["state"]
    assert 0 < costs["predicted"]["total"] < costs["recorded"]["total"]
    assert regulator["recorded_rms"][0] == pytest.approx(np.radians(18), rel=0.2)


@pytest.mark.parametrize(
    ("text", "code", "expected"),
    [
        ("[plant]\nmodel = 'yow'", ExitCode.FAILURE, "did you mean 'yaw'?"),
        (SURGE.replace("[outputs.speed]", "[outputs.speed]\nchannel = 'sped'"), 1, "no channel"),
        (SURGE.replace("[inputs.rpm]", "[inputs.rpm]\nunit = 'deg'"), 1, "the plant takes rpm"),
        (SURGE.replace("speed]", "speed]\nunit = 'deg'"), 2, "cannot convert 'm/s'"),
        (SURGE + '[method]\nname = "quality"\n', 2, "use kalman, per-tick or reduced-order"),
    ],
)
def test_a_bad_system_is_refused_in_one_line(
    text: str, code: int, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["estimate", LOG, "--system", system_file(text), "-o", "x.rrd"]) == code
    output = capsys.readouterr()
    assert output.out == ""
    assert len(output.err.strip().splitlines()) == 1
    assert expected in output.err
    # whichever it is, the error names the file in which it is to be corrected
    assert output.err.rstrip().endswith(": system.toml") or "no channel 'sped'" in output.err
    assert not Path("x.rrd").exists()


def test_a_view_without_a_file_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", LOG, "--system", system_file(SURGE), "--view"]) == ExitCode.USAGE
    assert "name its file with -o" in capsys.readouterr().err


MATRICES = """
[plant]
states = { yaw_rate = "rad/s" }
A = [[-0.03]]
B = [[1.0]]
C = [[1.0]]
[outputs.yaw_rate]
[inputs.rudder]
[noise]
Q = [1e-9]
"""


@pytest.mark.parametrize(
    ("right", "wrong", "expected"),
    [
        ("B = [[1.0]]", "B = [[0.0], [1.0]]", "plant.B has 2 × 1 numbers, expected 1 × 1"),
        ("B = [[1.0]]", 'B = "none"', "plant.B must be a list of rows of numbers, all of equal"),
        ("C = [[1.0]]", "C = [[1.0, 0.0]]", "plant.C has 1 × 2 numbers, expected 1 × 1"),
        ("C = [[1.0]]", "C = [[1.0]]\nG = 1", "plant.G must be a list of rows of numbers"),
        ("A = [[-0.03]]", "A = [[-0.03, 1.0]]", "[plant] needs a square A, or num and den"),
        (
            'states = { yaw_rate = "rad/s" }\nA = [[-0.03]]\nB = [[1.0]]\nC = [[1.0]]',
            "A = [[0.0, 1.0]]\nB = [[0.0], [1.0]]\nC = [[1.0, 0.0]]\nG = [[0.0], [1.0]]",
            "[plant] needs a square A, or num and den",
        ),
    ],
)
def test_no_further_errors_follow_from_a_matrix_that_is_refused(
    right: str, wrong: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert right in MATRICES
    assert main(["estimate", LOG, "--system", system_file(MATRICES.replace(right, wrong))]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"shiplog: one error in the system file: {expected}"), error
