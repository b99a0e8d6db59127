"""Panels of a ship's motion: what is measured, what is computed, and what is not known."""

from dataclasses import replace

import numpy as np

from analysis.view.motion_panels import MotionHistory, motion_panels

TIMES = np.arange(0.0, 100.0)
HISTORY = MotionHistory(
    TIMES,
    np.full(100, 0.1),
    np.full(100, 80.0),
    {"heading": 0.01 * TIMES, "yaw_rate": np.full(100, 0.01), "speed": np.full(100, 5.0)},
)


def test_what_is_computed_is_drawn_over_what_is_measured_with_one_legend() -> None:
    computed = {"yaw_rate": HISTORY.measured["yaw_rate"], "speed": np.full(100, 6.0)}
    history = replace(HISTORY, computed=computed, computed_name="estimated")
    *_, yaw_rate, speed = motion_panels("m", history)
    assert [line.name for each in speed.series for line in each.lines] == ["measured", "estimated"]
    names = [series.name for series in speed.series]
    assert names == sorted(names)  # Rerun's order: the last on top
    assert (yaw_rate.legend, speed.legend) == (True, False)


def test_what_is_not_measured_has_no_panel() -> None:
    unknown = np.full(100, np.nan)
    measured = {**HISTORY.measured, "speed": unknown, "heading": unknown}
    names = [panel.name for panel in motion_panels("m", replace(HISTORY, measured=measured))]
    assert names == ["m/steering/rudder", "m/yaw_rate"]


def test_sway_and_changing_revolutions_have_panels() -> None:
    measured = {**HISTORY.measured, "sway": 0.01 * TIMES}
    history = replace(HISTORY, measured=measured, rpm=np.where(TIMES < 50, 80.0, 0.0))
    titles = [panel.title for panel in motion_panels("m", history)]
    assert titles[-2].startswith("sway [kn]: 0 to ")
    assert titles[-1] == "rpm: 0 to 80"


def test_a_slow_sensor_is_joined_and_a_gap_is_not() -> None:
    heading = np.where(np.arange(100) % 5 == 0, 0.01 * TIMES, np.nan)
    heading[30:80] = np.nan
    measured = {**HISTORY.measured, "heading": heading}
    drawn = motion_panels("m", replace(HISTORY, measured=measured))[0].series[0].lines[0].values
    assert np.isnan(drawn).sum() == 1
    assert len(drawn) == 10 + 1
