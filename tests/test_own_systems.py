"""The example of a user's own plants runs, and its estimates are more accurate than its sensors."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from example_scripts import PAPER_SYSTEMS, example_script
from places import PROJECT
from stderr_lines import foreign_lines

from analysis.linear.estimate import estimate
from analysis.linear.system_file import load_system
from shiplog import write
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

SYSTEMS = PROJECT / "examples" / "systems"


def example() -> ModuleType:
    return example_script("own_systems")


def test_every_system_file_of_the_examples_has_its_simulation() -> None:
    names = {path.stem for path in SYSTEMS.glob("*.toml")}
    assert names == {simulate.__name__ for simulate in example().SIMULATIONS}


@pytest.mark.parametrize("name", [path.stem for path in sorted(SYSTEMS.glob("*.toml"))])
def test_estimates_are_more_accurate_than_the_sensors_and_their_bands_hold(name: str) -> None:
    simulated = getattr(example(), name)(np.random.default_rng(1))
    found = estimate(simulated.log, load_system(SYSTEMS / f"{name}.toml"))
    accuracies = list(example().accuracies(simulated, found))
    assert all(each.error < 0.7 * each.sensor for each in accuracies if each.sensor > 0)
    assert all(each.within > 0.9 for each in accuracies)
    assert all(each.consistent and each.white for each in found.findings.residuals)
    if found.findings.costs is not None:
        assert found.findings.costs.predicted.total < found.findings.costs.recorded.total


def test_an_example_runs_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(example().heading_loop(np.random.default_rng(1)).log, "loop.mcap")
    arguments = ["estimate", "loop.mcap", "--system", str(SYSTEMS / "heading_loop.toml")]
    assert main([*arguments, "-o", "loop.rrd"]) == ExitCode.OK
    out, err = capfd.readouterr()
    assert "gyro bias" in out
    assert foreign_lines(err) == []  # a name with a blank is no fault of a path
    assert Path("loop.rrd").stat().st_size > 10_000


def test_the_papers_examples_are_estimated_from_their_logs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example_script("paper_logs").main(tmp_path)
    printed = capsys.readouterr().out
    for gain in ("1.9050562, -0.28749681", "disturbance[1]: 0.125", "yaw_rate: 0.41376579"):
        assert gain in printed
    logs = {path.stem for path in tmp_path.glob("*.mcap")}
    assert logs == {path.stem for path in PAPER_SYSTEMS.glob("*.toml")}
