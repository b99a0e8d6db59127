"""What a replay found, in words and numbers: for JSON, for the terminal, for Rerun's page."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite
from typing import Any

import numpy as np

from shiplog import __version__
from shiplog.ship import COEFFICIENT_UNITS
from shiplog.survey import ChannelSurvey
from shiplog.units import CATALOGUE, factor

from .disturbance import DISTURBANCE_UNITS, Course
from .identification import Identification
from .pipeline import FITTED, Findings
from .residuals import OutputResiduals

Summary = dict[str, Any]


def summarise(findings: Findings) -> Summary:
    """The summary as plain numbers in SI, ready for JSON; what is not a number is None."""
    survey, clock = findings.survey, findings.clock
    start_ns, _ = survey.span_ns
    summary = {
        "shiplog": __version__,
        "log": {
            "name": findings.name,
            "start": datetime.fromtimestamp(start_ns * 1e-9, UTC).isoformat(),
            "duration_secs": survey.duration_secs,
            "dt_secs": clock.dt_secs,
            "samples": clock.count,
            "provenance": findings.metadata,
            "channels": {channel.topic: _channel(channel) for channel in survey},
        },
        "model": {
            "name": findings.vessel.name,
            "origin": findings.model_origin,
            "coefficients": {
                name: {"value": value, "unit": COEFFICIENT_UNITS[name]}
                for name, value in findings.vessel.coefficients._asdict().items()
            },
        },
        "filter": {
            residuals.name: _residuals(findings, i)
            for i, residuals in enumerate(findings.residuals)
        },
        "disturbance": _disturbance(findings),
        "coefficients": _coefficients(findings.yaw) | _coefficients(findings.surge),
        "windows": {"yaw": _windows(findings.yaw), "surge": _windows(findings.surge)},
        "track": findings.track_origin,
        "warnings": list(findings.warnings),
    }
    return _without_nan(summary)  # type: ignore[no-any-return]


def _channel(channel: ChannelSurvey) -> Summary:
    return {
        "unit": channel.unit,
        "samples": channel.samples,
        "rate_hz": 1 / channel.usual_secs if channel.usual_secs else None,
        "gaps": len(channel.gaps),
        "longest_gap_secs": max((length for _, length in channel.gaps), default=0.0),
    }


def _residuals(findings: Findings, output: int) -> Summary:
    residuals, noise = findings.residuals[output], findings.noise
    return {
        "unit": residuals.unit,
        "innovations": residuals.count,
        "innovation_rms": residuals.rms,
        "normalised_innovation_squared": residuals.normalised_squared,
        "expected": list(residuals.expected),
        "whiteness_p": residuals.whiteness_p,
        "white": residuals.white,
        "measurement_std": float(noise.measurement_std[output]),
        "measurement_std_origin": "the log" if noise.measured[output] else "the vessel file",
        "process_ratio": float(noise.process_ratio[output]),
        "process_ratio_origin": "likeliest for the log" if noise.tuned else "the vessel file",
    }


def _disturbance(findings: Findings) -> Summary:
    names = {"yaw": "yaw", "yaw_as_rudder": "rudder", "surge": "surge"}
    return {key: _course(findings.courses[name]) for key, name in names.items()}


def _course(course: Course) -> Summary:
    return {
        "mean": course.mean,
        "rms": course.rms,
        "lowest": course.lowest,
        "highest": course.highest,
        "last": course.last,
        "sensor_noise_std": course.std,
        "settling_secs": course.settling_secs,
        "unit": course.unit,
    }


def _coefficients(found: Identification) -> Summary:
    return {
        name: {
            "value": coefficient.value,
            "std": coefficient.std,
            "unit": coefficient.unit,
            "determined": coefficient.determined,
            "condition": found.condition,
        }
        for name, coefficient in found.coefficients.items()
    }


def _windows(found: Identification) -> Summary:
    """How well the sliding windows could tell: their condition numbers, and how many are blank."""
    conditions = found.window_conditions
    known = conditions[np.isfinite(conditions)]
    return {
        "count": len(conditions),
        "blank": found.blank_windows,
        "condition_median": float(np.median(known)) if len(known) else None,
        "condition_worst": float(np.max(known)) if len(known) else None,
        "conditions": conditions.tolist(),
        "time_secs": found.window_ends_secs.tolist(),
    }


def _without_nan(value: Any) -> Any:  # noqa: ANN401 - walks a tree of JSON
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not isfinite(value) else value


@dataclass(frozen=True)
class Section:
    """A table for people."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()


def sections(findings: Findings) -> tuple[Section, ...]:
    """The summary as tables, in the units people use, and its verdicts in words."""
    return (
        _log_section(findings),
        _filter_section(findings),
        _disturbance_section(findings),
        _coefficient_section(findings),
    )


def markdown(findings: Findings) -> str:
    """The summary as a page of text."""
    blocks = [f"# {findings.name}"]
    log, *found = sections(findings)
    for section in (*found, log):  # what was found first: a page is read from its top
        blocks += [f"## {section.title}", _markdown_table(section.columns, section.rows)]
        blocks += [f"*{remark}*" for remark in section.remarks]
    if findings.warnings:
        blocks += ["## Warnings", "\n".join(f"- {warning}" for warning in findings.warnings)]
    return "\n\n".join(blocks) + "\n"


def _markdown_table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    columns = [column or " " for column in columns]
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _log_section(findings: Findings) -> Section:
    survey, rows = findings.survey, []
    for channel in survey:
        said = _channel(channel)
        rate = f"{said['rate_hz']:.3g} Hz" if said["rate_hz"] else ""
        gaps_said = "none"
        if said["gaps"]:
            gaps_said = f"{said['gaps']}, the longest {said['longest_gap_secs']:.1f} s"
        rows.append((channel.topic, f"{channel.samples}", rate, gaps_said))
    start = np.datetime64(survey.span_ns[0], "ns").astype("M8[s]")
    title = f"Log, {survey.duration_secs:.0f} s from {start} UTC"
    return Section(title, ("channel", "samples", "rate", "gaps"), tuple(rows))


def _filter_section(findings: Findings) -> Section:
    fitted = findings.model_origin == FITTED
    model = FITTED if fitted else f"{findings.vessel.name} ({findings.model_origin})"
    rows, remarks = [], [f"Model: {model}."]
    for residuals in findings.residuals:
        unit = CATALOGUE[residuals.name].display_unit
        rms = residuals.rms * factor(residuals.unit, unit)
        rows.append(
            (
                f"{residuals.name} [{unit}]",
                f"{rms:.3g}",
                f"{residuals.normalised_squared:.4g}",
                f"{residuals.whiteness_p:.2g}",
            )
        )
        remarks.append(_verdict(residuals))
    columns = ("output", "innovation rms", "normalised, squared (1)", "whiteness p")
    return Section("Filter", columns, tuple(rows), tuple(remarks))


def _verdict(residuals: OutputResiduals) -> str:
    size = ""
    if not residuals.consistent:
        larger = residuals.normalised_squared > residuals.expected[1]
        size = f"; they are {'larger' if larger else 'smaller'} than the noise assumed"
    if residuals.white is None:
        return f"{residuals.name}: the innovations cannot be told to be white or not{size}."
    if residuals.white:
        return f"{residuals.name}: innovations are white (test at 1 %){size}."
    return (
        f"{residuals.name}: innovations are NOT white (test at 1 %){size}: "
        "the model or the noise does not explain the data."
    )


def _disturbance_section(findings: Findings) -> Section:
    rows = []
    for name, label in (("rudder", "yaw, as rudder"), ("yaw", "yaw"), ("surge", "surge")):
        _, unit, scale = DISTURBANCE_UNITS[name]
        course = findings.courses[name]
        values = (course.mean, course.rms, course.last, course.std)
        rows.append(
            (f"{label} [{unit}]", *(f"{v * scale:.3g}" if isfinite(v) else "" for v in values))
        )
    columns = ("disturbance", "mean", "rms", "at the end", "std by noise")
    caution = (
        "As rudder: the angle that would do the same at the speed then. "
        "The std is by sensor noise alone; an error of the model counts as a disturbance."
    )
    remarks = [caution]
    if findings.model_origin == FITTED:
        remarks.append("The model was fitted to this log: this is what it leaves unexplained.")
    return Section("Disturbance observed", columns, tuple(rows), tuple(remarks))


def _coefficient_section(findings: Findings) -> Section:
    model, rows = findings.vessel.coefficients._asdict(), []
    for found in (findings.yaw, findings.surge):
        for name, coefficient in found.coefficients.items():
            value, std = f"{coefficient.value:.4g}", f"{coefficient.std:.2g}"
            if not coefficient.determined:
                value, std = "not determined", f"{coefficient.std:.2g}" if std != "nan" else ""
            rows.append((name, value, std, coefficient.unit, f"{model[name]:.4g}"))
    if findings.model_origin == FITTED:  # beside itself it would only seem confirmed
        rows = [(*row[:-1], "") for row in rows]
    remark = (
        f"Condition of the scaled regressors: yaw {findings.yaw.condition:.0f}, "
        f"surge {findings.surge.condition:.0f}. "
        "Not determined: the log cannot tell it from the others, or not even its sign. "
        "Two standard deviations are about a 95 % interval, less where a few seconds tell all. "
        "A gyro's bias goes into b1, b2, b3 and e."
    )
    remarks = [remark]
    if findings.model_origin == FITTED:
        remarks.append(
            "With no model the rudder is taken to work in proportion to the speed (α = 1, 0, 0): "
            "d and e are not to be laid beside those of a vessel whose slipstream is known."
        )
    columns = ("coefficient", "from this log", "std", "unit", "in the model")
    return Section("Coefficients", columns, tuple(rows), tuple(remarks))
