"""The track as a chart: east to the right, north up, ships along it and a scale.

Points are (x, y) of a drawing whose y points down: (east, -north), in m.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, log10

import numpy as np

from analysis.replay.replay import Findings
from shiplog.types import FloatArray

from .series import Series

SHIPS = 10  # outlines along the track
SYMBOL = 1 / 20  # of the chart's width: the length of a ship whose own is unknown or smaller
HULL = np.array(  # forward and starboard, in lengths: bow, shoulders, stern
    [[0.5, 0.0], [0.25, 0.09], [-0.5, 0.09], [-0.5, -0.09], [0.25, -0.09], [0.5, 0.0]]
)


@dataclass(frozen=True, eq=False)
class TrackChart:
    """What is drawn of a track."""

    title: str
    track: FloatArray  # (k, 2)
    time_secs: FloatArray  # (k,) since the signals' start
    ships: list[FloatArray]  # outlines, each (6, 2)
    scale: FloatArray  # (2, 2)
    scale_label: str
    bounds: tuple[FloatArray, FloatArray]  # the corners with the least and the greatest x and y
    simulated: FloatArray | None = None  # (m, 2) another track, of a simulated ship


def draw_track(findings: Findings, drawn: Mapping[str, Series]) -> TrackChart | None:
    """The chart of a track; None where no position is known."""
    track, compass = drawn["track"], drawn.get("heading")
    north, east = (line.values for line in track.lines)
    heading = None
    if compass is not None and len(compass.time_secs):
        heading = np.interp(track.time_secs, compass.time_secs, compass.lines[0].values)
    title = f"track, north up: {findings.track_origin}"
    positions = np.column_stack((north, east))
    return make_chart(title, positions, track.time_secs, heading, findings.plan.vessel.length)


def make_chart(
    title: str,
    positions: FloatArray,
    at: FloatArray,
    heading: FloatArray | None,
    length: float | None,
    simulated: FloatArray | None = None,
) -> TrackChart | None:
    """The chart of positions north and east, (k, 2) in m, at so many seconds, (k,).

    `heading`, (k,) rad, turns the ships, else the track does; `simulated`, (m, 2), is another
    track. None where no position is known.
    """
    known = np.isfinite(positions).all(axis=1)
    points, at = _drawn(positions[known]), at[known]
    if len(points) < 2:
        return None
    other = None if simulated is None else _drawn(simulated[np.isfinite(simulated).all(axis=1)])
    every = points if other is None else np.concatenate((points, other))
    low, high = every.min(axis=0), every.max(axis=0)
    width = max(float((high - low).max()), 1.0)
    bar = _round_length(width / 4)
    foot = np.array([low[0], high[1] + 0.12 * width])
    margin = 0.08 * width
    return TrackChart(
        title, points, at,
        _ships(points, None if heading is None else heading[known],
               max(length or 0.0, SYMBOL * width)),
        foot + np.array([[0.0, 0.0], [bar, 0.0]]),
        f"{bar:g} m" if bar < 1000 else f"{bar / 1000:g} km",
        (low - margin, np.array([max(high[0], foot[0] + bar), foot[1]]) + margin),
        other,
    )  # fmt: skip


def _drawn(positions: FloatArray) -> FloatArray:
    """North and east as (x, y) of the drawing."""
    return np.column_stack((positions[:, 1], -positions[:, 0]))


def _ships(points: FloatArray, heading: FloatArray | None, length: float) -> list[FloatArray]:
    """Outlines evenly along the way, headed as measured, or else along the track."""
    sailed = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    rows = np.unique(np.searchsorted(sailed, np.linspace(0.0, sailed[-1], SHIPS)))
    if heading is None:
        east, south = np.gradient(points, axis=0).T
        heading = np.arctan2(east, -south)
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
