"""Assessment of a manoeuvre that was found: execute, indices with intervals, verdicts, figures."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan, radians

import numpy as np

from .found_manoeuvre import FoundManoeuvre
from .imo_criteria import criterion_of, probability_below
from .index_names import SYMBOLS, index_unit, missing_reason, unreached_reason
from .index_uncertainty import (
    COVERAGE_FACTOR,
    IndexInputs,
    index_stds,
    index_values,
    noise_draws,
    without_noise_bias,
)
from .manoeuvre_figures import manoeuvre_marks, manoeuvre_series
from .manoeuvre_part import ManoeuvrePart
from .manoeuvre_values import IndexCase, mean_before
from .sailed_manoeuvre import NotComputed, SailedManoeuvre
from .spiral_curve import spiral_curve
from .start_rules import RuleSettings
from .trial_index import TrialIndex
from .trial_signals import TrialSignals
from .water_velocity import VelocityErrors


@dataclass(frozen=True)
class AssessmentSettings:
    """What the assessment of a manoeuvre depends on, beside its signals.

    Attributes
    ----------
    rules
        The start rule.
    antenna
        Place of the antenna ahead and to starboard of the midship point, m.
    compass_change_std
        Assumed standard deviation of the compass's error in a change of heading, rad.
    ship
        ``length``, m, and ``test_speed``, m/s; NaN where unknown.
    """

    rules: RuleSettings = field(default_factory=RuleSettings)
    antenna: tuple[float, float] = (0.0, 0.0)
    compass_change_std: float = radians(0.25)
    ship: Mapping[str, float] = field(default_factory=lambda: {"length": nan, "test_speed": nan})


def assess(
    signals: TrialSignals,
    found: FoundManoeuvre,
    number: int,
    errors: VelocityErrors,
    settings: AssessmentSettings,
) -> SailedManoeuvre:
    """Compute everything about one manoeuvre.

    Parameters
    ----------
    signals
        Of the whole trial, as measured.
    found
        The manoeuvre.
    number
        Its number in the log.
    errors
        Current and systematic errors.
    settings
        Start rule, assumed errors, ship.
    """
    part = ManoeuvrePart(signals, found, settings.rules)
    inputs = IndexInputs(
        part.filled,
        part.found,
        part.execute,
        part.switch,
        part.half_secs,
        errors,
        settings.antenna,
        settings.compass_change_std if signals.has("heading") else None,
    )
    case, missing = inputs.case(), part.missing()
    indices: tuple[TrialIndex, ...] = ()
    unreached: list[NotComputed] = []
    if not part.blocked:
        indices, unreached = _indices(inputs, case, part, missing, settings)
    before = mean_before
    execute, dt = round(part.execute.sample), part.filled.dt_secs
    return SailedManoeuvre(
        number=number,
        kind=found.kind,
        title=part.title(),
        start_secs=part.offset_secs,
        execute_secs=part.offset_secs + part.execute.sample * dt,
        end_secs=part.offset_secs + part.found.end * dt,
        side=part.side,
        rudder=part.rudder,
        switch_heading=part.switch,
        start_rule=part.execute.rule,
        approach_heading=case.approach % (2 * np.pi),
        approach_speed=before(case.signals.speed, execute, dt),
        approach_rpm=before(case.signals.rpm, execute, dt),
        approach_yaw_rate=before(case.signals.yaw_rate, execute, dt),
        neutral_rudder=found.approach_level,
        series=manoeuvre_series(part, case),
        marks=manoeuvre_marks(part, case, indices),
        indices=indices,
        spiral=spiral_curve(case.signals, part.found.levels)
        if len(found.levels)
        else np.empty((0, 2)),
        not_computed=(*part.blocked, *unreached),
        notes=part.notes(case),
    )


def _indices(
    inputs: IndexInputs,
    case: IndexCase,
    part: ManoeuvrePart,
    missing: Mapping[str, str],
    settings: AssessmentSettings,
) -> tuple[tuple[TrialIndex, ...], list[NotComputed]]:
    """Return the indices with intervals and verdicts, and the reasons for those not computed."""
    values = index_values(case)
    others = {name: index_values(inputs.case(execute=at)) for name, at in part.others.items()}
    finite = {name: value for name, value in values.items() if np.isfinite(value)}
    draws = noise_draws(inputs)
    stds = index_stds(inputs, finite, draws)
    corrected = without_noise_bias(finite, draws)
    astern = bool(np.min(case.signals.rpm[case.first :], initial=0.0) < 0)
    indices, unreached = [], []
    for name in values:
        reason = missing_reason(name, missing)
        if reason or name not in finite:
            unreached.append(NotComputed(name, reason or unreached_reason(name, case)))
            continue
        value = corrected[name]
        std = float(np.sqrt(sum(each**2 for each in stds[name].values())))
        criterion = criterion_of(
            name, part.found.kind, (part.rudder, part.switch), settings.ship, astern=astern
        )
        indices.append(
            TrialIndex(
                name=name,
                symbol=SYMBOLS.get(name, ""),
                value=value,
                unit=index_unit(name),
                std=std,
                low=value - COVERAGE_FACTOR * std,
                high=value + COVERAGE_FACTOR * std,
                sources=stds[name],
                start_rules={rule: each[name] for rule, each in others.items()},
                in_lengths=value / settings.ship["length"] if index_unit(name) == "m" else nan,
                criterion=criterion,
                probability=nan
                if criterion is None
                else probability_below(criterion.limit, value, std),
            )
        )
    return tuple(indices), unreached
