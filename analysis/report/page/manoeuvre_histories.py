"""Time histories of a manoeuvre, with rudder and heading in one panel, and its spiral curve."""

from collections.abc import Callable
from math import degrees, isfinite, pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreSeries, SailedManoeuvre
from shiplog.types import FloatArray
from shiplog.units import UNITS

from .svg_figure import MUTED, SERIES, PageFigure, new_figure, page_figure

Panel = Callable[[Axes], None]  # draws its time histories
KNOT = UNITS["kn"][1]  # m/s
HEADING_LINE, RUDDER_LINE, RATE_LINE, SPEED_LINE, RPM_LINE, DRIFT_LINE = SERIES
PANEL_INCHES, FIRST_PANEL_INCHES = 1.0, 2.4  # heights
SPIRAL_INCHES = 2.6
ONE_AXIS_TURN = pi / 3  # of heading: up to it rudder and heading share one axis
TURN_TICK_DEG, MAX_TURN_TICKS = 90.0, 7


def history_figure(manoeuvre: SailedManoeuvre, anchor: str) -> PageFigure | None:
    """Draw rudder, heading, yaw rate, speed, revolutions and drift over the time from the execute.

    Returns None where the manoeuvre has none of them.
    """
    series = manoeuvre.series
    panels: list[Panel] = [
        panel
        for values, panel in (
            (series.yaw_rate, lambda axes: _yaw_rate_panel(axes, series)),
            (series.speed, lambda axes: _speed_panel(axes, series)),
            (series.drift, lambda axes: _drift_panel(axes, series)),
        )
        if has_numbers(values)
    ]
    steers = (
        has_numbers(series.rudder)
        or has_numbers(series.rudder_order)
        or has_numbers(series.heading_change)
    )
    if steers:
        panels.insert(0, lambda axes: _steering_panel(axes, manoeuvre))
    if not panels:
        return None
    heights = [FIRST_PANEL_INCHES if steers else PANEL_INCHES, *[PANEL_INCHES] * (len(panels) - 1)]
    with new_figure(heights) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            panel(axes)
            axes.axvline(0.0, color=MUTED, linewidth=0.7, linestyle=(0, (1, 2)))
        grid[-1].set_xlabel("time from the execute [s]")
        grid[-1].set_xlim(series.time_secs[0], series.time_secs[-1])
        caption = f"Time histories: {manoeuvre.title}"
        return page_figure(figure, anchor, caption, _history_text(manoeuvre))


def spiral_figure(manoeuvre: SailedManoeuvre, anchor: str) -> PageFigure | None:
    """Draw the steady yaw rate of a spiral over the rudder, in the order sailed; None without."""
    if len(manoeuvre.spiral) < 2:
        return None
    rudder, rate = np.degrees(manoeuvre.spiral).T
    with new_figure([SPIRAL_INCHES]) as (figure, (axes,)):
        axes.plot(rudder, rate, color=HEADING_LINE, marker="o", markersize=3.5)
        axes.axhline(0.0, color=MUTED, linewidth=0.7)
        axes.axvline(0.0, color=MUTED, linewidth=0.7)
        axes.set_xlabel("rudder, to starboard [°]")
        axes.set_ylabel("steady yaw rate [°/s]")
        text = f"Steady yaw rates at {len(rudder)} rudder angles, from {rate.min():.2f} to "
        text += f"{rate.max():.2f} degrees per second."
        return page_figure(figure, anchor, f"Spiral curve: {manoeuvre.title}", text)


def has_numbers(values: FloatArray) -> bool:
    """Whether a time history has any number."""
    return bool(np.any(np.isfinite(values)))


def _steering_panel(axes: Axes, manoeuvre: SailedManoeuvre) -> None:
    """Draw rudder and heading in one panel, on one axis where the heading turns little."""
    series = manoeuvre.series
    turns = has_numbers(series.heading_change)
    one_axis = not turns or float(np.nanmax(np.abs(series.heading_change))) < ONE_AXIS_TURN
    heading_axes = axes if one_axis else axes.twinx()
    lines = []
    if has_numbers(series.rudder_order):
        lines += axes.plot(
            series.time_secs, np.degrees(series.rudder_order),
            color=RUDDER_LINE, linewidth=0.8, linestyle=(0, (3, 2)), label="rudder order",
        )  # fmt: skip
    if has_numbers(series.rudder):
        lines += axes.plot(
            series.time_secs, np.degrees(series.rudder), color=RUDDER_LINE, label="rudder"
        )
    if turns:
        lines += heading_axes.plot(
            series.time_secs, np.degrees(series.heading_change),
            color=HEADING_LINE, linestyle=(0, (6, 1.5)), label="change of heading",
        )  # fmt: skip
    axes.set_ylabel("rudder, heading [°]" if one_axis else "rudder [°]")
    if not one_axis:
        heading_axes.set_ylabel("change of heading [°]")
        heading_axes.grid(visible=False)
        heading_axes.spines["right"].set_visible(True)
        turned = degrees(float(np.nanmax(np.abs(series.heading_change))))
        step = TURN_TICK_DEG * (1 + turned // (TURN_TICK_DEG * MAX_TURN_TICKS))
        heading_axes.yaxis.set_major_locator(MultipleLocator(step))
    _mark_headings(heading_axes, manoeuvre)
    axes.legend(
        handles=lines, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2
    )


def _mark_headings(axes: Axes, manoeuvre: SailedManoeuvre) -> None:
    """Mark the heading at the instants of a manoeuvre, and the switch headings of a zig-zag."""
    series = manoeuvre.series
    if isfinite(manoeuvre.switch_heading):
        for level in (-manoeuvre.switch_heading, manoeuvre.switch_heading):
            axes.axhline(degrees(level), color=MUTED, linewidth=0.7, linestyle=(0, (1, 2)))
    if not has_numbers(series.heading_change):
        return
    for mark in manoeuvre.marks:
        if mark.time_secs == 0 or not series.time_secs[0] < mark.time_secs < series.time_secs[-1]:
            continue  # the execute has its own line
        angle = degrees(np.interp(mark.time_secs, series.time_secs, series.heading_change))
        up = angle >= 0
        axes.plot(mark.time_secs, angle, marker="o", markersize=3, color=HEADING_LINE)
        axes.annotate(
            mark.label, (mark.time_secs, angle), xytext=(0, 5 if up else -5),
            textcoords="offset points", ha="center", va="bottom" if up else "top", fontsize=7.5,
        )  # fmt: skip
    axes.margins(y=0.12)


def _yaw_rate_panel(axes: Axes, series: ManoeuvreSeries) -> None:
    axes.plot(series.time_secs, np.degrees(series.yaw_rate), color=RATE_LINE)
    axes.set_ylabel("yaw rate [°/s]")


def _speed_panel(axes: Axes, series: ManoeuvreSeries) -> None:
    axes.plot(series.time_secs, series.speed / KNOT, color=SPEED_LINE, label="speed")
    axes.set_ylabel("speed [kn]")
    axes.set_ylim(bottom=min(0.0, float(np.nanmin(series.speed)) / KNOT))
    if not has_numbers(series.rpm):
        return
    rpm_axes = axes.twinx()
    rpm_axes.plot(
        series.time_secs, series.rpm, color=RPM_LINE, linestyle=(0, (3, 2)), label="revolutions"
    )
    rpm_axes.set_ylim(bottom=min(0.0, float(np.nanmin(series.rpm))))
    rpm_axes.set_ylabel("rpm")
    rpm_axes.grid(visible=False)
    rpm_axes.spines["right"].set_visible(True)
    axes.legend(
        handles=[*axes.lines, *rpm_axes.lines], loc="lower left", bbox_to_anchor=(0.0, 0.0), ncols=2
    )


def _drift_panel(axes: Axes, series: ManoeuvreSeries) -> None:
    axes.plot(series.time_secs, np.degrees(series.drift), color=DRIFT_LINE)
    axes.set_ylabel("drift angle [°]")


def _history_text(manoeuvre: SailedManoeuvre) -> str:
    """Describe the time histories for those who cannot see them."""
    series = manoeuvre.series
    parts = [f"From {series.time_secs[0]:.0f} to {series.time_secs[-1]:.0f} s from the execute."]
    for name, values, factor, unit in (
        ("Rudder", series.rudder, degrees(1), "degrees"),
        ("Change of heading", series.heading_change, degrees(1), "degrees"),
        ("Yaw rate", series.yaw_rate, degrees(1), "degrees per second"),
        ("Speed", series.speed, 1 / KNOT, "knots"),
        ("Drift angle", series.drift, degrees(1), "degrees"),
        ("Revolutions", series.rpm, 1.0, "per minute"),
    ):
        if has_numbers(values):
            low, high = np.nanmin(values) * factor, np.nanmax(values) * factor
            parts.append(f"{name} from {low:.3g} to {high:.3g} {unit}.")
    return " ".join(parts)
