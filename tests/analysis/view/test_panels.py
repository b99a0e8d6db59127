"""Panels: the corner of their legends, and strokes that a viewer does not average away."""

import numpy as np
import pytest

from analysis.view.panels import Panel, free_corner, strokes
from analysis.view.series import GREY, Line, Series

TIMES = np.linspace(0.0, 100.0, 201)


def panel_of(values: np.ndarray) -> Panel:
    series = Series("s", TIMES, (Line("s", values, GREY),))
    return Panel("p", "p", (series,), (0.0, 1.0))


@pytest.mark.parametrize(
    ("values", "corner"),
    [
        (TIMES / 100, "LeftTop"),
        (1 - TIMES / 100, "RightTop"),
        (np.full(201, 0.9), "RightBottom"),
        (np.full(201, 5.0), "RightTop"),  # outside of the axis
        (np.full(201, np.nan), "RightTop"),
    ],
)
def test_a_legend_is_in_a_corner_that_the_lines_leave_free(values: np.ndarray, corner: str) -> None:
    assert free_corner(panel_of(values)) == corner


def test_a_panel_without_points_has_its_legend_in_the_usual_corner() -> None:
    empty = Series("s", np.zeros(0), (Line("s", np.zeros(0), GREY),))
    assert free_corner(Panel("p", "p", (empty,), (0.0, 1.0))) == "RightTop"


def test_strokes_keep_both_ends_at_one_instant() -> None:
    spans = np.array([[5.0, 5.0], [1.0, 1.0]])
    drawn = strokes("marks", spans, (-1.0, 2.0), Line("mark", np.zeros(0), GREY))
    assert drawn.time_secs.tolist() == [1.0, 1.0, 1.0, 5.0, 5.0, 5.0]
    assert drawn.lines[0].values[[0, 1, 3, 4]].tolist() == [-1.0, 2.0, -1.0, 2.0]
    assert drawn.spiky  # else a viewer draws their mean
