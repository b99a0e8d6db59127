"""Simulated runs of the paper's ship and the fits to them, each computed once."""

from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from trial_logs import as_log

from analysis.identification import identify as identify_module
from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment, split_into_segments
from analysis.identification.fit.uncertainty import Uncertainty, uncertainty
from analysis.identification.identified_ship import IdentifiedShip
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import load_vessel, resample, write
from shiplog.cli.main import main
from shiplog.ships import ship_model

CHANNELS = ("yaw_rate", "speed", "rudder", "rpm")
TRUE = load_vessel("table1")[0].coefficients._asdict()


@cache
def a_trial(manoeuvre: str = "zigzag-20-20", seed: int = 3, seconds: float = 400.0) -> Segment:
    """Return a simulated manoeuvre with white noise as the segment of a fit."""
    vessel = load_vessel("table1")[0]
    trial = simulate(vessel, manoeuvre, duration_secs=seconds, seed=seed, sensors=suite("white"))
    return split_into_segments(resample(as_log(trial, "t"), channels=CHANNELS), "t")[0]


@cache
def fitted(model: str = "burylin", runs: int = 1) -> tuple[OutputError, Uncertainty]:
    """Return the fit of a model to one or more zigzags, and its uncertainty."""
    fixed = {"T3": 0.5} if model == "burylin-tied" else {}
    segments = [a_trial(seed=3 + i) for i in range(runs)]
    fit = output_error(segments, ship_model(model), fixed=fixed)
    return fit, uncertainty(fit)


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
    """Choose the best model for two logs, on the command line; tests share an xdist group."""
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
                duration_secs=300.0,
                seed=seed,
                sensors=suite("paper"),
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
