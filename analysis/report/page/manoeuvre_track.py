"""The track of a manoeuvre with equal scales, the ship's outline, and its dimensions."""

from dataclasses import dataclass
from math import degrees, isfinite, pi

import numpy as np
from matplotlib.axes import Axes

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind, ManoeuvreSeries, SailedManoeuvre
from shiplog.types import FloatArray

from .manoeuvre_histories import has_numbers
from .svg_figure import CHART_INCHES, INK, MUTED, SERIES, PageFigure, new_figure, page_figure

HEIGHTS_INCHES = (1.2, 3.7)  # least and greatest height of the axes
TURN_MARKS = (pi / 2, pi, 3 * pi / 2, 2 * pi)
APPROACH_LENGTHS = 1.5  # of the approach that is shown before the execute, in ship lengths
HALF_BEAM_SHARE = 0.08  # of the ship's length, of the outlines along the track
MARGIN_SHARE = 0.06  # of the extent of a track, around it
MIN_WIDTH_SHARE = 0.12  # of the longer side, of the area around a straight track
SMALL = 7.5  # font size of labels within the chart


@dataclass(frozen=True)
class TrackAxes:
    """Axes of a track: ahead is up, or to the right where the track is long and narrow.

    Attributes
    ----------
    axes
        Equal scales on both.
    lies
        Whether ahead is to the right and starboard down.
    """

    axes: Axes
    lies: bool

    def place(self, ahead: float, starboard: float) -> tuple[float, float]:
        """Return x and y of a place."""
        return (ahead, starboard) if self.lies else (starboard, ahead)

    def plot(self, track: FloatArray, **style: object) -> None:
        """Draw a line, or marks, at the (n, 2) places ahead and to starboard."""
        ahead, starboard = np.atleast_2d(track).T
        self.axes.plot(*((ahead, starboard) if self.lies else (starboard, ahead)), **style)  # type: ignore[arg-type]


def is_drawn_lying(extent: FloatArray) -> bool:
    """Whether a track, (2,) ahead and to starboard, m, is drawn with ahead to the right."""
    return bool(extent[0] > extent[1] * 1.5)


def track_figure(manoeuvre: SailedManoeuvre, length: float, anchor: str) -> PageFigure | None:
    """Draw the track of the midship point with equal scales on both axes.

    Parameters
    ----------
    manoeuvre
        With its track relative to the execute.
    length
        Of the ship, m; NaN draws neither outlines nor a scale in ship lengths.
    anchor
        The figure's id.

    Returns
    -------
    PageFigure or None
        None where there is no track.
    """
    series = manoeuvre.series
    shown = shown_track(series, length)
    if np.count_nonzero(np.isfinite(shown).all(axis=1)) < 2:
        return None
    low, high = track_limits(shown)
    with new_figure([chart_inches(low, high)]) as (figure, (axes,)):
        chart = prepare_chart(axes, low, high)
        chart.plot(shown, color=SERIES[0])
        _outlines(chart, series, length)
        _turn_marks(chart, series)
        if manoeuvre.kind is ManoeuvreKind.TURNING_CIRCLE:
            _circle_dimensions(chart, manoeuvre)
        mark_execute(chart)
        length_scale(chart, length)
        caption = f"Track of the midship point: {manoeuvre.title}"
        return page_figure(figure, anchor, caption, _track_text(series))


def shown_track(series: ManoeuvreSeries, length: float) -> FloatArray:
    """Return the track with an approach of `APPROACH_LENGTHS` at most, (k, 2) m."""
    if not len(series.track) or not isfinite(length):
        return series.track
    far = np.hypot(*series.track.T) > APPROACH_LENGTHS * length
    before = np.flatnonzero(far & (series.time_secs < 0))
    return series.track[int(before[-1]) + 1 if len(before) else 0 :]


def track_limits(track: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper limits of the axes for a track, m, with a margin."""
    low, high = np.nanmin(track, axis=0), np.nanmax(track, axis=0)
    longest = max(float(np.max(high - low)), 1.0)
    widened = np.maximum(MIN_WIDTH_SHARE * longest - (high - low), 0.0) / 2
    return low - MARGIN_SHARE * longest - widened, high + MARGIN_SHARE * longest + widened


def chart_inches(low: FloatArray, high: FloatArray) -> float:
    """Return the height of the axes in which a track fills the width of the page."""
    extent = high - low
    share = extent[1] / extent[0] if is_drawn_lying(extent) else extent[0] / extent[1]
    return float(np.clip(CHART_INCHES * share, *HEIGHTS_INCHES))


def prepare_chart(axes: Axes, low: FloatArray, high: FloatArray) -> TrackAxes:
    """Set labels and equal scales of the axes of a track, which fill the width of the page."""
    chart = TrackAxes(axes, is_drawn_lying(high - low))
    size = np.array([CHART_INCHES, chart_inches(low, high)])
    start, end = np.array(chart.place(*low)), np.array(chart.place(*high))
    half = size * np.max((end - start) / size) / 2
    (left, bottom), (right, top) = (start + end) / 2 - half, (start + end) / 2 + half
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(left, right)
    axes.set_ylim(*((top, bottom) if chart.lies else (bottom, top)))
    labels = "ahead [m]", "to starboard [m]"
    axes.set_xlabel(labels[0] if chart.lies else labels[1])
    axes.set_ylabel(labels[1] if chart.lies else labels[0])
    return chart


def mark_execute(chart: TrackAxes) -> None:
    """Mark the place of the execute."""
    chart.axes.plot(0.0, 0.0, marker="o", color=INK, markersize=4)
    chart.axes.annotate(
        "execute", (0.0, 0.0), xytext=(7, -5), textcoords="offset points", va="top", fontsize=SMALL
    )


def length_scale(chart: TrackAxes, length: float) -> None:
    """Draw a bar of one ship length in the lower corner away from the execute; none for NaN."""
    if not isfinite(length):
        return
    axes = chart.axes
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    margin, is_right = 0.05 * (right - left), left + right > 0
    x = right - margin - length if is_right else left + margin
    y = bottom + 0.05 * (top - bottom)
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.0, solid_capstyle="butt")
    axes.annotate(
        f"L = {length:g} m", (x + length / 2, y), xytext=(0, 3), textcoords="offset points",
        ha="center", va="bottom", fontsize=SMALL,
    )  # fmt: skip


def _turn_times(series: ManoeuvreSeries) -> dict[float, float]:
    """Return the instants, s, at which the heading has changed by each of `TURN_MARKS`."""
    if not has_numbers(series.heading_change):
        return {}
    turned = np.abs(np.where(series.time_secs >= 0, series.heading_change, 0.0))
    return {
        angle: float(series.time_secs[np.argmax(turned >= angle)])
        for angle in TURN_MARKS
        if np.any(turned >= angle)
    }


def _place_at(series: ManoeuvreSeries, at_secs: float) -> tuple[float, float]:
    ahead, starboard = (np.interp(at_secs, series.time_secs, each) for each in series.track.T)
    return float(ahead), float(starboard)


def _outlines(chart: TrackAxes, series: ManoeuvreSeries, length: float) -> None:
    """Draw the ship to scale at the execute and at each quarter of a turn."""
    if not isfinite(length) or not has_numbers(series.heading_change):
        return
    hull = np.array([[0.5, 0.0], [0.3, 1.0], [-0.5, 1.0], [-0.5, -1.0], [0.3, -1.0], [0.5, 0.0]])
    hull = hull * [length, HALF_BEAM_SHARE * length]
    for at in (0.0, *_turn_times(series).values()):
        heading = np.interp(at, series.time_secs, series.heading_change)
        turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
        chart.plot(hull @ turn + _place_at(series, at), color=MUTED, linewidth=0.8)


def _turn_marks(chart: TrackAxes, series: ManoeuvreSeries) -> None:
    """Label the places at which the heading has changed by quarters of a turn."""
    for angle, at in _turn_times(series).items():
        place = _place_at(series, at)
        chart.plot(np.array(place), marker="s", markersize=3.5, color=SERIES[0])
        chart.axes.annotate(
            f"{degrees(angle):.0f}°", chart.place(*place), xytext=(6, 6),
            textcoords="offset points", fontsize=SMALL,
        )  # fmt: skip


def _circle_dimensions(chart: TrackAxes, manoeuvre: SailedManoeuvre) -> None:
    """Draw advance and tactical diameter as dimensions, as on a drawing."""
    advance, diameter = manoeuvre.index("advance"), manoeuvre.index("tactical diameter")
    side = -1.0 if manoeuvre.side == "port" else 1.0
    if advance is not None and isfinite(advance.value):
        text = f"advance {advance.value:.0f} m"
        _dimension(chart, (0.0, 0.0), (advance.value, 0.0), text, side)
    half_turn = _turn_times(manoeuvre.series).get(pi)
    if diameter is not None and isfinite(diameter.value) and half_turn is not None:
        ahead, _ = _place_at(manoeuvre.series, half_turn)
        text = f"tactical diameter {diameter.value:.0f} m"
        _dimension(chart, (ahead, 0.0), (ahead, side * diameter.value), text, side)


def _dimension(
    chart: TrackAxes,
    start: tuple[float, float],
    end: tuple[float, float],
    text: str,
    side: float,
) -> None:
    """Draw a line with arrows at both ends, and its text above it or away from the circle."""
    (x0, y0), (x1, y1) = chart.place(*start), chart.place(*end)
    style = {"arrowstyle": "<->", "color": MUTED, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    chart.axes.annotate("", (x1, y1), xytext=(x0, y0), arrowprops=style)
    upright = abs(y1 - y0) > abs(x1 - x0)
    outside = "right" if side > 0 else "left"
    chart.axes.annotate(
        text, ((x0 + x1) / 2, (y0 + y1) / 2), xytext=(-5 * side, 0) if upright else (0, 4),
        textcoords="offset points", rotation=90 if upright else 0,
        ha=outside if upright else "center", va="center" if upright else "bottom", fontsize=SMALL,
    )  # fmt: skip


def _track_text(series: ManoeuvreSeries) -> str:
    """Describe the track for those who cannot see it."""
    ahead, starboard = series.track.T
    return (
        f"The ship goes up to {np.nanmax(ahead):.0f} m ahead of the execute, and is between "
        f"{np.nanmin(starboard):.0f} m and {np.nanmax(starboard):.0f} m to starboard of it."
    )
