"""The estimation of a linear system as plain numbers, for JSON."""

from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.design.discrete_correction import sampled_poles
from analysis.linear.estimate import EstimateFindings
from shiplog import __version__

from .estimate_tables import poles_as_pairs
from .replay_json import JsonObject, residual_json, without_nan


def estimate_json(findings: EstimateFindings) -> JsonObject:
    """Return the results of an estimation as plain numbers, ready for JSON.

    Numbers are in the units of the system file; what is NaN or infinite is None.

    Returns
    -------
    dict
        ``log``, ``system``, ``estimator`` (poles as pairs of real and imaginary part, gains as
        matrices), ``outputs``, ``fitted``, ``regulator``, ``estimates`` (by name) and
        ``warnings``.
    """
    plan = findings.plan
    result = {
        "shiplog": __version__,
        "log": {"name": plan.name, "dt_secs": plan.clock.dt_secs, "samples": plan.clock.count},
        "system": {
            "name": plan.system.name,
            "states": list(plan.states),
            "outputs": list(plan.system.plant.sensors),
            "A": plan.model.A.tolist(),
            "C": plan.model.C.tolist(),
        },
        "estimator": _estimator(findings),
        "outputs": {
            residuals.name: residual_json(residuals)
            | {"measurement_std": float(std), "measurement_std_origin": "log" if own else "file"}
            for residuals, std, own in zip(
                findings.residuals, plan.stds, plan.measured, strict=True
            )
        },
        "fitted": [asdict(each) for each in plan.fitted],
        "regulator": _regulator(findings),
        "estimates": {each.name: asdict(each) for each in findings.summaries},
        "warnings": list(findings.warnings),
    }
    return without_nan(result)  # type: ignore[no-any-return]


def _regulator(findings: EstimateFindings) -> dict[str, Any] | None:
    feedback, costs = findings.plan.feedback, findings.costs
    if feedback is None or costs is None:
        return None
    return {
        "gain": feedback.regulator.gain.tolist(),
        "poles": poles_as_pairs(feedback.regulator.poles),
        "costs": {
            name: asdict(cost) | {"total": cost.total}
            for name, cost in (
                ("recorded", costs.recorded),
                ("feedback", costs.feedback),
                ("predicted", costs.predicted),
            )
        },
        "recorded_rms": list(costs.recorded_rms),
        "feedback_rms": list(costs.feedback_rms),
    }


def _estimator(findings: EstimateFindings) -> dict[str, Any]:
    plan = findings.plan
    design, model = plan.design, plan.model
    found: dict[str, Any] = {
        "method": plan.system.method.name,
        "smoothed": plan.smooth,
        "poles": None if design.poles is None else poles_as_pairs(design.poles),
        "gain": None if design.gain is None else design.gain.tolist(),
        "remarks": list(design.remarks),
    }
    if design.correction is not None:
        sampled = sampled_poles(model.step.F, model.C, design.correction, model.dt)
        found |= {
            "correction": design.correction.tolist(),
            "sampled_poles": poles_as_pairs(sampled[np.isfinite(sampled)]),
        }
    return found
