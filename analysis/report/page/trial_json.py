"""The content of a trial's report as plain numbers in SI, for JSON."""

from collections.abc import Iterable
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

from analysis.manoeuvres.sailed_manoeuvre import NotComputed, SailedManoeuvre
from analysis.report.identification_json import identification_json
from analysis.report.index_json import index_json
from analysis.report.replay_json import JsonObject, replay_json, without_nan
from analysis.trial.trial_analysis import CriterionFinding, TrialConditions

from .numbering import ManoeuvrePlace, manoeuvre_places
from .trial_report import ReportedLog, TrialReport

FACTS = (
    "kind", "title", "side", "start_secs", "execute_secs", "end_secs", "rudder", "switch_heading",
    "start_rule", "approach_heading", "approach_speed", "approach_rpm", "approach_yaw_rate",
    "neutral_rudder",
)  # fmt: skip


def trial_json(report: TrialReport) -> JsonObject:
    """Return the numbers of a report as plain values, ready for JSON.

    Numbers are in SI units and radians; what is NaN or infinite is None. The time histories of
    the figures are not among them.

    Returns
    -------
    dict
        ``shiplog``, the version; ``command``; ``options``, the assumed errors; ``logs``, each
        with ``files`` (``sha256``),
        ``conditions``, ``manoeuvres`` (``position`` in the report; ``indices`` with ``value``,
        ``std``, ``interval_95``, ``criterion``, ``verdict`` and ``probability``), ``criteria``,
        ``not_computed``, ``warnings`` and ``replay``, as of `replay_json`; ``identified``, as of
        `identification_json`. What failed is None, with the reason in ``replay_error`` and
        ``identification_error``.
    """
    places = manoeuvre_places(report)
    logs = [_log(log, of_log) for log, of_log in zip(report.logs, places, strict=True)]
    result = {
        "shiplog": report.version,
        "command": report.command,
        "options": asdict(report.options),
        "logs": logs,
        "identified": identification_json(report.identified) if report.identified else None,
        "identification_error": report.identification_error or None,
    }
    return without_nan(result)  # type: ignore[no-any-return]


def _log(log: ReportedLog, places: Iterable[ManoeuvrePlace]) -> JsonObject:
    trial = log.trial
    return {
        "name": trial.name,
        "files": [asdict(file) for file in log.files],
        "start": datetime.fromtimestamp(trial.start_ns * 1e-9, UTC).isoformat(),
        "duration_secs": trial.duration_secs,
        "data_lost": log.data_lost,
        "conditions": _conditions(trial.conditions),
        "start_rule": trial.start_rule,
        "manoeuvres": [_manoeuvre(place) for place in places],
        "criteria": [_criterion(finding) for finding in trial.criteria],
        "not_computed": _reasons(trial.not_computed),
        "warnings": list(log.warnings),
        "replay": replay_json(log.replay) if log.replay else None,
        "replay_error": log.replay_error or None,
    }


def _conditions(conditions: TrialConditions) -> JsonObject:
    stated = {"stated": dict(conditions.stated)}
    return asdict(conditions) | stated | {"length_over_speed": conditions.length_over_speed}


def _manoeuvre(place: ManoeuvrePlace) -> JsonObject:
    manoeuvre: SailedManoeuvre = place.manoeuvre
    return {
        "number": manoeuvre.number,
        "position": place.position,
        **{name: _plain(getattr(manoeuvre, name)) for name in FACTS},
        "marks": [asdict(mark) for mark in manoeuvre.marks],
        "spiral": manoeuvre.spiral.tolist(),
        "indices": [index_json(index) for index in manoeuvre.indices],
        "not_computed": _reasons(manoeuvre.not_computed),
        "notes": list(manoeuvre.notes),
    }


def _criterion(finding: CriterionFinding) -> JsonObject:
    index = finding.index
    return {
        "name": finding.name,
        "text": finding.text,
        "paragraph": finding.paragraph,
        "manoeuvre": finding.manoeuvre,
        "side": finding.side,
        "verdict": _plain(index.verdict) if index else None,
        "index": index_json(index) if index else None,
        "reason": finding.reason,
    }


def _reasons(items: Iterable[NotComputed]) -> list[JsonObject]:
    return [asdict(item) for item in items]


def _plain(value: Any) -> Any:  # noqa: ANN401 - a field of any type
    """Return a member of an enumeration as its text, anything else as it is."""
    return str(value) if isinstance(value, str) else value
