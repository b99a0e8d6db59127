"""Panels of what is drawn: which series share an axis, its title and its limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10

import numpy as np

from analysis.disturbance.observer import DISTURBANCE_UNITS
from analysis.regression.changes import Change
from analysis.regression.coefficients import Coefficient
from analysis.replay.replay import Findings
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE

from .series import (
    BAND_STDS,
    BLUE,
    GREY,
    ORANGE,
    RED,
    Colour,
    Line,
    Series,
    banded,
)

Drawn = Mapping[str, Series]  # by entity, as `drawing.Sketch` has them


@dataclass(frozen=True, eq=False)
class Panel:
    """Series under one title; they share an axis."""

    name: str
    title: str
    series: tuple[Series, ...]
    limits: tuple[float, float]


def equation_panels(findings: Findings, drawn: Drawn) -> tuple[list[Panel], list[Panel]]:
    """The courses over time, of yaw and of surge: row by row they belong side by side."""
    yaw, surge = (
        [
            _output(drawn, output),
            _input(drawn, given),
            _disturbance(findings, drawn, disturbed),
            _residual(findings, drawn, output),
        ]
        for output, given, disturbed in zip(
            PAPER_OUTPUTS, PAPER_INPUTS, ("yaw", "surge"), strict=True
        )
    )
    return yaw, surge


def history_panels(findings: Findings, drawn: Drawn) -> list[Panel]:
    """The history of each coefficient that any window could tell, beside the model's value."""
    model = findings.plan.vessel.paper_coefficients._asdict()
    panels = [
        _coefficient(findings, drawn, name, coefficient, model[name], colour)
        for found, colour in ((findings.yaw, BLUE), (findings.surge, ORANGE))
        for name, coefficient in found.coefficients.items()
    ]
    return [panel for panel in panels if panel is not None]


def _output(drawn: Drawn, name: str) -> Panel:
    measured, state = drawn[f"{name}/measured"], drawn[f"{name}/state"]
    title = f"{_words(name)} [{CATALOGUE[name].display_unit}]"
    axis = limits(measured.lines[0].values, state.lines[-1].values)
    waves = _if_drawn(drawn, f"{name}/wave")
    return Panel(name, title, (measured, state, *waves), axis)


def _if_drawn(drawn: Drawn, entity: str) -> tuple[Series, ...]:
    """A series that is there only if it was asked for."""
    return (drawn[entity],) if entity in drawn else ()


def _input(drawn: Drawn, name: str) -> Panel:
    measured, unit = drawn[f"{name}/measured"], CATALOGUE[name].display_unit
    title = name if name == unit else f"{name} [{unit}]"
    return Panel(name, title, (measured,), limits(measured.lines[0].values))


def _disturbance(findings: Findings, drawn: Drawn, name: str) -> Panel:
    observed, course = drawn[f"disturbance_{name}/observed"], findings.disturbances[name]
    _, unit, scale = DISTURBANCE_UNITS[name]
    values = observed.lines[0].values
    settled = observed.time_secs >= course.settling_secs
    kept = values[settled] if settled.mean() > 0.5 else values
    noise, waves = BAND_STDS * course.std * scale, _if_drawn(drawn, f"disturbance_{name}/harmonic")
    return Panel(
        f"disturbance_{name}",
        f"{name} disturbance [{unit}]",
        (_guides(findings, "±2σ of sensor noise", noise), observed, *waves),
        limits(kept, np.array([-1.5, 1.5]) * noise, *(w.lines[0].values for w in waves)),
    )


def _residual(findings: Findings, drawn: Drawn, name: str) -> Panel:
    normalised = drawn[f"residual_{name}/normalised"]
    return Panel(
        f"residual_{name}",
        f"{_words(name)} residual [expected std]",
        (normalised, _guides(findings, "±2", BAND_STDS, "over")),
        limits(normalised.lines[0].values, np.array([-2.0, 2.0]) * BAND_STDS),
    )


def _coefficient(
    findings: Findings, drawn: Drawn, name: str, whole: Coefficient, model: float, colour: Colour
) -> Panel | None:
    windows, span = drawn[f"coefficient_{name}/window"], _ends(findings)
    at, value, std = windows.time_secs, *(line.values for line in windows.lines)
    known = np.isfinite(value)
    if not known.any():
        return None
    size = max(abs(model), float(np.median(np.abs(value[known]))))
    prefix, scale = thousands(size)
    value, spread = value * scale, BAND_STDS * std * scale
    result, doubt = whole.value * scale, BAND_STDS * whole.std * scale
    changes = [change for change in findings.changes if change.name == name]
    steps = [_levels(changes, scale)] if changes else []
    axis = _coefficient_limits(value[known], spread[known], result, doubt, model * scale)
    axis = limits(np.array(axis), *(line.values for step in steps for line in step.lines))
    # a window less sure than the panel is high says nothing and would be a vertical stroke
    value = np.where(spread > axis[1] - axis[0], np.nan, value)
    if len(at) == 1:  # a point has no length: the one window is the whole trial
        at, value, spread = span, np.repeat(value, 2), np.repeat(spread, 2)
    reference = Line("model", np.full(2, model * scale), GREY, 1.5)
    series = (
        Series("model", span, (reference,)),
        Series("window", at, banded("window", value, spread, colour)),
        *steps,
    )
    said = rounded(result, doubt) if whole.determined else "not determined"
    if changes:  # the whole trial's is a mixture
        said = ", ".join(f"{c.before * scale:.4g} → {c.after * scale:.4g}" for c in changes)
    title = f"{name} {said} [{prefix}{whole.unit}]"
    return Panel(f"coefficient_{name}", title, series, axis)


def _levels(changes: Sequence[Change], scale: float) -> Series:
    """What a coefficient was before and after each of its changes: they meet at its instant."""
    instants = np.unique([(c.from_secs, c.at_secs, c.until_secs) for c in changes])
    lines = []
    for c in changes:
        spans = (c.from_secs, c.at_secs, c.before), (c.at_secs, c.until_secs, c.after)
        for first, last, level in spans:
            there = (instants >= first) & (instants <= last)
            lines.append(Line("level", np.where(there, level * scale, np.nan), RED, 2.5))
    return Series("with a step", instants, tuple(lines))


def _coefficient_limits(
    value: FloatArray, spread: FloatArray, result: float, doubt: float, model: float
) -> tuple[float, float]:
    """An axis about the whole trial's result, made for the surer half of the windows."""
    surer = ~(spread > np.nanmedian(spread)) if np.isfinite(spread).any() else np.isfinite(value)
    centre = result if np.isfinite(result) else float(np.median(value[surer]))
    reach = 2 * float(np.median(np.abs(value[surer] - centre)))
    reach = np.nanmax([reach + np.nanmax([np.median(spread[surer]), 0.0]), 2 * doubt])
    marks = [centre - reach, centre + reach]
    if abs(model - centre) < 10 * reach:
        marks.append(model)
    return limits(np.array(marks))


def _guides(findings: Findings, name: str, bound: float, series: str = "bounds") -> Series:
    lines = (Line(name, np.full(2, sign * bound), GREY) for sign in (1, -1))
    return Series(series, _ends(findings), tuple(lines))


def _ends(findings: Findings) -> FloatArray:
    clock = findings.plan.clock
    return np.array([0.0, (clock.count - 1) * clock.dt_secs])


def _words(name: str) -> str:
    return name.replace("_", " ")


def thousands(size: float) -> tuple[str, float]:
    """A power of a thousand for a unit, in words, and the factor that brings `size` near 1."""
    exponent = 3 * floor(log10(size) / 3) if 0 < size < np.inf else 0
    digits = str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return (f"10{digits} " if exponent else ""), 10.0**-exponent


def rounded(value: float, doubt: float) -> str:
    """A result to two digits of its doubt."""
    if not (np.isfinite(value) and 0 < doubt < np.inf):
        return "not determined"
    digits = min(max(1 - floor(log10(doubt)), 0), 9)
    return f"{value:.{digits}f} ± {doubt:.{digits}f}"


def limits(*courses: FloatArray) -> tuple[float, float]:
    """An axis for courses of any shape, on which a few wild values do not squeeze the rest."""
    values = np.concatenate([course[np.isfinite(course)] for course in courses])
    if not len(values):
        return -1.0, 1.0
    low, high = np.quantile(values, (0.01, 0.99))
    reach = (high - low) / 2
    low, high = max(values.min(), low - reach), min(values.max(), high + reach)
    pad = max(0.03 * (high - low), 0.01 * max(abs(low), abs(high)), 1e-9)
    return float(low - pad), float(high + pad)
