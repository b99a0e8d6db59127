"""Spans of the manoeuvres in a trial, with the instants that a drawing marks, without indices."""

from dataclasses import dataclass, replace
from math import degrees, pi

import numpy as np

from shiplog.types import FloatArray

from .detection import detect_manoeuvres
from .execute import approach_heading, first_crossing
from .found_manoeuvre import FoundManoeuvre
from .manoeuvre_figures import execute_marks, overshoot_samples
from .manoeuvre_part import ManoeuvrePart
from .sailed_manoeuvre import ManoeuvreKind, ManoeuvreMark
from .start_rules import RuleSettings
from .trial_signals import TrialSignals, filled_signals

TURN_MARKS = (pi / 2, pi, 3 * pi / 2, 2 * pi)  # changes of heading in a turning circle


@dataclass(frozen=True)
class ManoeuvreSpan:
    """Where a manoeuvre is in a trial, and what it is.

    Attributes
    ----------
    number
        Its number in the trial, from 1.
    kind
        What it is.
    title
        Such as ``zig-zag 10°/10°, first to starboard``.
    start_secs, execute_secs, end_secs
        Of the manoeuvre with its approach, from the trial's first instant, s.
    approach_heading
        The mean heading before the execute, continuous with that of the trial, rad; NaN where
        neither heading nor yaw rate is known.
    marks
        Executes, turns by quarters of a circle, overshoots; their times count from the execute.
    """

    number: int
    kind: ManoeuvreKind
    title: str
    start_secs: float
    execute_secs: float
    end_secs: float
    approach_heading: float
    marks: tuple[ManoeuvreMark, ...]

    def later(self, secs: float) -> "ManoeuvreSpan":
        """Return the span in times that count from another instant, `secs` earlier."""
        return replace(
            self,
            start_secs=self.start_secs + secs,
            execute_secs=self.execute_secs + secs,
            end_secs=self.end_secs + secs,
        )


def manoeuvre_spans(signals: TrialSignals) -> tuple[ManoeuvreSpan, ...]:
    """Find the manoeuvres in the signals of a trial, in the order of their executes.

    They are those of `analysis.trial.analyse_trial`, found without the signals' smoothing, the
    indices and their intervals. A straight run is none of them.

    Parameters
    ----------
    signals
        As measured.
    """
    found = [
        each
        for each in detect_manoeuvres(signals).manoeuvres
        if each.kind is not ManoeuvreKind.STRAIGHT
    ]
    filled = filled_signals(signals)
    return tuple(_span(filled, each, number) for number, each in enumerate(found, 1))


def _span(signals: TrialSignals, found: FoundManoeuvre, number: int) -> ManoeuvreSpan:
    part = ManoeuvrePart(signals, found, RuleSettings())
    # the part of a long manoeuvre is thinned; times are those of the signals
    dt = signals.dt_secs
    execute_secs = part.offset_secs + part.execute.sample * part.filled.dt_secs
    execute = execute_secs / dt
    approach = approach_heading(signals.heading, round(execute), dt)
    marks = execute_marks(found, execute, dt)
    change = signals.heading - approach
    if found.kind is ManoeuvreKind.TURNING_CIRCLE:
        marks += _turn_marks(np.abs(change[: found.end]), execute, dt)
    if found.kind is ManoeuvreKind.ZIGZAG:
        marks += [
            ManoeuvreMark(f"overshoot {k}", (at - execute) * dt)
            for k, at in enumerate(overshoot_samples(found, change), 1)
        ]
    return ManoeuvreSpan(
        number=number,
        kind=found.kind,
        title=part.title(),
        start_secs=part.offset_secs,
        execute_secs=execute_secs,
        end_secs=min(found.end, len(signals) - 1) * dt,
        approach_heading=approach,
        marks=tuple(sorted(marks, key=lambda mark: mark.time_secs)),
    )


def _turn_marks(turned: FloatArray, execute: float, dt: float) -> list[ManoeuvreMark]:
    """Return the instants at which the heading has changed by each of `TURN_MARKS`."""
    first = max(0, round(execute))
    crossings = {angle: first + first_crossing(turned[first:], angle) for angle in TURN_MARKS}
    return [
        ManoeuvreMark(f"{degrees(angle):.0f}°", (at - execute) * dt)
        for angle, at in crossings.items()
        if np.isfinite(at)
    ]
