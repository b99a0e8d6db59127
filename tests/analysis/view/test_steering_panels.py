"""Heading with the rudder over it, and in panels of their own where the ship turns far."""

import numpy as np

from analysis.view.panels import Panel
from analysis.view.steering_panels import heading_series, rudder_series, steering_panels

TIMES = np.arange(0.0, 100.0)
ZIGZAG = 20 * np.sin(TIMES / 10)
RUDDER = rudder_series(TIMES, 10 * np.sign(np.cos(TIMES / 10)))


def entities(panels: list[Panel]) -> list[str]:
    return [f"{panel.name}/{series.name}" for panel in panels for series in panel.series]


def test_the_rudder_of_a_zigzag_is_over_the_heading_with_a_legend() -> None:
    (panel,) = steering_panels("s", RUDDER, heading_series(TIMES, ZIGZAG), "12.3°")
    assert panel.title.startswith("heading from 12.3°: ")
    assert panel.title.endswith("; rudder: -10 to 10 [deg]")
    assert panel.legend
    names = [line.name for series in panel.series for line in series.lines]
    assert names == ["heading", "rudder"]
    assert len({series.lines[0].colour for series in panel.series}) == 2


def test_in_a_circle_each_has_a_panel_and_the_entities_are_the_same() -> None:
    zigzag = steering_panels("s", RUDDER, heading_series(TIMES, ZIGZAG))
    circle = steering_panels("s", RUDDER, heading_series(TIMES, 5 * TIMES))
    assert len(circle) == 2
    assert circle[1].title == "rudder: -10 to 10 [deg]"
    expected = ["s/heading/measured", "s/rudder/measured"]
    assert entities(zigzag) == entities(circle) == expected


def test_without_a_heading_there_is_the_rudder_alone() -> None:
    for headings in ([], heading_series(TIMES, np.full(100, np.nan))):
        (panel,) = steering_panels("s", RUDDER, headings)
        assert entities([panel]) == ["s/rudder/measured"]


def test_a_simulated_heading_is_drawn_over_the_measured_one_and_named() -> None:
    headings = heading_series(TIMES, 5 * TIMES, 5 * TIMES + 1)
    heading, _ = steering_panels("s", RUDDER, headings)
    assert entities([heading]) == ["s/heading/measured", "s/heading/simulated"]
    assert heading.legend
    assert heading.title == "heading: 0 to 495 [deg]"  # the measured one's range
