from collections.abc import Iterator
from dataclasses import replace
from math import nan, radians

import numpy as np
import pytest
from places import SAMPLE_DATA
from windy_trials import windy_analysis

from analysis.replay.current import Current
from analysis.replay.plan import plan_replay
from analysis.replay.replay_results import Analysis, Findings
from analysis.replay.sensor_errors import SlowState
from analysis.report.further_tables import further_tables
from analysis.report.replay_json import replay_json
from analysis.report.replay_tables import replay_markdown, replay_tables
from shiplog import read
from shiplog.cli.console import print_tables

GYRO = SlowState("gyro", "gyro bias", "rad/s", radians(0.02), radians(1e-4), radians(0.1), True)
LOG = SlowState("log", "speed log bias", "m/s", 1852 / 3600, 0.01, 0.5, True)
SCALE = SlowState("log_scale", "speed log scale", "1", 0.02, 0.04, 0.05, False, "few speeds")
OMITTED = replace(LOG, value=nan, std=nan, determined=False, reason="it needs positions")
HEAD = SlowState("wind_head", "head wind, surge", "1/m", 1e-5, 1e-6, 1e-4, True)
BEAM = SlowState(
    "wind_beam", "beam wind, yaw", "rad/(s m²)", nan, nan, 1e-8, False, "the wind is too steady"
)
CURRENT = Current(0.0, -1852 / 3600, 0.01, 0.01, 60.0, 4.0)


def with_errors(analysis: Analysis, *errors: SlowState, current: Current | None = None) -> Findings:
    return replace(analysis.findings, sensor_errors=errors, current=current)


def rows_of(findings: Findings) -> dict[str, tuple[str, ...]]:
    return {row[0]: row[1:] for table in further_tables(findings) for row in table.rows}


def remarks_of(findings: Findings) -> str:
    return "\n".join(remark for table in further_tables(findings) for remark in table.remarks)


def test_without_sensor_errors_there_is_no_table(zigzag_analysis: Analysis) -> None:
    assert not list(further_tables(zigzag_analysis.findings))
    assert replay_json(zigzag_analysis.findings)["sensor_errors"] == {}
    assert replay_json(zigzag_analysis.findings)["current"] is None


def test_sensor_errors_are_in_the_units_of_the_other_tables(zigzag_analysis: Analysis) -> None:
    rows = rows_of(with_errors(zigzag_analysis, GYRO, LOG, SCALE))
    assert rows["gyro bias"] == ("0.02000", "0.00010", "± 0.00020", "deg/s", "yes")
    assert rows["speed log bias"] == ("1.000", "0.019", "± 0.038", "kn", "yes")
    assert rows["speed log scale"] == ("2.0", "4.0", "± 7.8", "%", "no")


def test_what_is_not_determined_has_its_reason(zigzag_analysis: Analysis) -> None:
    findings = with_errors(zigzag_analysis, GYRO, OMITTED, SCALE)
    assert rows_of(findings)["speed log bias"] == ("not estimated", "", "", "kn", "no")
    assert "speed log bias: not estimated: it needs positions." in remarks_of(findings)
    assert "speed log scale: not determined: few speeds." in remarks_of(findings)
    found = replay_json(findings)["sensor_errors"]["log"]
    assert (found["value"], found["determined"]) == (None, False)
    assert found["reason"] == "it needs positions"


def test_sensor_errors_in_json_are_in_si(zigzag_analysis: Analysis) -> None:
    found = replay_json(with_errors(zigzag_analysis, GYRO))["sensor_errors"]["gyro"]
    assert (found["unit"], found["value"], found["reason"]) == ("rad/s", GYRO.value, None)
    low, high = found["interval_95"]
    assert high - low == pytest.approx(2 * 1.96 * GYRO.std)
    assert (low + high) / 2 == pytest.approx(GYRO.value)


def test_a_current_has_set_and_drift(zigzag_analysis: Analysis) -> None:
    findings = with_errors(zigzag_analysis, GYRO, current=CURRENT)
    assert rows_of(findings)["to east"] == ("-1.000", "0.019", "± 0.038", "kn")
    assert rows_of(findings)["drift length"] == ("60.0", "4.0", "± 7.8", "m")
    assert "Set 270° ± 3°, drift 1.000 ± 0.038 kn (95 %), at the end." in remarks_of(findings)
    found = replay_json(findings)["current"]
    assert found["direction"] == pytest.approx(1.5 * np.pi)
    assert found["speed"] == pytest.approx(1852 / 3600)


def test_a_current_within_its_uncertainty_has_neither(zigzag_analysis: Analysis) -> None:
    weak = replace(CURRENT, north_std=1.0)
    remarks = remarks_of(with_errors(zigzag_analysis, current=weak))
    assert "No current" in remarks
    assert "Set" not in remarks


def test_a_current_that_is_not_determined_has_its_reason(zigzag_analysis: Analysis) -> None:
    unsure = replace(CURRENT, reason="the innovations of north are larger than expected")
    remarks = remarks_of(with_errors(zigzag_analysis, current=unsure))
    assert "Not determined: the innovations of north" in remarks
    assert "Set" not in remarks


def test_the_wind_is_shown_as_what_10_m_per_s_do(zigzag_analysis: Analysis) -> None:
    findings = replace(zigzag_analysis.findings, wind=(BEAM, HEAD))
    assert rows_of(findings)["head wind, surge"] == ("1.00", "0.10", "± 0.20", "mm/s²", "yes")
    assert rows_of(findings)["beam wind, yaw"] == ("not estimated", "", "", "10⁻⁶ deg/s³", "no")
    assert "beam wind, yaw: not estimated: the wind is too steady." in remarks_of(findings)
    found = replay_json(findings)["wind"]
    assert (found["wind_head"]["value"], found["wind_head"]["unit"]) == (1e-5, "1/m")
    assert (found["wind_beam"]["value"], found["wind_beam"]["determined"]) == (None, False)
    assert replay_json(zigzag_analysis.findings)["wind"] == {}


def test_moment_and_force_of_the_wind_are_among_the_disturbances() -> None:
    findings = windy_analysis().findings
    (table,) = (t for t in replay_tables(findings) if t.title == "Disturbances")
    shown = {row[0] for row in table.rows}
    assert {"yaw, wind [10⁻⁶ deg/s³]", "surge, wind [mm/s²]"} <= shown
    assert "Disturbance models: constant, wind, states of the filter" in table.remarks[0]
    assert replay_json(findings)["disturbances"]["surge_wind"]["unit"] == "m/s²"


@pytest.fixture(params=["long reasons", "a replay", "a wind"])
def widest(
    request: pytest.FixtureRequest, zigzag_analysis: Analysis, sensor_analysis: Analysis
) -> Iterator[Findings]:
    if request.param == "a replay":
        yield sensor_analysis.findings
    elif request.param == "a wind":
        yield windy_analysis().findings
    else:
        reason = "gyro bias and constant yaw moment cannot be distinguished, " * 3
        long = replace(SCALE, reason=reason)
        yield with_errors(zigzag_analysis, GYRO, OMITTED, long, current=CURRENT)


def test_no_line_is_wider_than_the_terminal_and_no_name_is_shortened(
    widest: Findings, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    print_tables(replay_tables(widest))
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    assert "…" not in printed


def test_a_replay_shows_the_error_it_was_given(sensor_analysis: Analysis) -> None:
    findings = sensor_analysis.findings
    page = replay_markdown(findings)
    value, std = rows_of(findings)["gyro bias"][:2]
    assert abs(float(value) - 0.02) < 3 * float(std)
    assert "Heading and position are measurements of the filter." in page
    assert "constant, states of the filter and smoothed with them." in page
    residuals = replay_json(findings)["residuals"]
    assert list(residuals) == ["yaw_rate", "speed", "heading", "north", "east"]
    assert all(each["count"] > 100 for each in residuals.values())


def test_where_the_bias_is_estimated_it_is_no_warning() -> None:
    log = read(SAMPLE_DATA / "zigzag_10_10_dropouts.mcap")
    for settings, warned in (({}, True), ({"filter.sensor_bias": "auto"}, False)):
        warnings = [w for w in plan_replay(log, settings=settings).warnings if "bias of" in w]
        assert len(warnings) == warned
        assert all("estimate it in a replay by --sensor-bias auto" in w for w in warnings)


def test_small_innovations_of_heading_and_position_are_explained(
    sensor_analysis: Analysis,
) -> None:
    page = replay_markdown(sensor_analysis.findings)
    assert "heading 0.001 deg, north 0.5 m, east 0.5 m" in page
    assert "heading: innovations smaller" not in page
