"""What a replay found, in words and numbers: for JSON, for the terminal, for Rerun's page."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from math import degrees, isfinite
from typing import Any

import numpy as np

from shiplog import Channel, __version__
from shiplog.clock import gaps, usual_period_secs
from shiplog.ship import COEFFICIENT_UNITS
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, factor

from .pipeline import FITTED, Analysis
from .residuals import OutputResiduals
from .sliding import Identification

Summary = dict[str, Any]


def summarise(analysis: Analysis) -> Summary:
    """The summary as plain numbers in SI, ready for JSON; what is not a number is None."""
    log = analysis.log
    start_ns, _ = log.span_ns
    summary = {
        "shiplog": __version__,
        "log": {
            "name": log.name,
            "start": datetime.fromtimestamp(start_ns * 1e-9, UTC).isoformat(),
            "duration_secs": log.duration_secs,
            "dt_secs": analysis.signals.dt_secs,
            "samples": len(analysis.signals),
            "provenance": dict(log.metadata),
            "channels": {channel.topic: _channel(channel) for channel in log},
        },
        "model": {
            "name": analysis.vessel.name,
            "origin": analysis.model_origin,
            "coefficients": {
                name: {"value": value, "unit": COEFFICIENT_UNITS[name]}
                for name, value in analysis.vessel.coefficients._asdict().items()
            },
        },
        "filter": {
            residuals.name: _residuals(analysis, i)
            for i, residuals in enumerate(analysis.residuals)
        },
        "disturbance": _disturbance(analysis),
        "coefficients": _coefficients(analysis.yaw) | _coefficients(analysis.surge),
        "windows": {"yaw": _windows(analysis.yaw), "surge": _windows(analysis.surge)},
        "track": analysis.track.origin,
        "warnings": list(analysis.warnings),
    }
    return _without_nan(summary)  # type: ignore[no-any-return]


def _channel(channel: Channel) -> Summary:
    period = usual_period_secs(channel)
    silences = gaps(channel)
    return {
        "unit": channel.unit,
        "samples": len(channel),
        "rate_hz": 1 / period if period else None,
        "gaps": len(silences),
        "longest_gap_secs": max((length for _, length in silences), default=0.0),
    }


def _residuals(analysis: Analysis, output: int) -> Summary:
    residuals = analysis.residuals[output]
    return {
        "unit": residuals.unit,
        "innovations": residuals.count,
        "innovation_rms": residuals.rms,
        "normalised_innovation_squared": residuals.normalised_squared,
        "expected": list(residuals.expected),
        "whiteness_p": residuals.whiteness_p,
        "white": residuals.white,
        "measurement_std": float(analysis.noise.measurement_std[output]),
        "measurement_std_origin": "the log"
        if analysis.noise.measured[output]
        else "the vessel file",
        "process_ratio": float(analysis.noise.process_ratio[output]),
        "process_ratio_origin": (
            "likeliest for the log" if analysis.noise.tuned else "the vessel file"
        ),
    }


def _disturbance(analysis: Analysis) -> Summary:
    found, dt = analysis.disturbance, analysis.signals.dt_secs
    yaw, surge = found.yaw_settling_secs, found.surge_settling_secs
    return {
        "yaw": _course(found.yaw, found.yaw_std, "rad/s³", yaw, dt),
        "yaw_as_rudder": _course(found.rudder, found.rudder_std, "rad", yaw, dt),
        "surge": _course(found.surge, found.surge_std, "m/s²", surge, dt),
    }


def _course(values: FloatArray, std: float, unit: str, settling_secs: float, dt: float) -> Summary:
    """A disturbance over the trial, its first transient left out; `last` is a mean at the end."""
    settling = int(settling_secs / dt)
    values = np.where(np.isfinite(values), values, np.nan)
    settled = values[settling:] if len(values) > 2 * settling else values
    if np.isnan(settled).all():
        return dict.fromkeys(("mean", "rms", "lowest", "highest", "last")) | {
            "sensor_noise_std": std, "settling_secs": settling_secs, "unit": unit
        }  # fmt: skip
    return {
        "mean": float(np.nanmean(settled)),
        "rms": float(np.sqrt(np.nanmean(settled**2))),
        "lowest": float(np.nanmin(settled)),
        "highest": float(np.nanmax(settled)),
        "last": float(np.nanmean(values[-max(settling, 1) :])),
        "sensor_noise_std": std,
        "settling_secs": settling_secs,
        "unit": unit,
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
    conditions = found.history.conditions
    known = conditions[np.isfinite(conditions)]
    return {
        "count": len(conditions),
        "blank": int(np.isnan(found.history.values).all(axis=1).sum()),
        "condition_median": float(np.median(known)) if len(known) else None,
        "condition_worst": float(np.max(known)) if len(known) else None,
        "conditions": conditions.tolist(),
        "time_secs": found.history.time_secs.tolist(),
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


def sections(analysis: Analysis) -> tuple[Section, ...]:
    """The summary as tables, in the units people use, and its verdicts in words."""
    return (
        _log_section(analysis),
        _filter_section(analysis),
        _disturbance_section(analysis),
        _coefficient_section(analysis),
    )


def markdown(analysis: Analysis) -> str:
    """The summary as a page of text."""
    blocks = [f"# {analysis.log.name}"]
    log, *found = sections(analysis)
    for section in (*found, log):  # what was found first: a page is read from its top
        blocks += [f"## {section.title}", _markdown_table(section.columns, section.rows)]
        blocks += [f"*{remark}*" for remark in section.remarks]
    if analysis.warnings:
        blocks += ["## Warnings", "\n".join(f"- {warning}" for warning in analysis.warnings)]
    return "\n\n".join(blocks) + "\n"


def _markdown_table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    columns = [column or " " for column in columns]
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _log_section(analysis: Analysis) -> Section:
    log, rows = analysis.log, []
    for channel in log:
        said = _channel(channel)
        rate = f"{said['rate_hz']:.3g} Hz" if said["rate_hz"] else ""
        gaps_said = "none"
        if said["gaps"]:
            gaps_said = f"{said['gaps']}, the longest {said['longest_gap_secs']:.1f} s"
        rows.append((channel.topic, f"{len(channel)}", rate, gaps_said))
    start = np.datetime64(log.span_ns[0], "ns").astype("M8[s]")
    title = f"Log, {log.duration_secs:.0f} s from {start} UTC"
    return Section(title, ("channel", "samples", "rate", "gaps"), tuple(rows))


def _filter_section(analysis: Analysis) -> Section:
    fitted = analysis.model_origin == FITTED
    model = FITTED if fitted else f"{analysis.vessel.name} ({analysis.model_origin})"
    rows, remarks = [], [f"Model: {model}."]
    for residuals in analysis.residuals:
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


def _disturbance_section(analysis: Analysis) -> Section:
    found = _disturbance(analysis)
    rows = []
    for label, key, scale, unit in (
        ("yaw, as rudder", "yaw_as_rudder", degrees(1), "deg"),
        ("yaw", "yaw", degrees(1) * 1e3, "0.001 deg/s³"),
        ("surge", "surge", 1e3, "mm/s²"),
    ):
        course = found[key]
        values = [course[k] for k in ("mean", "rms", "last", "sensor_noise_std")]
        rows.append(
            (f"{label} [{unit}]", *("" if v is None else f"{v * scale:.3g}" for v in values))
        )
    columns = ("disturbance", "mean", "rms", "at the end", "std by noise")
    caution = (
        "As rudder: the angle that would do the same at the speed then. "
        "The std is by sensor noise alone; an error of the model counts as a disturbance."
    )
    remarks = [caution]
    if analysis.model_origin == FITTED:
        remarks.append("The model was fitted to this log: this is what it leaves unexplained.")
    return Section("Disturbance observed", columns, tuple(rows), tuple(remarks))


def _coefficient_section(analysis: Analysis) -> Section:
    model, rows = analysis.vessel.coefficients._asdict(), []
    for found in (analysis.yaw, analysis.surge):
        for name, coefficient in found.coefficients.items():
            value, std = f"{coefficient.value:.4g}", f"{coefficient.std:.2g}"
            if not coefficient.determined:
                value, std = "not determined", f"{coefficient.std:.2g}" if std != "nan" else ""
            rows.append((name, value, std, coefficient.unit, f"{model[name]:.4g}"))
    if analysis.model_origin == FITTED:  # beside itself it would only seem confirmed
        rows = [(*row[:-1], "") for row in rows]
    remark = (
        f"Condition of the scaled regressors: yaw {analysis.yaw.condition:.0f}, "
        f"surge {analysis.surge.condition:.0f}. "
        "Not determined: the log cannot tell it from the others, or not even its sign. "
        "Two standard deviations are about a 95 % interval, less where a few seconds tell all. "
        "A gyro's bias goes into b1, b2, b3 and e."
    )
    columns = ("coefficient", "from this log", "std", "unit", "in the model")
    return Section("Coefficients", columns, tuple(rows), (remark,))
