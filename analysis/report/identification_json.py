"""An identified ship as plain numbers in SI, for JSON."""

from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from analysis.identification.held_out import JUDGED_COLUMNS, PREDICTED
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.model_selection import Candidate
from analysis.identification.predicted_indices import PredictedManoeuvre
from analysis.identification.validation import Validation
from shiplog import __version__

from .identification_tables import mean_misfits, prior_shares_by_method
from .index_json import index_json


def identification_json(ship: IdentifiedShip) -> dict[str, Any]:
    """Convert an identification to plain numbers in SI, ready for `json.dump`.

    Parameters
    ----------
    ship
        The result of `analysis.identify`.

    Returns
    -------
    tree
        Dictionaries, lists, strings and numbers; None for a number that is not finite, and for the
        value of a parameter that is not identifiable. ``predictions`` has for each standard
        manoeuvre its ``indices`` with ``value``, ``std``, ``interval_95``, ``sources``,
        ``criterion``, ``verdict`` and ``probability``; where there are none, ``no_predictions`` is
        the reason.
    """
    estimates, scale = ship.uncertainty, ship.fit.problem.scale
    tree = {
        "shiplog": __version__,
        "model": {"name": ship.model.name, "title": ship.model.title},
        "scale": {
            "secs": scale.secs,
            "speed": scale.speed,
            "rpm": scale.rpm,
            "length_given": ship.length_given,
        },
        "parameters": {name: _parameter(ship, i) for i, name in enumerate(estimates.names)},
        "fixed": dict(ship.fixed),
        "prior_share": {
            method: {name: float(share) for name, share in shares.items()}
            for method, shares in prior_shares_by_method(ship).items()
        },
        "covariance": {
            "parameters": list(estimates.names),
            "values": estimates.covariance.tolist(),
        },
        "correlation": estimates.correlation.tolist(),
        "condition_number": estimates.condition,
        "interval_enlargement": estimates.enlargement,
        "agreement": _agreement(ship),
        "ties": _ties(ship),
        "fit": _fit(ship),
        "validation": [_validation(each) for each in ship.validations],
        "models": [_candidate(each) for each in ship.candidates],
        "predictions": [_prediction(each) for each in ship.predictions],
        "no_predictions": ship.no_predictions or None,
        "approach": asdict(ship.approach) if ship.approach else None,
        "warnings": list(ship.warnings),
    }
    return _finite(tree)  # type: ignore[no-any-return]


def _parameter(ship: IdentifiedShip, i: int) -> dict[str, Any]:
    """Return the entry of a free parameter; without a value where it is not identifiable."""
    estimates = ship.uncertainty
    name = estimates.names[i]
    identifiable = name not in estimates.unidentifiable
    return {
        "value": estimates.values[i] if identifiable else None,
        "unit": ship.model.parameter(name).unit,
        "identifiable": identifiable,
        "converged": ship.fit.minimum.converged,
        "interval_95": estimates.interval[i].tolist() if identifiable else None,
        "std": estimates.std[i],
        "cramer_rao_std": estimates.bound[i],
        "prior_share": estimates.prior_share[i],
        "recommended_manoeuvre": ship.advice.get(name),
    }


def _agreement(ship: IdentifiedShip) -> dict[str, Any]:
    """Return how far the runs differ, as ratios to what noise explains."""
    agreement = ship.uncertainty.agreement
    return {
        "logs": list(agreement.names),
        "by_own_noise": list(agreement.by_own_noise),
        "by_noise_of_all": list(agreement.by_common_noise),
        "contradiction": agreement.contradiction,
        "outlier": agreement.outlier,
    }


def _ties(ship: IdentifiedShip) -> dict[str, Any] | None:
    if ship.ties is None:
        return None
    return {
        "sum_over_d": ship.ties.sum_over_d,
        "std": ship.ties.std,
        "contradicted": ship.ties.contradicted,
        "advice": ship.ties.advice(tied=ship.model.name == "burylin-tied"),
    }


def _fit(ship: IdentifiedShip) -> list[dict[str, Any]]:
    return [
        {
            "log": run.name,
            "duration_secs": run.duration_secs,
            "residual_rms": dict(run.rms),
            "rudder_zero": run.rudder_offset,
            "biases": dict(run.biases),
            "swell_periods_secs": list(run.wave_secs),
        }
        for run in ship.runs
    ]


def _validation(validation: Validation) -> dict[str, Any]:
    return {
        "log": validation.segment.name,
        "diverged": validation.diverged,
        "rms": validation.rms,
        "no_indices": validation.no_indices or None,
        "indices": [
            {
                "name": index.name,
                "unit": index.unit,
                "measured": index.measured,
                "simulated": index.simulated,
                "error": index.error,
            }
            for index in validation.indices
        ],
    }


def _prediction(predicted: PredictedManoeuvre) -> dict[str, Any]:
    """Return a predicted manoeuvre; of what is not predicted, the reason is the index's note."""
    manoeuvre = predicted.manoeuvre
    return {
        "manoeuvre": manoeuvre.name,
        "kind": str(manoeuvre.kind),
        "rudder": manoeuvre.rudder,
        "switch_heading": manoeuvre.switch,
        "note": predicted.note,
        "indices": [index_json(index) for index in predicted.indices],
    }


def _candidate(candidate: Candidate) -> dict[str, Any]:
    names = [PREDICTED[i] for i in JUDGED_COLUMNS]
    return {
        "name": candidate.model.name,
        "score": candidate.score if candidate.fit is not None else None,
        "fault": candidate.fault,
        "weight": candidate.weight,
        "misfits": dict(zip(names, mean_misfits(candidate), strict=True)),
    }


def _finite(value: Any) -> Any:  # noqa: ANN401 - walks a tree of JSON
    """Replace numbers that are not finite by None, at any depth."""
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_finite(inner) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if isfinite(value) else None
    return value
