"""The verb identify: where predicted manoeuvres are printed, or the reason why there are none."""

import json
from pathlib import Path

import pytest
from predicted_ships import MARINER, MODEL, mariner_log, ship_with_positions

from analysis.identification import identify as identify_module
from shiplog import write
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

pytestmark = pytest.mark.usefixtures("fit_alone")


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "zigzag.mcap"
    write(mariner_log(20.0), path)
    return str(path)


def test_one_log_gives_the_reason_without_predictions_in_one_line(
    log: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", log, "--model", "nomoto"]) == ExitCode.OK
    lines = capsys.readouterr().out.splitlines()
    (line,) = (each for each in lines if each.startswith("no predicted manoeuvres: "))
    assert "give two or more" in line


def test_json_on_stdout_sends_the_table_to_stderr(
    log: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identify_module, "identify", lambda *_, **__: ship_with_positions())
    length = str(MARINER.length)
    arguments = ["identify", log, "--model", MODEL, "--length", length, "--json", "-"]
    assert main(arguments) == ExitCode.OK
    printed = capsys.readouterr()
    assert len(json.loads(printed.out)["predictions"]) == 6
    assert "Predicted manoeuvres" in printed.err
    assert "no predicted manoeuvres" not in printed.err
