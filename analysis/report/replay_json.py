"""What a replay found, as plain numbers: the summary in JSON."""

from dataclasses import asdict
from datetime import UTC, datetime
from math import isfinite
from typing import Any

import numpy as np

from analysis.disturbance.observer import DisturbanceSummary
from analysis.filters.wave_fit import Wave
from analysis.regression.changes import Change
from analysis.regression.coefficients import CoefficientFit
from analysis.replay.replay import Findings
from shiplog import __version__
from shiplog.checks.channel_stats import ChannelStats
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.vessel.settings import settings_dict

Summary = dict[str, Any]


def replay_json(findings: Findings) -> Summary:
    """The summary as plain numbers in SI, ready for JSON; what is not a number is None."""
    log_stats, clock = findings.plan.log_stats, findings.plan.clock
    start_ns, _ = log_stats.span_ns
    summary = {
        "shiplog": __version__,
        "log": {
            "name": findings.plan.name,
            "start": datetime.fromtimestamp(start_ns * 1e-9, UTC).isoformat(),
            "duration_secs": log_stats.duration_secs,
            "dt_secs": clock.dt_secs,
            "samples": clock.count,
            "provenance": findings.metadata,
            "channels": {channel.topic: _channel(channel) for channel in log_stats},
        },
        "model": {
            "name": findings.plan.vessel.name,
            "origin": findings.plan.model_origin,
            "coefficients": {
                name: {"value": value, "unit": COEFFICIENT_UNITS[name]}
                for name, value in findings.plan.vessel.paper_coefficients._asdict().items()
            },
        },
        "filter": {
            residuals.name: _residuals(findings, i)
            for i, residuals in enumerate(findings.residuals)
        },
        "settings": _settings(findings),
        "wave": _wave(findings.plan.noise.wave),
        "disturbance": _disturbance(findings),
        "coefficients": _coefficients(findings.yaw) | _coefficients(findings.surge),
        "changes": [_change(change) for change in findings.changes],
        "windows": {"yaw": _windows(findings.yaw), "surge": _windows(findings.surge)},
        "track": findings.track_origin,
        "warnings": list(findings.warnings),
    }
    return _without_nan(summary)  # type: ignore[no-any-return]


def _channel(channel: ChannelStats) -> Summary:
    return {
        "unit": channel.unit,
        "samples": channel.samples,
        "rate_hz": 1 / channel.interval_secs if channel.interval_secs else None,
        "gaps": len(channel.gaps),
        "longest_gap_secs": max((length for _, length in channel.gaps), default=0.0),
    }


def _residuals(findings: Findings, output: int) -> Summary:
    residuals, noise = findings.residuals[output], findings.plan.noise
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
        "process_ratio_origin": (
            "likeliest for the log" if noise.tuned[output] else "the vessel file"
        ),
        "gated": residuals.gated,
    }


def _settings(findings: Findings) -> Summary:
    filtering = settings_dict(findings.plan.vessel.filter) | {
        "kind": findings.plan.vessel.filter.chosen
    }
    return {
        "filter": filtering,
        "disturbance": settings_dict(findings.plan.disturbance_settings),
        "identifier": settings_dict(findings.plan.vessel.identifier),
    }


def _wave(wave: Wave | None) -> Summary | None:
    """The wave told from the turning: of none, None."""
    if wave is None:
        return None
    return {
        "frequency_rad_per_s": wave.frequency,
        "damping": wave.damping,
        "std_rad_per_s": wave.std,
        "evidence": wave.evidence,
        "evidence_needed": wave.needed,
        "contrast": wave.contrast,
    }


def _disturbance(findings: Findings) -> Summary:
    keys = {"rudder": "yaw_as_rudder"}
    return {keys.get(name, name): _course(course) for name, course in findings.disturbances.items()}


def _course(course: DisturbanceSummary) -> Summary:
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


def _coefficients(found: CoefficientFit) -> Summary:
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


def _change(change: Change) -> Summary:
    return asdict(change) | {"instead": list(change.instead)}


def _windows(found: CoefficientFit) -> Summary:
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
