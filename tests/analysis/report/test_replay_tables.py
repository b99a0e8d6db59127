from dataclasses import replace

import numpy as np

from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_json import replay_json
from analysis.report.replay_tables import replay_markdown, replay_tables
from shiplog import TrialLog
from shiplog.types import Event


def test_the_papers_wave_colours_the_innovations(zigzag_analysis: Analysis) -> None:
    page = replay_markdown(zigzag_analysis.findings)
    assert "speed: innovations larger than expected and NOT white" in page
    assert "yaw rate: innovations as large as expected and white" in page


def test_the_size_of_the_correlation_is_beside_its_significance(zigzag_analysis: Analysis) -> None:
    findings = zigzag_analysis.findings
    speed = replace(findings.residuals[1], whiteness_p=1e-12, correlation_lag_secs=0.3)
    pages = {}
    for size in (-0.012, 0.12):
        residuals = (findings.residuals[0], replace(speed, correlation=size))
        pages[size] = replay_markdown(replace(findings, residuals=residuals))
        assert f"| <1e-9 | {size:.2f} | 0.3 |" in pages[size]
    assert "NOT white" in pages[0.12]
    assert "NOT white" not in pages[-0.012]
    assert "nearly white: their correlation is significant" in pages[-0.012]


def test_a_coefficient_that_is_not_determined_is_not_printed(zigzag_analysis: Analysis) -> None:
    uncertain = replace(zigzag_analysis.findings.yaw.coefficients["b1"], value=1e-4, std=1e-3)
    findings = zigzag_analysis.findings
    yaw = replace(findings.yaw, coefficients=findings.yaw.coefficients | {"b1": uncertain})
    tables = replay_tables(replace(findings, yaw=yaw))
    rows = {row[0]: row for table in tables for row in table.rows}
    assert rows["b1"][1] == "not determined"
    assert "1e-04" not in rows["b1"][1]
    assert rows["a"][1].startswith("-0.026")


def test_tables_are_in_degrees_and_knots(zigzag_analysis: Analysis) -> None:
    rows = {row[0]: row for table in replay_tables(zigzag_analysis.findings) for row in table.rows}
    rms = zigzag_analysis.findings.residuals[0].rms * 180 / np.pi
    assert rows["yaw rate [deg/s]"][1] == f"{rms:.3g}"
    rms = zigzag_analysis.findings.residuals[1].rms * 3600 / 1852
    assert rows["speed [kn]"][1] == f"{rms:.3g}"


def test_a_fitted_model_is_named_on_the_page(zigzag_log: TrialLog) -> None:
    page = replay_markdown(analyse(replace(zigzag_log, vessel_toml=None)).findings)
    assert "first model, fitted to this log" in page
    assert "in proportion to the speed" in page


def test_the_filter_is_named_on_the_page(zigzag_log: TrialLog) -> None:
    settings = {"filter.kind": "extended", "filter.smooth": True}
    page = replay_markdown(analyse(zigzag_log, settings=settings).findings)
    assert "Filter: extended, smoothed" in page


def test_the_innovations_of_a_stuck_gyro_are_not_judged(zigzag_log: TrialLog) -> None:
    channels = [
        replace(c, values=np.full(len(c), 1e-3)) if c.name == "yaw_rate" else c for c in zigzag_log
    ]
    findings = analyse(replace(zigzag_log, channels=tuple(channels))).findings
    rows = {row[0]: row for table in replay_tables(findings) for row in table.rows}
    assert rows["yaw rate [deg/s]"][2:7] == ("not judged", "", "", "", "")
    assert float(rows["speed [kn]"][2]) > 0
    page = replay_markdown(findings)
    assert "yaw rate: innovations not judged, since the measurement is constant" in page
    assert replay_json(findings)["residuals"]["yaw_rate"]["mean_nis"] is None


def test_warnings_are_on_the_page(zigzag_analysis: Analysis) -> None:
    page = replay_markdown(replace(zigzag_analysis.findings, warnings=("the gyro slept",)))
    assert "## Warnings\n\n- the gyro slept" in page


def test_events_are_listed_and_cannot_break_the_page(zigzag_analysis: Analysis) -> None:
    start_ns = zigzag_analysis.findings.plan.log_stats.span_ns[0]
    event = Event(start_ns + 10**10, "execute | 20\nstarboard")
    findings = replace(zigzag_analysis.findings, events=(event,))
    assert replay_tables(findings)[-1].rows[0][1:] == (
        "10.0",
        "info",
        "operator",
        "execute | 20\nstarboard",
    )
    assert "execute \\| 20 starboard |" in replay_markdown(findings)
    assert "## Events" not in replay_markdown(zigzag_analysis.findings)


def test_small_innovations_name_the_setting_of_their_output_alone(
    zigzag_analysis: Analysis,
) -> None:
    findings = zigzag_analysis.findings
    yaw, speed = findings.residuals
    heading = replace(yaw, name="heading", unit="rad", mean_nis=0.1, nis_band=(0.9, 1.1))
    further = replace(findings.plan.noise.further, outputs=("compass",), output_stds=(1e-3,))
    noise = replace(findings.plan.noise, further=further)
    plan = replace(findings.plan, noise=noise)
    page = replay_markdown(replace(findings, plan=plan, residuals=(yaw, speed, heading)))
    assert "change it by filter.heading_std." in page
    assert "position_std" not in page
