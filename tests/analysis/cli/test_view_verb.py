"""The verb view: reviews of logs of all formats without a replay; bad inputs in one line."""

import subprocess
import sys
from pathlib import Path

import pytest
from places import LAYOUTS, SAMPLE_DATA
from rrd_content import static_components, view_titles

from analysis.cli import view_verb
from shiplog.cli.main import main
from shiplog.cli.verb import ExitCode

LOG = str(SAMPLE_DATA / "zigzag_20_20.mcap")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_log_becomes_a_review_with_its_content_and_no_viewer_opens(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    assert main(["view", LOG, "-o", "out.rrd"]) == ExitCode.OK
    titles = view_titles(folder / "out.rrd")
    assert any(title.startswith("heading from 0.0°") for title in titles)
    assert {"yaw rate [deg/min]: -41.21 to 38.58", "summary", "events"} <= set(titles)
    assert any(title.endswith("; at 80 rpm") for title in titles)
    (page,) = static_components(folder / "out.rrd", "TextDocument:text")["/summary"]
    assert "| /rudder/simulated | 6001 | 10 |" in page
    assert "out.rrd" in capsys.readouterr().err


def test_without_an_output_the_viewer_opens_the_review_in_the_current_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[tuple[Path, bool]] = []
    monkeypatch.setattr(view_verb, "show_review", lambda path, *, view: shown.append((path, view)))
    assert main(["view", LOG]) == ExitCode.OK
    assert shown == [(Path("zigzag_20_20.view.rrd"), True)]
    assert (folder / "zigzag_20_20.view.rrd").exists()


def test_tables_and_parts_of_logs_are_viewed_too(folder: Path) -> None:
    words = [SAMPLE_DATA / "bridge.csv", "--layout", LAYOUTS / "bridge.toml", "-o", "b.rrd"]
    # a process of its own, which finds none of the libraries that the verb declares as unneeded
    code = "from shiplog.cli.main import main; raise SystemExit(main())"
    subprocess.run([sys.executable, "-c", code, "view", *map(str, words)], check=True)
    assert "map (tiles from the internet)" in view_titles(folder / "b.rrd")
    assert main(["convert", LOG, "log.parquet", "--to", "20"]) == 0
    assert main(["view", "log.parquet", "--from", "5", "--to", "10", "-o", "p.rrd"]) == 0
    assert any("rudder" in title for title in view_titles(folder / "p.rrd"))


def test_several_logs_are_drawn_over_each_other(folder: Path) -> None:
    other = str(SAMPLE_DATA / "zigzag_10_10_dropouts.mcap")
    assert main(["view", LOG, other, "--to", "60", "-o", "two.rrd"]) == ExitCode.OK
    names = static_components(folder / "two.rrd", "SeriesLines:names").values()
    assert ["zigzag_20_20.mcap (0 to 60 s)"] in names
    (page,) = static_components(folder / "two.rrd", "TextDocument:text")["/summary"]
    assert "## 2 logs" in page


def test_several_logs_count_from_their_executes_unless_one_has_none(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = str(SAMPLE_DATA / "pseudo_random.mcap")
    assert main(["view", LOG, other, "-o", "two.rrd"]) == ExitCode.OK
    warnings = [line for line in capsys.readouterr().err.splitlines() if "no manoeuvre" in line]
    assert len(warnings) == 1
    assert warnings[0].startswith("warning: pseudo_random.mcap: no manoeuvre")
    (page,) = static_components(folder / "two.rrd", "TextDocument:text")["/summary"]
    assert "time of zigzag_20_20.mcap counts from the execute of its zig-zag 20°/20°" in page


def test_logs_count_from_their_starts_where_that_is_asked_for(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["view", LOG, LOG, "--to", "20", "--align", "start", "-o", "two.rrd"]
    assert main(arguments) == ExitCode.OK
    assert "no manoeuvre" not in capsys.readouterr().err
    (page,) = static_components(folder / "two.rrd", "TextDocument:text")["/summary"]
    assert "time counts from the start of each log" in page


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["none.mcap"], ExitCode.FAILURE, "no such file: none.mcap"),
        ([LOG, "-o", "review.txt"], ExitCode.USAGE, "the output is a .rrd file"),
        ([LOG, "-o", "no/review.rrd"], ExitCode.FAILURE, "no/review.rrd"),
        (["old.rrd"], ExitCode.USAGE, "open it with: rerun old.rrd"),
        ([str(SAMPLE_DATA / "bridge.csv"), "-o", "x.rrd"], ExitCode.USAGE, "--layout"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(
    arguments: list[str], code: ExitCode, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", *arguments]) == code
    err = capsys.readouterr().err
    assert text in err
    assert err.count("\n") == 1
    assert not list(Path().glob("*.rrd"))
