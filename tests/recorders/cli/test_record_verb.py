"""The verb `record`: a subcommand for each installed source."""

from pathlib import Path

import pytest
from extensions import declare

from recorders.cli.record_verb import GROUP
from shiplog.cli.main import main


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An installed package whose recorder cannot be imported."""
    declare(tmp_path, "seriallines", GROUP, serial="no_such_module:SERIAL")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("broken")
@pytest.mark.parametrize("options", ["", "-o a.mcap", "/dev/ttyS0 --speed 9600 -o a.mcap", "-h"])
def test_a_broken_recorder_is_reported_in_one_line_that_names_its_package(
    capsys: pytest.CaptureFixture[str], options: str
) -> None:
    assert main(["record", "serial", *options.split()]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "the recorder 'serial' cannot be loaded from no_such_module:SERIAL" in error
    assert "remove the package seriallines" in error


@pytest.mark.usefixtures("broken")
def test_a_broken_recorder_breaks_no_other(capsys: pytest.CaptureFixture[str]) -> None:
    simulate = "record simulate spiral --duration 20 -o spiral.mcap"
    assert main(simulate.split()) == 0
    assert capsys.readouterr().out.startswith("spiral.mcap: ")
    with pytest.raises(SystemExit):
        main(["record", "--help"])
    assert "a simulated trial" in capsys.readouterr().out


def test_an_unknown_source_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["record", "simulated", "spiral", "-o", "a.mcap"])
    assert "invalid choice: 'simulated'" in capsys.readouterr().err


@pytest.mark.parametrize("source", ["none.toml", "--dry-run NONE.TOML", "trial none.toml"])
def test_the_name_of_a_trial_file_is_short_for_the_source_trial(
    capsys: pytest.CaptureFixture[str], source: str
) -> None:
    assert main(["record", *source.split()]) == 2
    assert "cannot read the trial file" in capsys.readouterr().err
