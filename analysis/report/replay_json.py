"""The results of a replay as plain numbers in SI, for JSON."""

from dataclasses import asdict
from datetime import UTC, datetime
from math import isfinite
from typing import Any

import numpy as np

from analysis.disturbance.disturbances import DisturbanceSummary
from analysis.filters.noise_model import FURTHER_OUTPUTS, FurtherModel, NoiseModel, Wave
from analysis.regression.changes import Change
from analysis.regression.coefficients import CoefficientFit
from analysis.replay.current import Current
from analysis.replay.replay_results import Findings
from analysis.replay.residuals import ResidualSummary
from analysis.replay.sensor_errors import SlowState
from shiplog import __version__
from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.event_table import events_to_json
from shiplog.ships.paper import COEFFICIENT_UNITS
from shiplog.vessel.settings import settings_dict

from .display import NORMAL_95

JsonObject = dict[str, Any]


def replay_json(findings: Findings) -> JsonObject:
    """Return the results of a replay as plain numbers, ready for JSON.

    Numbers are in SI units and radians; what is NaN or infinite is None.

    Returns
    -------
    dict
        ``log``, ``model``, ``settings``, ``residuals`` (by output: ``yaw_rate`` and ``speed``;
        ``heading``, ``north`` and ``east`` where the filter uses them), ``wave``,
        ``disturbances``, ``sensor_errors`` (by name: ``unit``, ``value``, ``std``,
        ``interval_95``, ``prior_std``, ``determined``, ``reason``), ``current`` (``north`` and
        ``east`` in m/s and ``drift_length`` in m, each with its ``std``; ``speed``,
        ``direction``, into which it flows, ``determined`` and ``reason``; None where it is not
        estimated), ``wind`` (its coefficients by name, each as in ``sensor_errors``),
        ``coefficients``, ``changes``, ``windows`` (by equation), ``track_origin``, ``warnings``,
        ``events`` and ``events_omitted``, their number beyond those listed.
    """
    plan = findings.plan
    result = {
        "shiplog": __version__,
        "log": _log(findings),
        "model": {
            "name": plan.vessel.name,
            "origin": plan.model_origin,
            "coefficients": {
                name: {"value": value, "unit": COEFFICIENT_UNITS[name]}
                for name, value in plan.vessel.paper_coefficients._asdict().items()
            },
        },
        "settings": {
            "filter": settings_dict(plan.vessel.filter) | {"kind": plan.vessel.filter.chosen},
            "disturbance": settings_dict(plan.disturbance_settings),
            "identifier": settings_dict(plan.vessel.identifier),
        },
        "residuals": {
            residuals.name: _residuals(findings, i)
            for i, residuals in enumerate(findings.residuals)
        },
        "wave": _wave(plan.noise.wave),
        "disturbances": {
            "yaw_as_rudder" if name == "rudder" else name: _disturbance(summary)
            for name, summary in findings.disturbances.items()
        },
        "absent_disturbances": _absent(plan.noise.further),
        "sensor_errors": {error.name: _slow_state(error) for error in findings.sensor_errors},
        "current": _current(findings.current),
        "wind": {term.name: _slow_state(term) for term in findings.wind},
        "coefficients": _coefficients(findings.yaw) | _coefficients(findings.surge),
        "changes": [_change(change) for change in findings.changes],
        "windows": {"yaw": _windows(findings.yaw), "surge": _windows(findings.surge)},
        "track_origin": findings.track_origin,
        "warnings": list(findings.warnings),
    } | events_to_json(findings.events, plan.log_stats.span_ns[0])
    return without_nan(result)  # type: ignore[no-any-return]


def _log(findings: Findings) -> JsonObject:
    log_stats, clock = findings.plan.log_stats, findings.plan.clock
    start_ns, _ = log_stats.span_ns
    return {
        "name": findings.plan.name,
        "start": datetime.fromtimestamp(start_ns * 1e-9, UTC).isoformat(),
        "duration_secs": log_stats.duration_secs,
        "dt_secs": clock.dt_secs,
        "samples": clock.count,
        "metadata": findings.metadata,
        "channels": {channel.topic: _channel(channel) for channel in log_stats},
        "derived": {
            f"/{each.name}/{each.source}": each.metadata
            for each in findings.plan.screening.derivations
        },
        "sensor_delays": {
            each.name: {
                "secs": each.secs,
                "error_secs": each.error_secs,
                "reference": each.reference or None,
            }
            for each in findings.plan.screening.delays
        },
    }


def _channel(channel: ChannelStats) -> JsonObject:
    return {
        "unit": channel.unit,
        "samples": channel.samples,
        "rate_hz": 1 / channel.interval_secs if channel.interval_secs else None,
        "gaps": len(channel.gaps),
        "longest_gap_secs": max((length for _, length in channel.gaps), default=0.0),
        "spikes": len(channel.spikes) if channel.spikes else 0,
    }


def residual_json(residuals: ResidualSummary) -> JsonObject:
    """Return the test of an output's innovations as plain numbers."""
    return {
        "unit": residuals.unit,
        "count": residuals.count,
        "rms": residuals.rms,
        "mean_nis": residuals.mean_nis,
        "nis_band_99": list(residuals.nis_band),
        "whiteness_p": residuals.whiteness_p,
        "correlation": residuals.correlation,
        "correlation_lag_secs": residuals.correlation_lag_secs,
        "white": residuals.white,
        "rejected": residuals.rejected,
    }


def _residuals(findings: Findings, output: int) -> JsonObject:
    return residual_json(findings.residuals[output]) | _noise(findings.plan.noise, output)


def _noise(noise: NoiseModel, output: int) -> JsonObject:
    """Return the noise that the filter assumes of an output; the further ones have no process."""
    further = output - len(noise.measurement_std)
    if further >= 0:
        stated: JsonObject = {"measurement_std": noise.further.output_stds[further]}
        slow = noise.further.heading_error
        if slow is not None and noise.further.outputs[further] == FURTHER_OUTPUTS[0]:
            stated |= {"slow_error_std": slow.std, "slow_error_secs": slow.secs}
        return stated
    return {
        "measurement_std": float(noise.measurement_std[output]),
        "measurement_std_origin": "log" if noise.measured[output] else "vessel file",
        "process_ratio": float(noise.process_ratio[output]),
        "process_ratio_origin": "log" if noise.tuned[output] else "vessel file",
    }


def _wave(wave: Wave | None) -> JsonObject | None:
    """Return the wave that was separated from the ship's turning; None where none was."""
    if wave is None:
        return None
    return {
        "frequency": wave.frequency,
        "damping": wave.damping,
        "std": wave.std,
        "evidence": wave.evidence,
        "evidence_needed": wave.needed,
        "contrast": wave.contrast,
    }


def _disturbance(summary: DisturbanceSummary) -> JsonObject:
    return {
        "unit": summary.unit,
        "mean": summary.mean,
        "rms": summary.rms,
        "min": summary.min,
        "max": summary.max,
        "at_end": summary.at_end,
        "sensor_noise_std": summary.noise_std,
        "settling_secs": summary.settling_secs,
    }


def _absent(further: FurtherModel) -> JsonObject:
    """Return how much lower Akaike's criterion is without each disturbance that is absent."""
    forces = {"yaw": further.yaw, "surge": further.surge}
    return {
        name: {"aic_reduction": force.reduction}
        for name, force in forces.items()
        if force is not None and force.reduction > 0
    }


def _slow_state(error: SlowState) -> JsonObject:
    half = NORMAL_95 * error.std
    return {
        "unit": error.unit,
        "value": error.value,
        "std": error.std,
        "interval_95": [error.value - half, error.value + half],
        "prior_std": error.prior_std,
        "determined": error.determined,
        "reason": error.reason or None,
    }


def _current(current: Current | None) -> JsonObject | None:
    if current is None:
        return None
    derived = ("speed", "speed_std", "direction", "direction_std", "determined")
    values = asdict(current) | {name: getattr(current, name) for name in derived}
    return values | {"reason": current.reason or None}


def _coefficients(fit: CoefficientFit) -> JsonObject:
    return {
        name: {
            "value": coefficient.value,
            "std": coefficient.std,
            "unit": coefficient.unit,
            "determined": coefficient.determined,
            "condition": fit.condition,
        }
        for name, coefficient in fit.coefficients.items()
    }


def _change(change: Change) -> JsonObject:
    return asdict(change) | {"alternatives": list(change.alternatives)}


def _windows(fit: CoefficientFit) -> JsonObject:
    """Return the condition numbers of the sliding windows, and how many determine nothing."""
    conditions = fit.window_conditions
    known = conditions[np.isfinite(conditions)]
    return {
        "count": len(conditions),
        "empty": fit.blank_windows,
        "condition_median": float(np.median(known)) if len(known) else None,
        "condition_max": float(np.max(known)) if len(known) else None,
        "conditions": conditions.tolist(),
        "end_secs": fit.window_ends_secs.tolist(),
    }


def without_nan(value: Any) -> Any:  # noqa: ANN401 - walks a tree of JSON
    """Replace every float that JSON does not know by None."""
    if isinstance(value, dict):
        return {key: without_nan(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not isfinite(value) else value
