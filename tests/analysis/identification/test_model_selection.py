"""The best of all ship models for two logs, as `shiplog identify --model auto` chooses it."""

import json
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cache
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from trial_logs import as_log

from analysis.identification import identify as identify_module
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import _best_fit
from analysis.report.identification_tables import identification_tables
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import LogError, load_vessel, write
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode
from shiplog.vessel.vessel_parser import parse_vessel

RATES = {f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm")}


@dataclass(frozen=True)
class AutoIdentification:
    """What `shiplog identify --model auto --json - -o FILE` returned and wrote."""

    exit_code: int
    stdout: str
    stderr: str
    vessel_toml: str
    ship: IdentifiedShip


@cache
def identify_auto() -> AutoIdentification:
    """Choose the best model for two logs, on the command line."""
    vessel, toml = load_vessel("table1")
    ships: list[IdentifiedShip] = []

    def identify(*args: object, **settings: object) -> IdentifiedShip:
        ships.append(original(*args, **settings))  # type: ignore[arg-type]
        return ships[-1]

    original, stdout, stderr = identify_module.identify, StringIO(), StringIO()
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify_module, "identify", identify)
        logs = []
        for manoeuvre, seed in (("zigzag-20-20", 0), ("zigzag-10-10-port", 2)):
            trial = simulate(
                vessel,
                manoeuvre,
                duration_secs=200.0,
                seed=seed,
                sensors=suite("paper", RATES),
                vessel_toml=toml,
            )
            logs.append(str(Path(folder) / f"{manoeuvre}.mcap"))
            write(as_log(trial), logs[-1])
        output = Path(folder) / "best.toml"
        arguments = ["identify", *logs, "--model", "auto", "--json", "-", "-o", str(output)]
        with redirect_stdout(stdout), redirect_stderr(stderr):
            exit_code = main(arguments)
        text = output.read_text(encoding="utf-8")
    return AutoIdentification(exit_code, stdout.getvalue(), stderr.getvalue(), text, ships[0])


def test_auto_takes_the_model_that_best_predicts_the_run_held_out() -> None:
    ship = identify_auto().ship
    assert ship.candidates[0].model is ship.model
    assert ship.model.name in ("burylin", "burylin-tied")
    assert len(ship.candidates) == 8
    assert "Models by cross-validation" in identification_tables(ship)[0].title


def test_the_best_model_whose_simulation_does_not_diverge_is_taken() -> None:
    first, second, *others = identify_auto().ship.candidates
    assert _best_fit([first, second, *others]) is first.fit
    assert _best_fit([replace(first, fit=None), second, *others]) is second.fit
    with pytest.raises(LogError, match="simulation of every model diverges"):
        _best_fit([replace(first, fit=None)])


def test_the_best_model_is_chosen_on_the_command_line() -> None:
    run = identify_auto()
    assert run.exit_code == ExitCode.OK
    result = json.loads(run.stdout)
    assert result["model"]["name"] == run.ship.model.name
    assert result["model"]["name"] in ("burylin", "burylin-tied")
    scores = [each["score"] for each in result["models"] if not each["fault"]]
    assert scores == sorted(scores)
    assert sum(each["weight"] for each in result["models"]) == pytest.approx(1.0)
    assert "Models by cross-validation" in run.stderr
    assert "model 1 of 8" in run.stderr
    vessel = parse_vessel(run.vessel_toml, "best.toml")
    assert vessel.model is None  # the paper's model needs no section [model]
