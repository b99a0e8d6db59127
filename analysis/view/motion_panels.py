"""Panels of a ship's motion over time, measured and computed: steering, outputs, revolutions."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.types import FloatArray

from .decimation import decimated
from .panels import Panel, limits, review_unit, title_of, varies, with_range
from .series import BLUE, GREEN, GREY, Line, Series, measured_line
from .steering_panels import MEASURED_WIDTH, WIDTH, heading_series, rudder_series, steering_panels

OUTPUTS = ("yaw_rate", "speed", "sway")  # that have a panel each


@dataclass(frozen=True, eq=False)
class MotionHistory:
    """The motion of a ship over time, measured and computed, SI.

    Attributes
    ----------
    time_secs
        (n,) s since the start of the signals.
    rudder
        (n,) rad.
    rpm
        (n,) revolutions per minute.
    measured
        (n,) each, by the name of the channel: ``heading``, ``yaw_rate``, ``speed``, and ``sway``
        if it may be measured; NaN where it is not.
    computed
        The same, simulated or estimated.
    computed_name
        What it is, in a word.
    """

    time_secs: FloatArray
    rudder: FloatArray
    rpm: FloatArray
    measured: Mapping[str, FloatArray]
    computed: Mapping[str, FloatArray] = field(default_factory=dict)
    computed_name: str = "simulated"

    def part(self, start_secs: float, end_secs: float) -> "MotionHistory":
        """Return the stretch between two instants, both included."""
        cut = (self.time_secs >= start_secs) & (self.time_secs <= end_secs)
        measured, computed = (
            {name: values[cut] for name, values in each.items()}
            for each in (self.measured, self.computed)
        )
        return replace(
            self, time_secs=self.time_secs[cut], rudder=self.rudder[cut], rpm=self.rpm[cut],
            measured=measured, computed=computed,
        )  # fmt: skip


def motion_panels(
    origin: str, history: MotionHistory, reference: float | None = None
) -> list[Panel]:
    """Return the panels of heading with rudder, outputs, and rpm where they vary, as known.

    Parameters
    ----------
    origin
        The beginning of the paths of their entities.
    history
        The motion.
    reference
        The heading from which headings are drawn, rad; None draws them from north.
    """
    at = history.time_secs
    headings: list[Series] = []
    if np.isfinite(history.measured["heading"]).any():
        degrees = [
            np.degrees(values["heading"] - (reference or 0.0))
            for values in (history.measured, history.computed)
            if "heading" in values
        ]
        headings = [_drawn(each) for each in heading_series(at, *degrees)]
    rudder = _drawn(rudder_series(at, np.degrees(history.rudder)))
    counted = "" if reference is None else f"{round(np.degrees(reference), 1) % 360:.1f}°"
    panels = steering_panels(f"{origin}/steering", rudder, headings, counted)
    outputs = [_output_panel(origin, history, name) for name in OUTPUTS if name in history.measured]
    known = [panel for panel in outputs if panel is not None]
    # the first legend serves all
    panels += [replace(panel, legend=panel.legend and panel is known[0]) for panel in known]
    if varies(history.rpm):
        line = Line("rpm", history.rpm, GREEN, WIDTH)
        rpm = _drawn(Series("rpm", at, (line,), spiky=True))
        title = with_range("rpm", history.rpm)
        panels.append(Panel(f"{origin}/rpm", title, (rpm,), limits(history.rpm)))
    return panels


def _output_panel(origin: str, history: MotionHistory, name: str) -> Panel | None:
    """Return the panel of an output, measured and computed; None where neither is known."""
    unit, factor = review_unit(name)
    lines = [Line("measured", history.measured[name] * factor, GREY, MEASURED_WIDTH)]
    if name in history.computed:
        values = history.computed[name] * factor
        lines.append(Line(history.computed_name, values, BLUE, WIDTH))
    lines = [line for line in lines if np.isfinite(line.values).any()]
    if not lines:
        return None
    if len(lines) == 1:
        lines = [replace(lines[0], colour=BLUE, width=WIDTH)]
    drawn = [  # the last one on top, by the alphabet
        _drawn(Series(f"{i}_{line.name}", history.time_secs, (line,), spiky=not i))
        for i, line in enumerate(lines)
    ]
    return Panel(
        f"{origin}/{name}",
        with_range(title_of(name, unit), lines[0].values),
        tuple(drawn),
        limits(*(line.values for line in lines)),
        legend=len(lines) > 1,
    )


def _drawn(series: Series) -> Series:
    """Return a series as it is drawn: its samples joined, with one NaN in each gap."""
    (line,) = series.lines
    at = series.time_secs
    if len(at) > 1 and not np.isfinite(line.values).all():
        times, values = measured_line(line.values, float(at[1] - at[0]))
        series = replace(series, time_secs=at[0] + times, lines=(replace(line, values=values),))
    return decimated(series)
