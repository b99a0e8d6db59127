"""An identified ship as plain numbers for JSON."""

from math import isfinite
from typing import Any

import numpy as np

from analysis.identification.identify import IdentifiedShip
from analysis.identification.model_selection import JUDGED_COLUMNS
from analysis.identification.validation import Validation
from shiplog import __version__
from shiplog.ships.motion import MODEL_OUTPUTS

from .identification_tables import mean_misfits, prior_shares_by_method


def identification_json(found: IdentifiedShip) -> dict[str, Any]:
    """The same as plain numbers in SI; what is not a number is None."""
    told = found.uncertainty
    told_of = {
        "shiplog": __version__,
        "model": {"name": found.model.name, "title": found.model.title},
        "scale": {
            "secs": found.fit.problem.scale.secs,
            "speed": found.fit.problem.scale.speed,
            "rpm": found.fit.problem.scale.rpm,
            "length_given": found.length_given,
        },
        "coefficients": {
            name: _coefficient(found, i) for i, name in enumerate(told.names)
        },
        "fixed": dict(found.fixed),
        "prior_share": {
            method: {name: float(share) for name, share in shares.items()}
            for method, shares in prior_shares_by_method(found).items()
        },
        "covariance": {"of": list(told.names), "values": told.covariance.tolist()},
        "correlation": told.correlation.tolist(),
        "condition": told.condition,
        "enlarged": told.enlargement,
        "agreement": {
            "logs": list(told.agreement.names),
            "by_own_noise": list(told.agreement.by_own_noise),
            "by_noise_of_all": list(told.agreement.by_common_noise),
            "contradiction": told.agreement.contradiction,
            "odd": told.agreement.outlier,
        },
        "ties": None if found.ties is None else {
            "sum_over_d": found.ties.sum_over_d,
            "std": found.ties.std,
            "contradicted": found.ties.contradicted,
            "advice": found.ties.advice(tied=found.model.name == "burylin-tied"),
        },
        "fit": [
            {
                "log": run.name, "duration_secs": run.duration_secs, "rms": dict(run.rms),
                "rudder_offset": run.rudder_offset, "biases": dict(run.biases),
                "wave_secs": list(run.wave_secs),
            }
            for run in found.runs
        ],
        "validation": [_validation(each) for each in found.validations],
        "models": [
            {
                "name": c.model.name, "score": c.score if c.fit is not None else None,
                "misfits": dict(zip(
                    (MODEL_OUTPUTS[i] for i in JUDGED_COLUMNS), mean_misfits(c), strict=True
                )),
            }
            for c in found.candidates
        ],
        "warnings": list(found.warnings),
    }  # fmt: skip
    return _finite(told_of)  # type: ignore[no-any-return]


def _coefficient(found: IdentifiedShip, i: int) -> dict[str, Any]:
    """A value that the logs do not tell stands as None: what is printed is believed."""
    told = found.uncertainty
    name = told.names[i]
    unidentifiable = name in told.unidentifiable
    return {
        "value": None if unidentifiable else told.values[i],
        "unit": found.model.parameter(name).unit,
        "identifiable": not unidentifiable,
        "interval": None if unidentifiable else told.interval[i].tolist(),
        "std": told.std[i],
        "cramer_rao_std": told.bound[i],
        "prior_share": told.prior_share[i],
        "what_would_tell": found.advice.get(name),
    }


def _validation(each: Validation) -> dict[str, Any]:
    return {
        "log": each.segment.name,
        "ran_away": each.diverged,
        "rms": each.rms,
        "figures": [
            {
                "name": f.name, "unit": f.unit, "measured": f.measured,
                "simulated": f.simulated, "error": f.error,
            }
            for f in each.figures
        ],
    }  # fmt: skip


def _finite(value: Any) -> Any:  # noqa: ANN401 - walks a tree of JSON
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_finite(inner) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if isfinite(value) else None
    return value
