"""Analysis of a trial: its manoeuvres, their indices, and the verdict of the norm."""

from collections.abc import Sequence
from math import nan, radians

import numpy as np

from analysis.manoeuvres.assessment import AssessmentSettings, assess
from analysis.manoeuvres.detection import Detection, detect_manoeuvres
from analysis.manoeuvres.double_runs import with_double_runs
from analysis.manoeuvres.imo_criteria import RULES, CriterionRule, limit
from analysis.manoeuvres.manoeuvre_part import STEERED
from analysis.manoeuvres.manoeuvre_values import mean_before
from analysis.manoeuvres.sailed_manoeuvre import NotComputed, SailedManoeuvre
from analysis.manoeuvres.start_rules import STATED_SECS, RuleSettings
from analysis.manoeuvres.trial_index import TrialIndex
from analysis.manoeuvres.trial_signals import TrialSignals, filled_signals
from analysis.manoeuvres.water_velocity import AssumedErrors, VelocityErrors, velocity_errors
from analysis.replay.reading_options import DEFAULT_OPTIONS, ReadingOptions
from shiplog.progress import ProgressCallback, no_progress
from shiplog.types import Log

from .hull_conditions import stated_conditions, stated_number, with_hull_conditions
from .trial_analysis import CriterionFinding, CurrentEstimate, TrialAnalysis, TrialConditions
from .trial_options import DEFAULT_TRIAL_OPTIONS, TrialOptions
from .trial_record import TrialRecord, read_trial

GROUND_SPEED_SECS = 30.0  # of an approach, over which a speed over the ground is taken
STOPPED_SPEED = 0.5  # m/s: a ship that is never faster does not move
PERMITTED_COMPASS_ERROR = radians(0.25)  # at the equator, IMO A.821(19), 4.1.2
MAX_COMPASS_LATITUDE = radians(70.0)  # up to which the norm holds
NOT_TESTED = {
    "advance": "no turning circle at 35° or the largest angle",
    "tactical diameter": "no turning circle at 35° or the largest angle",
    "initial turning": "no manoeuvre that begins with 10° of rudder",
    "stopping, track reach": "no stopping manoeuvre with the propeller astern",
}


def analyse_trial(
    log: Log,
    options: ReadingOptions = DEFAULT_OPTIONS,
    trial_options: TrialOptions = DEFAULT_TRIAL_OPTIONS,
    *,
    on_progress: ProgressCallback = no_progress,
) -> TrialAnalysis:
    """Find the manoeuvres in a log, and compute their indices with intervals and verdicts.

    Parameters
    ----------
    log
        The log, in memory or in its file, of any length.
    options
        How it is read: vessel, length, sources, delays of sensors.
    trial_options
        The start rule, the place of the antenna, and assumed errors.
    on_progress
        Called with the step and its share done.

    Returns
    -------
    TrialAnalysis
        What can be computed; what cannot is named with the reason.

    Raises
    ------
    LogError
        The log has nothing of steering or motion.

    Examples
    --------
    >>> import shiplog
    >>> trial = analyse_trial(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> [manoeuvre.title for manoeuvre in trial.manoeuvres]
    ['zig-zag 20°/20°, first to starboard']
    """
    record = read_trial(log, options, on_progress)
    on_progress("find the manoeuvres", 0.0)
    detection = detect_manoeuvres(record.signals)
    assumed = AssumedErrors(
        trial_options.compass_bias_std, trial_options.speed_scale_std, trial_options.current_std
    )
    filled = filled_signals(record.signals)
    errors = velocity_errors(filled, detection.manoeuvres, assumed)
    conditions = _conditions(record, filled, detection, errors, trial_options)
    rules = RuleSettings(
        trial_options.start_rule,
        trial_options.moved_angle,
        trial_options.execute_secs,
    )
    settings = AssessmentSettings(
        rules,
        (trial_options.antenna_forward, trial_options.antenna_starboard),
        _compass_change_std(record, trial_options),
        {"length": conditions.length, "test_speed": conditions.test_speed},
    )
    manoeuvres = []
    for number, found in enumerate(detection.manoeuvres, 1):
        manoeuvres.append(assess(record.signals, found, number, errors, settings))
        on_progress("compute the indices", number / len(detection.manoeuvres))
    manoeuvres = with_double_runs(filled, detection.manoeuvres, manoeuvres)
    return TrialAnalysis(
        name=record.name,
        start_ns=record.start_ns,
        duration_secs=(len(filled) - 1) * filled.dt_secs,
        conditions=conditions,
        start_rule=str(trial_options.start_rule),
        manoeuvres=tuple(manoeuvres),
        criteria=tuple(_criterion(rule, manoeuvres, conditions) for rule in RULES),
        not_computed=(
            *detection.rejected,
            *_reasons(record.signals, detection, conditions),
            *_unused_executes(manoeuvres, trial_options, filled.dt_secs),
        ),
        warnings=record.warnings,
    )


def _compass_change_std(record: TrialRecord, options: TrialOptions) -> float:
    """Return the standard uncertainty of the compass in a change of heading, rad."""
    if options.compass_change_std is not None:
        return options.compass_change_std
    if record.vessel is not None and record.vessel.compass_error is not None:
        return record.vessel.compass_error
    latitude = min(abs(record.latitude), MAX_COMPASS_LATITUDE)
    return PERMITTED_COMPASS_ERROR / float(np.cos(latitude))


def _unused_executes(
    manoeuvres: Sequence[SailedManoeuvre], options: TrialOptions, dt: float
) -> list[NotComputed]:
    """Name the stated executes from which no manoeuvre counts."""
    reason = (
        f"no manoeuvre's rudder begins to move from {STATED_SECS[1]:g} s before to "
        f"{STATED_SECS[0]:g} s after it"
    )
    return [
        NotComputed(f"the stated execute at {stated:g} s", reason)
        for stated in options.execute_secs
        if not any(abs(each.execute_secs - stated) < dt for each in manoeuvres)
    ]


def _conditions(
    record: TrialRecord,
    filled: TrialSignals,
    detection: Detection,
    errors: VelocityErrors,
    options: TrialOptions,
) -> TrialConditions:
    """Gather the conditions of the trial from vessel, metadata and signals."""
    stated = stated_conditions(record.metadata)
    stated = with_hull_conditions(stated, record.vessel)
    length = record.vessel.length if record.vessel is not None else None
    speed, origin = _test_speed(filled, detection, stated, options)
    current = None
    if errors.method:
        std = float(np.sqrt(np.trace(errors.covariance[:2, :2]) / 2))
        current = CurrentEstimate(
            float(errors.current[0]), float(errors.current[1]), std, errors.method
        )
    return TrialConditions(
        ship=record.vessel.name if record.vessel is not None else "",
        length=stated_number(stated, "length_pp") if length is None else length,
        test_speed=speed,
        test_speed_origin=origin,
        stated=stated,
        wind_speed=record.wind_speed,
        wind_direction=record.wind_direction,
        current=current,
    )


def _test_speed(
    filled: TrialSignals, detection: Detection, stated: dict[str, str], options: TrialOptions
) -> tuple[float, str]:
    """Return V of the norm and where it came from."""
    if options.test_speed is not None:
        return options.test_speed, "given"
    number = stated_number(stated, "test_speed")
    if np.isfinite(number):
        return number, "stated in the log"
    steered = [each for each in detection.manoeuvres if each.kind in STEERED]
    used = steered or list(detection.manoeuvres)
    if used and filled.has("speed"):
        speeds = [mean_before(filled.speed, each.execute, filled.dt_secs) for each in used]
        return float(np.mean(speeds)), "mean of the approach speeds"
    back = round(GROUND_SPEED_SECS / filled.dt_secs)
    spans = [(each.execute - back, each.execute) for each in used if each.execute >= back > 0]
    if not spans or not filled.has("positions"):
        return nan, ""
    legs = [filled.positions[last] - filled.positions[first] for first, last in spans]
    ground = np.mean(np.hypot(*np.transpose(legs))) / (back * filled.dt_secs)
    return float(ground), "mean of the approach speeds over the ground"


def _criterion(
    rule: CriterionRule, manoeuvres: Sequence[SailedManoeuvre], conditions: TrialConditions
) -> CriterionFinding:
    """Return the verdict on a criterion: that of the largest value in the trial."""
    tested = [
        (manoeuvre, index)
        for manoeuvre in manoeuvres
        for index in manoeuvre.indices
        if index.criterion is not None and index.criterion.name == rule.name
    ]
    _, text = limit(rule, conditions.length, conditions.test_speed)
    if not tested:
        reason = NOT_TESTED.get(rule.name, f"no {rule.name.partition(',')[0]}")
        lacks_length = not np.isfinite(conditions.length) and not rule.name.startswith("20/20")
        if lacks_length:
            reason = "the ship's length is unknown; give it with --length or in the vessel file"
        elif rule.name.startswith("10/10") and not np.isfinite(conditions.length_over_speed):
            reason = "L/V is unknown: the log has no speed, and states none"
        return CriterionFinding(rule.name, text, rule.paragraph, reason=reason)
    manoeuvre, index = max(tested, key=lambda pair: _excess(pair[1]))
    return CriterionFinding(
        rule.name, text, rule.paragraph, manoeuvre.number, index, manoeuvre.side
    )


def _excess(index: TrialIndex) -> float:
    limit_value = index.criterion.limit if index.criterion is not None else nan
    return index.value / limit_value


def _reasons(
    signals: TrialSignals, detection: Detection, conditions: TrialConditions
) -> list[NotComputed]:
    """Name what the log lacks for the analysis as a whole."""
    reasons = []
    if not signals.has("rudder") and not signals.has("rudder_order"):
        reasons.append(NotComputed("manoeuvres of the rudder", "no rudder in the log"))
    if not signals.has("heading"):
        reasons.append(
            NotComputed(
                "heading",
                "not in the log; the yaw rate is integrated"
                if signals.has("yaw_rate")
                else "neither heading nor yaw rate in the log",
            )
        )
    if not signals.has("positions"):
        reasons.append(NotComputed("distances and the track", "no position in the log"))
    if not np.isfinite(conditions.length):
        reasons.append(
            NotComputed("limits in ship lengths", "the ship's length is unknown; give --length")
        )
    fastest = np.nanmax(signals.speed) if signals.has("speed") else nan
    if fastest < STOPPED_SPEED:
        reasons.append(NotComputed("manoeuvres", f"the ship is stopped: {fastest:.1f} m/s at most"))
    elif not detection.manoeuvres:
        reasons.append(NotComputed("manoeuvres", "none was found"))
    return reasons
