"""The part of a trial in which one manoeuvre was sailed: its signals, execute and angles."""

from dataclasses import replace
from itertools import pairwise
from math import degrees, nan, radians

import numpy as np

from .found_manoeuvre import FoundManoeuvre
from .manoeuvre_values import IndexCase, mean_before
from .sailed_manoeuvre import ManoeuvreKind, NotComputed
from .start_rules import SPARSE_SECS, RuleSettings, find_executes
from .trial_signals import SIGNAL_NAMES, TrialSignals, filled_signals, longest_gap
from .zigzag import FINE_SWITCH_STEP, SWITCH_STEP

MARGIN_SECS = 90.0  # of the approach, before the execute
TAIL_SECS = 10.0
MAX_PART_SAMPLES = 2400  # of a manoeuvre, from which its indices are computed
# half widths of the smoothing: of the shortest time from side to side, of a quarter turn, of a
# change of speed
ZIGZAG_SMOOTHING, CIRCLE_SMOOTHING, SPEED_SMOOTHING = 1 / 10, 1 / 16, 1 / 16
OTHER_HALF_SECS = 5.0  # half width of the smoothing where nothing else determines it
MAX_HALF_SECS = 30.0
NOTED_GAP_SECS = 5.0
UNSTEADY_YAW_RATE = radians(0.1)  # rad/s, of an approach
# samples of the rudder from the execute to the first reversal, and between two reversals, that show
# its angles
MIN_FIRST_SAMPLES, MIN_SPAN_SAMPLES = 2.5, 4.0
MAX_EARLY_SWITCH = radians(1.5)
MAX_LATE_SWITCH = radians(4.0)  # of a reversal beyond the nominal switch heading
SCATTERED_SWITCH = radians(2.0)
STEERED = (ManoeuvreKind.TURNING_CIRCLE, ManoeuvreKind.ZIGZAG, ManoeuvreKind.INITIAL_TURNING)


class ManoeuvrePart:
    """The signals of one manoeuvre, cut out of the trial and filled, and what it is.

    Parameters
    ----------
    signals
        Of the whole trial, as measured.
    found
        The manoeuvre.
    rules
        The start rule.

    Attributes
    ----------
    measured, filled
        The signals of the manoeuvre and its approach, as measured and without NaN.
    offset_secs
        Their first instant, from that of the trial, s.
    execute, others
        The execute, and the samples of the other start rules by their names.
    found
        The manoeuvre, in samples of `filled`.
    rudder, switch
        The angles ordered, rad; NaN where there is none.
    half_secs
        Half width of the heading's smoothing, s.
    blocked
        Why no index can be computed; empty where some can.
    """

    def __init__(self, signals: TrialSignals, found: FoundManoeuvre, rules: RuleSettings) -> None:
        dt, margin = signals.dt_secs, round(MARGIN_SECS / signals.dt_secs)
        execute, others = find_executes(filled_signals(signals), found, rules)
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
        self.blocked = self._too_sparse()
        self.rudder = _nominal_rudder(self.filled, self.found)
        self.switch, self.switch_note = self._switch()
        self.half_secs = self._half_secs()

    @property
    def side(self) -> str:
        """Of the first order."""
        if not np.isfinite(self.found.level):
            return ""
        return "starboard" if self.found.level > 0 else "port"

    def _too_sparse(self) -> list[NotComputed]:
        """Return why a zig-zag has no indices whose rudder is recorded too seldom; else none."""
        interval = self.filled.interval("rudder")
        if not self.found.reversals or interval <= SPARSE_SECS:
            return []
        spans = np.diff([self.found.execute, *self.found.reversals]) * self.filled.dt_secs
        shortest = float(np.min(spans))
        enough = np.array([MIN_FIRST_SAMPLES] + [MIN_SPAN_SAMPLES] * (len(spans) - 1)) * interval
        if np.all(spans >= enough):
            return []
        reason = (
            f"the rudder is reversed after {shortest:.0f} s, and recorded every {interval:.0f} s: "
            "neither its angle nor the headings at the reversals are determined"
        )
        return [NotComputed("all indices", reason)]

    def _switch(self) -> tuple[float, str]:
        """Return the nominal switch heading of a zig-zag, and a note where it is uncertain."""
        if self.found.kind is not ManoeuvreKind.ZIGZAG:
            return nan, ""
        heading, execute = self.filled.heading, round(self.execute.sample)
        window = heading[max(0, execute - round(30.0 / self.filled.dt_secs)) : execute + 1]
        changes = np.abs(heading[list(self.found.reversals)] - np.mean(window))
        # the mean of both sides does not depend on the approach heading
        sides = [np.median(side) for side in (changes[::2], changes[1::2]) if len(side)]
        typical = float(np.mean(sides))
        # between two samples of a rudder the heading goes on
        rate = float(np.median(np.abs(self.filled.yaw_rate[list(self.found.reversals)])))
        interval = self.filled.interval("rudder")
        unknown = rate * interval / 2 if interval > SPARSE_SECS else 0.0
        switch = nominal_switch(typical, self.rudder, unknown)
        scatter = float(np.max(np.abs(changes - typical)))
        if unknown > abs(self.rudder) / 8:
            return switch, (
                f"the rudder is recorded every {interval:.0f} s, in which the heading changes by "
                f"{degrees(2 * unknown):.0f}°: that it was reversed at {degrees(switch):.0f}° is "
                "assumed"
            )
        if scatter <= SCATTERED_SWITCH + unknown:
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
        if found.kind in (ManoeuvreKind.STOPPING, ManoeuvreKind.ACCELERATION):
            secs = (found.end - found.execute) * dt
            return float(np.clip(SPEED_SMOOTHING * secs, OTHER_HALF_SECS, MAX_HALF_SECS))
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


def nominal_switch(typical: float, rudder: float, unknown: float = 0.0) -> float:
    """Return the switch heading that was meant, from where the rudder was reversed.

    A helmsman is late rather than early. The rudder angle and half of it are the usual choices.

    Parameters
    ----------
    typical
        Median change of heading at the reversals, rad.
    rudder
        Rudder angle, rad.
    unknown
        Half the change of heading between two samples of the rudder, rad.

    Examples
    --------
    >>> round(degrees(nominal_switch(radians(11.8), radians(10.0))), 6)
    10.0
    """
    for usual in (abs(rudder), abs(rudder) / 2):
        late = min(MAX_LATE_SWITCH, 0.3 * usual)
        if -MAX_EARLY_SWITCH - unknown < typical - usual < late + unknown:
            return usual
    coarse = np.floor((typical + FINE_SWITCH_STEP) / SWITCH_STEP) * SWITCH_STEP
    if coarse > 0 and typical - coarse < 0.5 * MAX_LATE_SWITCH:
        return float(coarse)
    return float(max(1.0, np.round(typical / FINE_SWITCH_STEP)) * FINE_SWITCH_STEP)
