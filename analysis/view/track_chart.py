"""The track as a chart: north up, with outlines of the ship along it and a scale.

Points are (x, y) of a drawing whose y axis points down: (east, -north), m.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, log10

import numpy as np

from analysis.replay.replay_results import Findings
from shiplog.types import FloatArray

from .series import Colour, Series

MAX_OUTLINES = 10  # along the track
MIN_OUTLINE_SHARE = 1 / 20  # of the chart's width: the least length of an outline
HULL = np.array(  # forward and starboard, in ship lengths: bow, shoulders, stern
    [[0.5, 0.0], [0.25, 0.09], [-0.5, 0.09], [-0.5, -0.09], [0.25, -0.09], [0.5, 0.0]]
)


@dataclass(frozen=True, eq=False)
class ChartPart:
    """A part of a track in a colour of its own, (k, 2) points."""

    label: str
    colour: Colour
    points: FloatArray


@dataclass(frozen=True, eq=False)
class ChartMark:
    """A place on a track to be marked, (2,) point."""

    label: str
    colour: Colour
    point: FloatArray


@dataclass(frozen=True, eq=False)
class TrackChart:
    """A track to be drawn.

    Attributes
    ----------
    title
        The title.
    track
        (k, 2) points.
    time_secs
        (k,) s since the start of the signals.
    ships
        Outlines of the ship, each (6, 2).
    scale, scale_label
        The ends of the scale, (2, 2), and its length in words.
    bounds
        The corners of the chart with the least and the greatest x and y, (2,) each.
    simulated
        (m, 2) the track of a simulated ship; None without one.
    parts
        Parts in colours of their own, such as manoeuvres.
    marks
        Places with labels.
    """

    title: str
    track: FloatArray
    time_secs: FloatArray
    ships: list[FloatArray]
    scale: FloatArray
    scale_label: str
    bounds: tuple[FloatArray, FloatArray]
    simulated: FloatArray | None = None
    parts: tuple[ChartPart, ...] = ()
    marks: tuple[ChartMark, ...] = ()


def draw_track(findings: Findings, drawn: Mapping[str, Series]) -> TrackChart | None:
    """Return the chart of a replay's track; None where no position is known."""
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
    """Return the chart of a track; None where no position is known.

    Parameters
    ----------
    title
        The title.
    positions
        (k, 2) north and east, m; NaN where not known.
    at
        (k,) s since the start of the signals.
    heading
        (k,) rad, of the outlines; None heads them along the track.
    length
        Of the ship, m; None where it is not known.
    simulated
        (m, 2) the track of a simulated ship, north and east, m.
    """
    known = np.isfinite(positions).all(axis=1)
    points, at = _xy(positions[known]), at[known]
    if len(points) < 2:
        return None
    other = None if simulated is None else _xy(simulated[np.isfinite(simulated).all(axis=1)])
    if other is not None and len(other) < 2:
        other = None  # the simulation diverges from the start, or has no speed
    all_points = points if other is None else np.concatenate((points, other))
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    width = max(float((high - low).max()), 1.0)
    bar = _round_length(width / 4)
    foot = np.array([low[0], high[1] + 0.12 * width])
    margin = 0.08 * width
    return TrackChart(
        title, points, at,
        _ships(points, None if heading is None else heading[known],
               max(length or 0.0, MIN_OUTLINE_SHARE * width)),
        foot + np.array([[0.0, 0.0], [bar, 0.0]]),
        f"{bar:g} m" if bar < 1000 else f"{bar / 1000:g} km",
        (low - margin, np.array([max(high[0], foot[0] + bar), foot[1]]) + margin),
        other,
    )  # fmt: skip


def _xy(positions: FloatArray) -> FloatArray:
    """Return north and east as (x, y) of the drawing."""
    return np.column_stack((positions[:, 1], -positions[:, 0]))


def _ships(points: FloatArray, heading: FloatArray | None, length: float) -> list[FloatArray]:
    """Return outlines at equal distances, headed as measured, or else along the track."""
    distance = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    rows = np.unique(np.searchsorted(distance, np.linspace(0.0, distance[-1], MAX_OUTLINES)))
    if heading is None:
        east, south = np.gradient(points, axis=0).T
        heading = np.arctan2(east, -south)
    return [points[row] + _turned(HULL * length, heading[row]) for row in rows]


def _turned(hull: FloatArray, heading: float) -> FloatArray:
    """Turn points forward and starboard to (east, -north)."""
    ahead = np.array([np.sin(heading), -np.cos(heading)])
    abeam = np.array([np.cos(heading), np.sin(heading)])
    turned: FloatArray = hull[:, :1] * ahead + hull[:, 1:] * abeam
    return turned


def _round_length(length: float) -> float:
    """Return the greatest of 1, 2, 5 times a power of ten that is not longer."""
    power = 10.0 ** floor(log10(length))
    return max(step for step in (1, 2, 5) if step * power <= length) * power
