from dataclasses import replace
from math import degrees
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from rrd_content import tab_names
from windy_trials import windy_analysis

from analysis.replay.replay_results import Analysis
from analysis.view.panels import Panel
from analysis.view.replay_panels import equation_panels
from analysis.view.replay_review import write_replay_review
from analysis.view.sensor_panels import sensor_panels
from analysis.view.series import Series
from analysis.view.series_builder import SeriesBuilder


@pytest.fixture(scope="module")
def drawn(sensor_analysis: Analysis) -> dict[str, Series]:
    plan = sensor_analysis.findings.plan
    builder = SeriesBuilder(plan.clock, plan.stats)
    builder.add(sensor_analysis.as_chunk())
    return builder.result()


@pytest.fixture(scope="module")
def panels(sensor_analysis: Analysis, drawn: dict[str, Series]) -> dict[str, Panel]:
    histories, others = sensor_panels(sensor_analysis.findings, drawn)
    return {panel.name: panel for panel in (*histories, *others)}


def test_each_sensor_error_has_its_history_with_a_band(
    sensor_analysis: Analysis, panels: dict[str, Panel]
) -> None:
    (series,) = panels["sensor_gyro"].series
    further = sensor_analysis.estimates.further
    assert further is not None
    found = further.of("gyro")
    assert found is not None
    value, std = np.degrees(found)
    high, low, middle = (line.values for line in series.lines)
    np.testing.assert_allclose(middle, value)
    np.testing.assert_allclose(high - low, 4 * std)
    assert panels["sensor_gyro"].title.startswith("gyro bias = 0.0")
    assert panels["sensor_gyro"].limits[0] < value[-1] < panels["sensor_gyro"].limits[1]


def test_an_error_that_is_not_determined_has_no_number_in_its_title(
    sensor_analysis: Analysis, drawn: dict[str, Series]
) -> None:
    errors = [replace(e, determined=False) for e in sensor_analysis.findings.sensor_errors]
    findings = replace(sensor_analysis.findings, sensor_errors=tuple(errors))
    histories, _ = sensor_panels(findings, drawn)
    assert histories[0].title == "gyro bias = not determined [deg/s]"


def test_the_heading_is_drawn_as_measured_and_as_estimated(
    sensor_analysis: Analysis, panels: dict[str, Panel]
) -> None:
    measured, state = panels["sensor_heading"].series
    known = np.isfinite(sensor_analysis.signals["compass"])
    assert len(measured.time_secs) == known.sum()
    at_samples = np.interp(measured.time_secs, state.time_secs, state.lines[-1].values)
    assert np.abs(at_samples - measured.lines[0].values).max() < 0.1  # deg


def test_innovations_of_heading_and_position_are_over_their_std(
    sensor_analysis: Analysis, panels: dict[str, Panel]
) -> None:
    estimates = sensor_analysis.estimates
    for i, name in enumerate(("compass", "north", "east"), 2):
        normalised = estimates.innovations[:, i] / estimates.innovation_stds[:, i]
        drawn = panels[f"innovation_{name}"].series[0].lines[0].values
        np.testing.assert_allclose(drawn, normalised[np.isfinite(normalised)])
        low, high = panels[f"innovation_{name}"].limits
        assert low <= -4 < 4 <= high  # ±2σ are seen, however small the innovations


def test_the_first_panel_of_a_kind_has_the_legend(panels: dict[str, Panel]) -> None:
    named = [name for name, panel in panels.items() if panel.legend]
    assert named == ["sensor_gyro", "sensor_heading", "innovation_compass"]


def test_smoothed_disturbances_have_bands(
    sensor_analysis: Analysis, drawn: dict[str, Series]
) -> None:
    yaw, surge = equation_panels(sensor_analysis.findings, drawn)
    for axis, (column, scale) in enumerate(((yaw, degrees(1) * 1e6), (surge, 1e3))):
        panel = column[0]
        (series,) = panel.series  # no line of the observer's noise
        high, low, _ = (line.values for line in series.lines)
        stds = sensor_analysis.disturbance.stds
        assert stds is not None
        np.testing.assert_allclose(high - low, 4 * stds[:, axis] * scale, rtol=1e-6)


def test_the_wind_has_its_coefficients_and_its_moment_drawn() -> None:
    result = windy_analysis()
    builder = SeriesBuilder(result.findings.plan.clock, result.findings.plan.stats)
    builder.add(result.as_chunk())
    drawn = builder.result()
    histories, others = sensor_panels(result.findings, drawn)
    assert [panel.name for panel in histories] == [
        "sensor_wind_oblique", "sensor_wind_beam", "sensor_wind_head",
    ]  # fmt: skip
    assert not others
    assert histories[2].title.startswith("head wind, 10 m/s = ")
    assert histories[2].title.endswith(" [mm/s²]")
    yaw, surge = equation_panels(result.findings, drawn)
    for panel, values in (
        (yaw[0], result.disturbance.yaw_wind),
        (surge[0], result.disturbance.surge_wind),
    ):
        wind = panel.series[-1]
        assert wind.name == "wind"
        low, high = panel.limits
        assert low < wind.lines[0].values.min()
        assert wind.lines[0].values.max() < high
        assert np.sign(wind.lines[0].values[0]) == np.sign(values[0])


def test_a_replay_without_further_states_has_no_sensors(zigzag_analysis: Analysis) -> None:
    plan = zigzag_analysis.findings.plan
    builder = SeriesBuilder(plan.clock, plan.stats)
    builder.add(zigzag_analysis.as_chunk())
    assert sensor_panels(zigzag_analysis.findings, builder.result()) == ([], [])


def test_the_review_has_a_tab_of_the_sensors(sensor_analysis: Analysis, tmp_path: Path) -> None:
    path = tmp_path / "review.rrd"
    write_replay_review(sensor_analysis, path, text="")
    assert {"trial", "sensors"} <= set(tab_names(path))
    entities = {chunk.entity_path for chunk in RrdReader(path).stream()}
    assert {"/sensor_gyro/state", "/sensor_heading/measured", "/innovation_north/normalised"} <= (
        entities
    )
