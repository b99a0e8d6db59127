"""Assessment of a manoeuvre that was found: execute, indices with intervals, verdicts, figures."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import degrees, nan, radians

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .imo_criteria import criterion_of, probability_below
from .index_uncertainty import COVERAGE_FACTOR, IndexInputs, index_stds, index_values
from .manoeuvre_values import TRACK_INDICES, IndexCase, mean_before
from .sailed_manoeuvre import (
    ManoeuvreKind,
    ManoeuvreMark,
    ManoeuvreSeries,
    NotComputed,
    SailedManoeuvre,
)
from .spirals import spiral_curve
from .start_rules import RuleSettings, find_executes
from .trial_index import TrialIndex
from .trial_signals import SIGNAL_NAMES, TrialSignals, filled_signals, longest_gap
from .water_velocity import AssumedErrors, VelocityErrors
from .zigzag import FINE_SWITCH_STEP, SWITCH_STEP

MARGIN_SECS = 90.0  # of the approach, before the execute
TAIL_SECS = 10.0
MAX_PART_SAMPLES = 2400  # of a manoeuvre, from which its indices are computed
# half widths of a heading's smoothing: of the shortest time from side to side, of a quarter turn
ZIGZAG_SMOOTHING, CIRCLE_SMOOTHING = 1 / 10, 1 / 16
OTHER_HALF_SECS = 5.0  # half width of the smoothing where nothing else determines it
MAX_HALF_SECS = 30.0
NOTED_GAP_SECS = 5.0
UNSTEADY_YAW_RATE = radians(0.1)  # rad/s, of an approach
MAX_EARLY_SWITCH = radians(1.5)
MAX_LATE_SWITCH = radians(4.0)  # of a reversal beyond the nominal switch heading
SCATTERED_SWITCH = radians(2.0)
SYMBOLS = {
    "advance": "Ad", "transfer": "Tr", "tactical diameter": "DT", "steady diameter": "D",
    "drift angle": "β", "steady yaw rate": "r", "initial turning time": "ta",
    "track reach": "ST", "head reach": "SH", "lateral deviation": "SL",
    **{f"overshoot {k}": f"ψ0{k}" for k in range(1, 10)},
    **{f"time to {angle}°": f"t{angle}" for angle in (90, 180, 270, 360)},
    **{f"speed at {angle}°": f"V{angle}" for angle in (90, 180, 270, 360)},
}  # fmt: skip
UNITS = {
    "drift angle": "rad", "heading change": "rad", "loop width": "rad", "loop height": "rad/s",
    "speed loss": "1", "power": "W",
    "revolutions": "rpm", "period": "s", "reach": "s", "transfer": "m",
    "advance": "m", "lateral deviation": "m",
}  # fmt: skip
UNIT_WORDS = (
    ("overshoot", "rad"), ("yaw rate", "rad/s"), ("diameter", "m"), ("distance", "m"),
    ("track reach", "m"), ("head reach", "m"), ("time", "s"), ("speed", "m/s"),
)  # fmt: skip


@dataclass(frozen=True)
class AssessmentSettings:
    """What the assessment of a manoeuvre depends on, beside its signals.

    Attributes
    ----------
    rules
        The start rule.
    assumed
        Standard deviations of systematic errors.
    antenna
        Place of the antenna ahead and to starboard of the midship point, m.
    ship
        ``length``, m, and ``test_speed``, m/s; NaN where unknown.
    """

    rules: RuleSettings = field(default_factory=RuleSettings)
    assumed: AssumedErrors = field(default_factory=AssumedErrors)
    antenna: tuple[float, float] = (0.0, 0.0)
    ship: Mapping[str, float] = field(default_factory=lambda: {"length": nan, "test_speed": nan})


def index_unit(name: str) -> str:
    """Return the SI unit of an index.

    Examples
    --------
    >>> index_unit("overshoot 2"), index_unit("time to 90°"), index_unit("speed at 90°")
    ('rad', 's', 'm/s')
    """
    if name in UNITS:
        return UNITS[name]
    return next(unit for word, unit in UNIT_WORDS if word in name)


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
    part = _Part(signals, found, settings)
    inputs = IndexInputs(
        part.filled,
        part.found,
        part.execute,
        part.switch,
        part.half_secs,
        errors,
        settings.antenna,
        signals.has("heading"),
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
        series=_series(part, case),
        marks=_marks(part, case, indices),
        indices=indices,
        spiral=spiral_curve(case.signals, part.found.levels)
        if len(found.levels)
        else np.empty((0, 2)),
        not_computed=(*part.blocked, *unreached),
        notes=part.notes(case),
    )


class _Part:
    """The signals of one manoeuvre, cut out of the trial and filled, and what it is."""

    def __init__(
        self, signals: TrialSignals, found: FoundManoeuvre, settings: AssessmentSettings
    ) -> None:
        dt, margin = signals.dt_secs, round(MARGIN_SECS / signals.dt_secs)
        execute, others = find_executes(filled_signals(signals), found, settings.rules)
        earliest = min(execute.sample, *others.values(), found.execute)
        first = max(0, int(earliest) - margin)
        end = min(len(signals), found.end + round(TAIL_SECS / dt))
        step = max(1, (end - first) // MAX_PART_SAMPLES)
        self.measured = signals.part(first, end)
        self.filled = _thinned(filled_signals(self.measured), step)
        self.offset_secs = first * dt
        self.others = {name: (at - first) / step for name, at in others.items()}
        self.execute = replace(execute, sample=(execute.sample - first) / step)
        self.found = replace(
            found,
            execute=(found.execute - first) // step,
            end=min((found.end - first) // step, len(self.filled)),
            reversals=tuple((at - first) // step for at in found.reversals),
            levels=np.column_stack(((found.levels[:, :2] - first) // step, found.levels[:, 2])),
        )
        self.blocked: list[NotComputed] = []
        self.rudder = _nominal_rudder(self.filled, self.found)
        self.switch, self.switch_note = self._switch()
        self.half_secs = self._half_secs()

    @property
    def side(self) -> str:
        """Of the first order."""
        if not np.isfinite(self.found.level):
            return ""
        return "starboard" if self.found.level > 0 else "port"

    def _switch(self) -> tuple[float, str]:
        """Return the nominal switch heading of a zig-zag, and a note where it is in doubt."""
        if self.found.kind is not ManoeuvreKind.ZIGZAG:
            return nan, ""
        heading, execute = self.filled.heading, round(self.execute.sample)
        window = heading[max(0, execute - round(30.0 / self.filled.dt_secs)) : execute + 1]
        changes = np.abs(heading[list(self.found.reversals)] - np.mean(window))
        # the mean of both sides does not depend on the approach heading
        sides = [np.median(side) for side in (changes[::2], changes[1::2]) if len(side)]
        typical = float(np.mean(sides))
        switch = nominal_switch(typical, self.rudder)
        scatter = float(np.max(np.abs(changes - typical)))
        if scatter <= SCATTERED_SWITCH:
            return switch, ""
        listed = ", ".join(f"{degrees(change):.1f}°" for change in changes)
        return switch, (
            f"the rudder was reversed at different changes of heading ({listed}); the overshoots "
            f"count from {degrees(switch):.0f}°"
        )

    def _half_secs(self) -> float:
        """Return the half width of the heading's smoothing, from the pace of the manoeuvre."""
        dt, found = self.filled.dt_secs, self.found
        if found.kind is ManoeuvreKind.ZIGZAG:
            ends = [*found.reversals, found.end]
            spans = np.diff(ends)
            shortest = min(float(np.min(spans)), 2.0 * (found.reversals[0] - found.execute))
            return min(ZIGZAG_SMOOTHING * shortest * dt, MAX_HALF_SECS)
        turned = np.abs(self.filled.heading - self.filled.heading[found.execute])
        quarter = np.flatnonzero(turned[found.execute :] >= np.pi / 2)
        if found.kind is ManoeuvreKind.TURNING_CIRCLE and len(quarter):
            return min(CIRCLE_SMOOTHING * float(quarter[0]) * dt, MAX_HALF_SECS)
        return OTHER_HALF_SECS

    def missing(self) -> dict[str, str]:
        """Return why indices cannot be computed, by a word of their names."""
        signals = self.filled
        reasons = {}
        if not signals.has("heading"):
            self.blocked.append(NotComputed("all indices", "no heading and no yaw rate in the log"))
        if not signals.has("positions"):
            reasons["track"] = "no position in the log"
        if not signals.has("speed"):
            reasons["speed"] = "no speed through the water in the log"
        if not signals.has("power"):
            reasons["power"] = "no power in the log"
        if not signals.has("rpm"):
            reasons["revolutions"] = "no revolutions in the log"
        return reasons

    def title(self) -> str:
        """Name the manoeuvre with its angles and its side."""
        kind, rudder = self.found.kind, abs(degrees(self.rudder))
        if kind is ManoeuvreKind.ZIGZAG:
            angles = f"{rudder:.0f}°/{degrees(self.switch):.0f}°"
            return f"zig-zag {angles}, first to {self.side}"
        if kind in (ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.INITIAL_TURNING):
            return f"{kind} {rudder:.0f}° to {self.side}"
        if kind is ManoeuvreKind.PULL_OUT:
            return f"pull-out from {rudder:.0f}° to {self.side}"
        return str(kind)

    def notes(self, case: IndexCase) -> tuple[str, ...]:
        """Return what was assumed or is to be kept in mind."""
        notes = [self.switch_note]
        for name in ("heading", "rudder"):
            gap = longest_gap(getattr(self.measured, name), self.measured.dt_secs)
            if self.measured.has(name) and gap > NOTED_GAP_SECS:
                notes.append(f"{name}: interpolated over a gap of {gap:.0f} s")
        if not self.measured.has("heading"):
            notes.append("heading: the integral of the yaw rate, with the drift of its bias")
        if not self.measured.has("rudder"):
            notes.append("rudder: the orders, no angle was recorded")
        rate = mean_before(case.signals.yaw_rate, case.first, case.signals.dt_secs)
        if self.found.kind in STEERED and abs(rate) > UNSTEADY_YAW_RATE and case.first > 0:
            notes.append(
                f"the approach is not steady: the ship turns at {degrees(rate):+.2f} °/s in its "
                "last 10 s"
            )
        return tuple(filter(None, notes))


def _thinned(signals: TrialSignals, step: int) -> TrialSignals:
    """Return every `step`-th sample."""
    if step == 1:
        return signals
    arrays = {name: getattr(signals, name)[::step] for name in SIGNAL_NAMES}
    return replace(signals, dt_secs=signals.dt_secs * step, **arrays)


def _nominal_rudder(signals: TrialSignals, found: FoundManoeuvre) -> float:
    """Return the rudder ordered, rad: of a zig-zag the mean of both sides, else the angle held.

    A multiple of 5° is taken where the angle, with or without the neutral angle, is near to it.
    """
    if not np.isfinite(found.level):
        return nan
    held = [abs(found.level + found.approach_level), abs(found.level)]
    if found.reversals:
        edges = [found.execute, *found.reversals, found.end]
        parts = [signals.rudder[a + (b - a) // 2 : b] for a, b in pairwise(edges)]
        levels = [float(np.median(part)) for part in parts[:2] if len(part)]
        if len(levels) == 2:
            held = [abs(levels[0] - levels[1]) / 2]
    step = radians(5.0)
    nearest = min(held, key=lambda angle: abs(angle - step * round(angle / step)))
    rounded = step * round(nearest / step)
    return found.side * (rounded if abs(rounded - nearest) < radians(0.9) else held[-1])


def nominal_switch(typical: float, rudder: float) -> float:
    """Return the switch heading that was meant, from where the rudder was reversed.

    A helmsman is late rather than early. The rudder angle and half of it are the usual choices.

    Parameters
    ----------
    typical
        Median change of heading at the reversals, rad.
    rudder
        Rudder angle, rad.

    Examples
    --------
    >>> round(degrees(nominal_switch(radians(11.8), radians(10.0))), 6)
    10.0
    """
    for usual in (abs(rudder), abs(rudder) / 2):
        if -MAX_EARLY_SWITCH < typical - usual < min(MAX_LATE_SWITCH, 0.3 * usual):
            return usual
    coarse = np.floor((typical + FINE_SWITCH_STEP) / SWITCH_STEP) * SWITCH_STEP
    if coarse > 0 and typical - coarse < 0.5 * MAX_LATE_SWITCH:
        return float(coarse)
    return float(max(1.0, np.round(typical / FINE_SWITCH_STEP)) * FINE_SWITCH_STEP)


def _indices(
    inputs: IndexInputs,
    case: IndexCase,
    part: _Part,
    missing: Mapping[str, str],
    settings: AssessmentSettings,
) -> tuple[tuple[TrialIndex, ...], list[NotComputed]]:
    """Return the indices with intervals and verdicts, and the reasons for those not computed."""
    values = index_values(case)
    others = {name: index_values(inputs.case(execute=at)) for name, at in part.others.items()}
    finite = {name: value for name, value in values.items() if np.isfinite(value)}
    stds = index_stds(inputs, finite)
    astern = bool(np.min(case.signals.rpm[case.first :], initial=0.0) < 0)
    indices, unreached = [], []
    for name, value in values.items():
        reason = _missing_reason(name, missing)
        if reason or name not in finite:
            unreached.append(NotComputed(name, reason or _unreached(name, part, case)))
            continue
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


def _missing_reason(name: str, missing: Mapping[str, str]) -> str:
    """Return why an index lacks its channel; empty where it does not."""
    if name in TRACK_INDICES or name == "speed by track":
        return missing.get("track", "")
    if "distance" in name:
        return missing["track"] if "track" in missing and "speed" in missing else ""
    if "speed" in name:
        return missing.get("speed", "")
    return missing.get(name, "")


def _unreached(name: str, part: _Part, case: IndexCase) -> str:
    """Return why an index whose channels are there has no value."""
    found = part.found
    turned = np.abs(case.signals.heading[case.first : found.end] - case.approach)
    most = degrees(float(np.max(turned, initial=0.0)))
    if found.kind is ManoeuvreKind.TURNING_CIRCLE:
        return f"the heading changes by {most:.0f}° with the rudder held"
    if name.startswith("overshoot"):
        return "the heading does not come back before the manoeuvre ends"
    if name in ("period", "reach"):
        return "the heading does not cross the approach heading often enough"
    if found.kind is ManoeuvreKind.STOPPING:
        return f"the speed falls to {float(np.min(case.signals.speed)):.1f} m/s, not to zero"
    if name.startswith("loop"):
        return "the spiral was not sailed both ways"
    return f"the heading changes by {most:.1f}°"


def _series(part: _Part, case: IndexCase) -> ManoeuvreSeries:
    """Return the time histories for the figures."""
    signals, measured = case.signals, part.filled
    count = min(len(signals), part.found.end + round(TAIL_SECS / signals.dt_secs))
    none = np.empty(0)

    def shown(name: str) -> FloatArray:
        values: FloatArray = getattr(measured, name)[:count]
        return values if np.isfinite(values).sum() > 1 else none

    track = np.empty((0, 2))
    if measured.has("positions"):
        samples = np.arange(len(signals))
        start = [np.interp(case.execute, samples, column) for column in signals.positions.T]
        made = (signals.positions[:count] - start) @ [1, 1j] * np.exp(-1j * case.approach)
        track = np.column_stack((made.real, made.imag))
    drift = (
        -np.arctan2(signals.sway[:count], signals.speed[:count])
        if signals.has("sway") and signals.has("speed")
        else none
    )
    change = signals.heading[:count] - case.approach
    return ManoeuvreSeries(
        time_secs=(np.arange(count) - case.execute) * signals.dt_secs,
        rudder=shown("rudder"),
        rudder_order=shown("rudder_order"),
        heading_change=change if np.isfinite(change).any() else none,
        yaw_rate=shown("yaw_rate"),
        speed=shown("speed"),
        drift=drift,
        rpm=shown("rpm"),
        track=track,
    )


def _marks(
    part: _Part, case: IndexCase, indices: tuple[TrialIndex, ...]
) -> tuple[ManoeuvreMark, ...]:
    """Return the instants that the figures mark."""
    dt, found = case.signals.dt_secs, part.found
    marks = [ManoeuvreMark("execute", 0.0)] if part.side or found.kind in EXECUTED else []
    marks += [
        ManoeuvreMark(f"execute {k}", (at - case.execute) * dt)
        for k, at in enumerate(found.reversals, 2)
    ]
    marks += [
        ManoeuvreMark(index.name.removeprefix("time to "), index.value)
        for index in indices
        if index.name.startswith("time to ") and index.name.endswith("°")
    ]
    if found.kind is ManoeuvreKind.ZIGZAG:
        change = case.signals.heading - case.approach
        edges = [*found.reversals, found.end]
        for k, (start, stop) in enumerate(pairwise(edges), 1):
            if any(index.name == f"overshoot {k}" for index in indices):
                peak = start + int(np.argmax(np.abs(change[start:stop])))
                marks.append(ManoeuvreMark(f"overshoot {k}", (peak - case.execute) * dt))
    marks += [
        ManoeuvreMark("stopped", index.value) for index in indices if index.name == "stopping time"
    ]
    return tuple(sorted(marks, key=lambda mark: mark.time_secs))


STEERED = (ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.ZIGZAG, ManoeuvreKind.INITIAL_TURNING)
EXECUTED = (ManoeuvreKind.STOPPING, ManoeuvreKind.ACCELERATION)
