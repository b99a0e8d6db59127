"""The shell commands of the README run as written."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
from places import PROJECT, SAMPLE_DATA
from stderr_lines import foreign_lines

from shiplog.cli.main import main
from shiplog.errors import ShiplogError

README = (PROJECT / "README.md").read_text(encoding="utf-8")
INSTALL = "pip install -e . && "
TESTS = "pip install -e '.[test]' && pytest"  # run by CI itself


def commands() -> list[str]:
    """Return the shell commands of the README: its lines that are indented by four blanks."""
    outside_fences = re.sub(r"^```.*?^```", "", README, flags=re.MULTILINE | re.DOTALL)
    whole_lines = re.sub(r"\\\n *", "", outside_fences)
    lines = re.findall(r"^    (\S.*)$", whole_lines, flags=re.MULTILINE)
    return [line.removeprefix(INSTALL) for line in lines if line != TESTS]


def run(command: str) -> int:
    program, *arguments = shlex.split(command, comments=True)
    assert program == "shiplog", command
    try:
        return main(arguments)
    except SystemExit as done:  # of --help
        return int(done.code or 0)


@pytest.fixture
def new_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder that has nothing but the sample data."""
    shutil.copytree(SAMPLE_DATA, tmp_path / "sample_data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_commands_run_as_written_and_only_shiplog_writes_to_stderr(
    new_folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Fits take a minute, and a viewer needs a screen: only what they are given is checked."""

    def not_fitted(*_: object, **__: object) -> None:
        raise ShiplogError("not fitted")

    monkeypatch.setattr("analysis.identification.identify.identify", not_fitted)
    shutil.copy(new_folder / "sample_data" / "vessels" / "table1.toml", "vessel.toml")
    verbs = []
    for command in commands():
        if command.startswith("rerun "):
            assert Path(command.split()[1]).is_file(), command
            continue
        code, (out, err) = run(command), capfd.readouterr()
        verbs.append(command.split()[1])
        if verbs[-1] == "identify" and "--help" not in command:
            assert err.splitlines()[-1] == "shiplog: not fitted", command
            continue
        assert code == 0, f"{command}\n{err}"
        assert out, command
        assert foreign_lines(err) == [], command
        for option in re.findall(r"(?:-o|--json) (\S+)", command):
            assert Path(option).stat().st_size > 0, command
    assert set(verbs) == {"replay", "report", "convert", "record", "identify", "check"}
    assert len(verbs) >= 12
