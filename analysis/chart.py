"""The track as a chart: east to the right, north up, ships along it and a scale.

Points are (x, y) of a drawing whose y points down: (east, -north), in m.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, log10

import numpy as np

from shiplog.types import FloatArray

from .drawing import Series
from .pipeline import Findings

SHIPS = 10  # outlines along the track
SYMBOL = 1 / 20  # of the chart's width: the length of a ship whose own is unknown or smaller
HULL = np.array(  # forward and starboard, in lengths: bow, shoulders, stern
    [[0.5, 0.0], [0.25, 0.09], [-0.5, 0.09], [-0.5, -0.09], [0.25, -0.09], [0.5, 0.0]]
)


@dataclass(frozen=True, eq=False)
class Chart:
    """What is drawn of a track."""

    title: str
    track: FloatArray  # (k, 2)
    time_secs: FloatArray  # (k,) since the signals' start
    ships: list[FloatArray]  # outlines, each (6, 2)
    scale: FloatArray  # (2, 2)
    scale_label: str
    bounds: tuple[FloatArray, FloatArray]  # the corners with the least and the greatest x and y


def draw_track(findings: Findings, drawn: Mapping[str, Series]) -> Chart | None:
    """The chart of a track; None where no position is known."""
    track = drawn["track"]
    north, east = (line.values for line in track.lines)
    points = np.column_stack((east, -north))
    known = np.isfinite(points).all(axis=1)
    points, at = points[known], track.time_secs[known]
    if len(points) < 2:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    width = max(float((high - low).max()), 1.0)
    length = max(findings.vessel.length or 0.0, SYMBOL * width)
    bar = _round_length(width / 4)
    foot = np.array([low[0], high[1] + 0.12 * width])
    margin = 0.08 * width
    return Chart(
        f"track, north up: {findings.track_origin}",
        points,
        at,
        _ships(drawn.get("heading"), points, at, length),
        foot + np.array([[0.0, 0.0], [bar, 0.0]]),
        f"{bar:g} m" if bar < 1000 else f"{bar / 1000:g} km",
        (low - margin, np.array([max(high[0], foot[0] + bar), foot[1]]) + margin),
    )


def _ships(
    compass: Series | None, points: FloatArray, at: FloatArray, length: float
) -> list[FloatArray]:
    """Outlines evenly along the way, headed as measured, or else along the track."""
    sailed = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    rows = np.unique(np.searchsorted(sailed, np.linspace(0.0, sailed[-1], SHIPS)))
    east, south = np.gradient(points, axis=0).T
    heading = np.arctan2(east, -south)
    if compass is not None and len(compass.time_secs):
        heading = np.interp(at, compass.time_secs, compass.lines[0].values)
    return [points[row] + _turned(HULL * length, heading[row]) for row in rows]


def _turned(hull: FloatArray, heading: float) -> FloatArray:
    """Forward and starboard to (east, -north)."""
    ahead = np.array([np.sin(heading), -np.cos(heading)])
    abeam = np.array([np.cos(heading), np.sin(heading)])
    turned: FloatArray = hull[:, :1] * ahead + hull[:, 1:] * abeam
    return turned


def _round_length(length: float) -> float:
    """The nearest of 1, 2, 5 times a power of ten that is not longer."""
    power = 10.0 ** floor(log10(length))
    return max(step for step in (1, 2, 5) if step * power <= length) * power
