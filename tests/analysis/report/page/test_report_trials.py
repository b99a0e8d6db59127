"""Reports computed from logs: of a whole manoeuvre, and of logs that lack what it needs."""

import json
import pickle
import re
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest
from places import SAMPLE_DATA

from analysis.report.page.report_page import report_page
from analysis.report.page.report_trials import ReportPart, report_trials
from analysis.report.page.trial_json import trial_json
from analysis.report.page.trial_report import ReportedLog, TrialReport
from shiplog import TrialLog, read, write
from shiplog.cli.main import main

CIRCLE = SAMPLE_DATA / "turning_circle_35.mcap"
FAILURE, USAGE, DATA_LOST = 1, 2, 3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("report")


@pytest.fixture(scope="module")
def output(folder: Path) -> dict[str, object]:
    """Run the verb on a turning circle of a ship of a stated length; return its JSON."""
    arguments = ["report", str(CIRCLE), "--length", "200", "--execute", "10,300"]
    outputs = ["-o", f"{folder}/r.html", "--json", f"{folder}/r.json"]
    assert main([*arguments, *outputs]) == 0
    return json.loads((folder / "r.json").read_text("utf-8"))  # type: ignore[no-any-return]


def test_the_verb_writes_the_page_and_the_numbers(folder: Path, output: dict[str, object]) -> None:
    (log,) = output["logs"]  # type: ignore[misc]
    (circle,) = log["manoeuvres"]
    indices = {index["name"]: index for index in circle["indices"]}
    assert circle["kind"] == "turning circle"
    assert circle["execute_secs"] == pytest.approx(10.0, abs=0.1)
    advance = indices["advance"]
    assert advance["interval_95"][0] < advance["value"] < advance["interval_95"][1]
    assert advance["verdict"] == "fails"
    assert advance["criterion"]["limit"] == pytest.approx(4.5 * 200)
    assert log["files"][0]["sha256"] == sha256(CIRCLE.read_bytes()).hexdigest()
    assert log["replay"]["residuals"]["yaw_rate"]["white"] is True
    page = (folder / "r.html").read_text("utf-8")
    assert f"{advance['value']:.0f} m" in page
    assert "Filter residuals" in page
    assert "the stated execute at 300 s" in page  # from which no manoeuvre counts
    assert "the stated execute at 10 s" not in page
    assert "times stated, s from the start of the log: 10, 300" in page
    assert f"shiplog report {CIRCLE} --length=200.0 --execute=10,300" in page
    assert len(page.encode()) < 400_000


def test_a_damaged_log_is_reported_with_the_exit_code_of_lost_data(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    damaged, page = folder / "damaged.mcap", folder / "damaged.html"
    damaged.write_bytes(CIRCLE.read_bytes()[:-100_000])
    assert main(["report", str(damaged), "-o", str(page), "--json", "-"]) == DATA_LOST
    output = capsys.readouterr()
    (log,) = json.loads(output.out)["logs"]  # nothing else on stdout
    assert log["data_lost"] is True
    assert "Verdict, IMO MSC.137(76)" in output.err
    assert "A part of this log could not be read." in page.read_text("utf-8")


def broken(name: str, change: Callable[[TrialLog], TrialLog], folder: Path) -> Path:
    path = folder / f"{name}.mcap"
    write(change(read(CIRCLE)), path)
    return path


def without(*names: str) -> Callable[[TrialLog], TrialLog]:
    return lambda log: replace(log, channels=tuple(c for c in log if c.name not in names))


def stopped(log: TrialLog) -> TrialLog:
    """Return the log of a ship that lies still."""
    still = {c.name: c.values[:1] if c.name == "position" else 0.0 for c in log}
    channels = tuple(replace(c, values=0 * c.values + still[c.name]) for c in log)
    return replace(log, channels=channels)


CASES = {
    "half": ("tactical diameter", lambda log: log.between(None, 230)),
    "no_heading": ("heading", without("heading")),
    "no_position": ("track", without("position")),
    "no_yaw_rate": ("yaw_rate", without("yaw_rate")),
    "stopped": ("stopped", stopped),
}


@pytest.fixture(scope="module")
def poor(folder: Path) -> tuple[TrialReport, str]:
    """Return the report and the page of logs that each lack something; of no known length."""
    parts = [ReportPart(broken(name, change, folder)) for name, (_, change) in CASES.items()]
    report = report_trials(parts)
    return report, report_page(report)


def reasons(log: ReportedLog) -> str:
    """Return all reasons that a log's part of the report gives."""
    of_manoeuvres = [each for m in log.trial.manoeuvres for each in m.not_computed]
    texts = [f"{each.subject}: {each.reason}" for each in (*log.trial.not_computed, *of_manoeuvres)]
    return "\n".join((*texts, log.replay_error))


@pytest.mark.parametrize("number", range(len(CASES)), ids=list(CASES))
def test_a_log_that_lacks_something_is_reported_with_the_reason(
    poor: tuple[TrialReport, str], number: int
) -> None:
    report, page = poor
    word, _ = list(CASES.values())[number]
    assert word in reasons(report.logs[number])
    assert f"{list(CASES)[number]}.mcap" in page
    assert not re.search(r"\bnan\b", page)


def test_without_the_ships_length_the_limits_are_not_applied(
    poor: tuple[TrialReport, str],
) -> None:
    report, page = poor
    assert "the ship&#39;s length is unknown" in page.split('id="conditions"')[0]
    assert trial_json(report)["logs"][0]["conditions"]["length"] is None


def test_a_report_can_be_pickled_and_gives_the_same_page(poor: tuple[TrialReport, str]) -> None:
    report, page = poor
    assert report_page(pickle.loads(pickle.dumps(report))) == page  # noqa: S301 - our own


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "r.txt"], "the output is a .html file"),
        (["--pdf", "r.html"], "the output is a .pdf file"),
        (["--start-rule", "stated"], "needs --execute"),
        (["--execute", "soon"], "--execute takes numbers"),
        (["--antenna", "3"], "--antenna takes two numbers"),
        (["--test-speed", "-1"], "--test-speed takes m/s"),
        (["--compass-error", "-1"], "--compass-error takes degrees"),
        (["--compass-error", "nan"], "--compass-error takes degrees"),
        (["--length", "0"], "length"),
    ],
)
def test_an_invalid_request_is_a_usage_error_before_any_work(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(CIRCLE), *words]) == USAGE
    assert message in capsys.readouterr().err


def test_a_missing_log_leaves_no_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = folder / "none.html"
    assert main(["report", str(folder / "none.mcap"), "-o", str(page)]) == FAILURE
    assert "no such file" in capsys.readouterr().err
    assert not page.exists()
