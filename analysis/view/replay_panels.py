"""The panels of a replay's review: motion, disturbances, residuals, coefficients."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from analysis.regression.changes import Change
from analysis.regression.coefficients import Coefficient
from analysis.replay.replay_results import Findings
from analysis.report.display import BAND_STDS, DISTURBANCES
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.types import FloatArray

from .panels import (
    Panel,
    limits,
    review_unit,
    rounded,
    thousands,
    title_of,
    varies,
    with_bounds,
    with_range,
    words,
)
from .series import BLUE, GREY, RED, Line, Series, banded
from .series_builder import STEERING
from .steering_panels import steering_panels

Drawn = Mapping[str, Series]  # by entity, as `SeriesBuilder.result` returns them
MAX_MODEL_DISTANCE = 10.0  # in half-heights of an axis: up to here it includes the model's value


def trial_panels(drawn: Drawn) -> list[Panel]:
    """Return the panels of heading with rudder, yaw rate, speed, and of rpm where they vary."""
    headings = [drawn[each] for each in (f"{STEERING}/heading/measured",) if each in drawn]
    first = ""
    if "heading" in drawn and len(drawn["heading"].time_secs):
        degrees = np.degrees(drawn["heading"].lines[0].values[0])
        first = f"{round(degrees, 1) % 360:.1f}°"
    panels = steering_panels(STEERING, drawn[f"{STEERING}/rudder/measured"], headings, first)
    yaw_rate, speed = (_output(drawn, output) for output in PAPER_OUTPUTS)
    rpm = drawn["rpm/measured"]
    values = rpm.lines[0].values
    if varies(values):
        title = with_range("rpm", values)
        return [*panels, yaw_rate, speed, Panel("rpm", title, (rpm,), limits(values))]
    if np.isfinite(values).any():
        speed = replace(speed, title=f"{speed.title}; at {np.nanmedian(values):.4g} rpm")
    return [*panels, yaw_rate, speed]


def equation_panels(findings: Findings, drawn: Drawn) -> tuple[list[Panel], list[Panel]]:
    """Return disturbance and innovation of yaw and of surge; each row belongs side by side."""
    yaw, surge = (
        [_disturbance(findings, drawn, disturbance), _innovation(findings, drawn, output)]
        for output, disturbance in zip(PAPER_OUTPUTS, ("yaw", "surge"), strict=True)
    )
    return yaw, surge


def history_panels(findings: Findings, drawn: Drawn) -> list[Panel]:
    """Return the history of each coefficient that any window determines, with the model's value."""
    model = findings.plan.vessel.paper_coefficients._asdict()
    panels = [
        _history(findings, drawn, name, coefficient, model[name])
        for fit in (findings.yaw, findings.surge)
        for name, coefficient in fit.coefficients.items()
    ]
    known = [panel for panel in panels if panel is not None]
    return [replace(panel, legend=panel is known[0]) for panel in known]  # it serves all


def _output(drawn: Drawn, name: str) -> Panel:
    measured, state = drawn[f"{name}/measured"], drawn[f"{name}/state"]
    estimate = state.lines[-1].values
    title = with_range(title_of(name, review_unit(name)[0]), estimate)
    axis = limits(measured.lines[0].values, estimate)
    series = (measured, state, *_optional(drawn, f"{name}/wave"))
    return Panel(name, title, series, axis, legend=True)


def _optional(drawn: Drawn, entity: str) -> tuple[Series, ...]:
    """Return a series that exists only where it was asked for."""
    return (drawn[entity],) if entity in drawn else ()


def _disturbance(findings: Findings, drawn: Drawn, name: str) -> Panel:
    """Draw a disturbance on an axis that leaves out the observer's own transient."""
    estimate, summary = drawn[f"disturbance_{name}/estimate"], findings.disturbances[name]
    _, unit, scale = DISTURBANCES[name]
    values = estimate.lines[-1].values
    settled = estimate.time_secs >= summary.settling_secs
    kept = values[settled] if settled.mean() > 0.5 else values
    noise = BAND_STDS * summary.noise_std * scale
    series = (
        estimate,
        *_optional(drawn, f"disturbance_{name}/wave"),
        *_optional(drawn, f"disturbance_{name}/wind"),
    )
    if len(estimate.lines) == 1:  # a state of the filter has a band of its own
        series = (_guides(findings, "±2σ of sensor noise", noise, "bounds"), *series)
        axis = [kept, np.array([-1.5, 1.5]) * noise]
    else:
        axis = [line.values for line in estimate.lines]
    waves = [each.lines[0].values for each in series if each.name in ("wave", "wind")]
    title = f"{name} disturbance [{unit}]"
    return Panel(f"disturbance_{name}", title, series, limits(*axis, *waves), legend=True)


def _innovation(findings: Findings, drawn: Drawn, name: str) -> Panel:
    normalised = drawn[f"innovation_{name}/normalised"]
    return Panel(
        f"innovation_{name}",
        f"{words(name)} innovation / expected σ",
        (normalised, _guides(findings, "±2σ", BAND_STDS, "sigma_limits")),
        with_bounds(limits(normalised.lines[0].values), BAND_STDS),
        legend=True,
    )


def _history(
    findings: Findings, drawn: Drawn, name: str, whole: Coefficient, model: float
) -> Panel | None:
    """Draw a coefficient's windows, its model value and its changes; None if nothing is known.

    `whole` is its value over the whole trial, `model` that of the model, both in SI.
    """
    windows, span = drawn[f"coefficient_{name}/per_window"], _span(findings)
    at, value, std = windows.time_secs, *(line.values for line in windows.lines)
    known = np.isfinite(value)
    if not known.any():
        return None
    size = max(abs(model), float(np.median(np.abs(value[known]))))
    prefix, scale = thousands(size)
    value, half_width = value * scale, BAND_STDS * std * scale
    result, result_half_width = whole.value * scale, BAND_STDS * whole.std * scale
    changes = [change for change in findings.changes if change.name == name]
    steps = [_steps(changes, scale)] if changes else []
    axis = _history_limits(
        value[known], half_width[known], result, result_half_width, model * scale
    )
    axis = limits(np.array(axis), *(line.values for step in steps for line in step.lines))
    # a window whose interval is higher than the panel would only be a vertical stroke
    value = np.where(half_width > axis[1] - axis[0], np.nan, value)
    if len(at) == 1:  # a point has no length: the one window is the whole trial
        at, value, half_width = span, np.repeat(value, 2), np.repeat(half_width, 2)
    reference = Line("model", np.full(2, model * scale), GREY, 1.5)
    series = (
        Series("model", span, (reference,)),
        Series("per_window", at, banded("sliding window", value, half_width, BLUE)),
        *steps,
    )
    text = rounded(result, result_half_width) if whole.determined else "not determined"
    if changes:  # the whole trial's is a mixture
        text = ", ".join(f"{c.before * scale:.4g} → {c.after * scale:.4g}" for c in changes)
    title = f"{name} = {text} [{prefix}{whole.unit}]"
    return Panel(f"coefficient_{name}", title, series, axis)


def _steps(changes: Sequence[Change], scale: float) -> Series:
    """Draw a coefficient's values before and after each of its changes; they meet at its time."""
    times = np.unique([(c.from_secs, c.at_secs, c.until_secs) for c in changes])
    lines = []
    for c in changes:
        spans = (c.from_secs, c.at_secs, c.before), (c.at_secs, c.until_secs, c.after)
        for first, last, value in spans:
            inside = (times >= first) & (times <= last)
            lines.append(Line("change", np.where(inside, value * scale, np.nan), RED, 2.5))
    return Series("steps", times, tuple(lines))


def _history_limits(
    value: FloatArray,
    half_width: FloatArray,
    result: float,
    result_half_width: float,
    model: float,
) -> tuple[float, float]:
    """Return an axis about the whole trial's result, for the more certain half of the windows."""
    certain = np.isfinite(value)
    if np.isfinite(half_width).any():
        certain = ~(half_width > np.nanmedian(half_width))
    centre = result if np.isfinite(result) else float(np.median(value[certain]))
    reach = 2 * float(np.median(np.abs(value[certain] - centre)))
    spread = np.nanmax([np.median(half_width[certain]), 0.0])
    reach = np.nanmax([reach + spread, 2 * result_half_width])
    marks = [centre - reach, centre + reach]
    if abs(model - centre) < MAX_MODEL_DISTANCE * reach:
        marks.append(model)
    return limits(np.array(marks))


def _guides(findings: Findings, name: str, bound: float, series: str) -> Series:
    """Draw horizontal lines at plus and minus `bound`."""
    lines = (Line(name, np.full(2, sign * bound), GREY) for sign in (1, -1))
    return Series(series, _span(findings), tuple(lines))


def _span(findings: Findings) -> FloatArray:
    """Return the start and the end of the clock, s."""
    clock = findings.plan.clock
    return np.array([0.0, (clock.count - 1) * clock.dt_secs])
