"""A manoeuvre found in a log: what was sailed, its time histories, and its indices."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from shiplog.types import FloatArray

from .trial_index import TrialIndex


class ManoeuvreKind(StrEnum):
    """The kinds of manoeuvres that are detected."""

    TURNING_CIRCLE = "turning circle"
    ZIGZAG = "zig-zag"
    INITIAL_TURNING = "initial turning"
    PULL_OUT = "pull-out"
    DIRECT_SPIRAL = "direct spiral"
    REVERSE_SPIRAL = "reverse spiral"
    STOPPING = "stopping"
    ACCELERATION = "acceleration"
    SPEED_RUN = "speed run"
    STRAIGHT = "straight"


@dataclass(frozen=True)
class NotComputed:
    """What could not be computed, and why.

    Attributes
    ----------
    subject
        Such as ``tactical diameter`` or ``manoeuvre at 12:03:10``.
    reason
        In a phrase, such as ``the heading changes by 140° only``.
    """

    subject: str
    reason: str


@dataclass(frozen=True)
class ManoeuvreMark:
    """An instant of a manoeuvre to be marked in its figures.

    Attributes
    ----------
    label
        Such as ``execute 2``, ``90°`` or ``overshoot 1``.
    time_secs
        From the execute, s.
    """

    label: str
    time_secs: float


def _no_values() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class ManoeuvreSeries:
    """The time histories of a manoeuvre, from some time before its execute to its end.

    All have n samples; NaN where not measured; empty where the log lacks the channel.

    Attributes
    ----------
    time_secs
        (n,) from the execute, s; negative in the approach.
    rudder, rudder_order
        (n,) positive to starboard, rad.
    heading_change
        (n,) from the approach heading, continuous, positive to starboard, rad.
    yaw_rate
        (n,) rad/s.
    speed
        (n,) ahead through the water, m/s.
    drift
        (n,) drift angle, positive where the bow points into the turn to starboard, rad.
    rpm
        (n,) propeller revolutions, per minute.
    track
        (n, 2) of the midship point from its place at the execute: ahead along the approach
        heading and to starboard of it, corrected for the current, m.
    """

    time_secs: FloatArray
    rudder: FloatArray = field(default_factory=_no_values)
    rudder_order: FloatArray = field(default_factory=_no_values)
    heading_change: FloatArray = field(default_factory=_no_values)
    yaw_rate: FloatArray = field(default_factory=_no_values)
    speed: FloatArray = field(default_factory=_no_values)
    drift: FloatArray = field(default_factory=_no_values)
    rpm: FloatArray = field(default_factory=_no_values)
    track: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True, eq=False)
class SailedManoeuvre:
    """A manoeuvre found in a log.

    Attributes
    ----------
    number
        Its number in the log, from 1.
    kind
        What it is.
    title
        Such as ``zig-zag 10°/10°, first to starboard``.
    start_secs, execute_secs, end_secs
        Of the manoeuvre with its approach, from the log's first instant, s.
    side
        ``starboard``, ``port`` or empty: of the first order.
    rudder
        The angle ordered, signed as the first order, rad; NaN where there is none.
    switch_heading
        Of a zig-zag, the change of heading at which the rudder is reversed, rad; else NaN.
    start_rule
        The rule by which the execute was found.
    approach_heading, approach_speed, approach_rpm, approach_yaw_rate
        Means over the approach: rad, m/s, per minute, rad/s; NaN where not measured.
    neutral_rudder
        The rudder angle that keeps the ship straight in the approach: zero of the sensor, or trim
        of the ship, rad.
    series
        For the figures.
    marks
        Instants to be marked.
    indices
        With intervals and verdicts.
    spiral
        (k, 2) rudder, rad, and steady yaw rate, rad/s, in the order sailed; of spirals only.
    not_computed
        Indices that could not be computed.
    notes
        What was assumed, each in a sentence.
    """

    number: int
    kind: ManoeuvreKind
    title: str
    start_secs: float
    execute_secs: float
    end_secs: float
    side: str
    rudder: float
    switch_heading: float
    start_rule: str
    approach_heading: float
    approach_speed: float
    approach_rpm: float
    approach_yaw_rate: float
    neutral_rudder: float
    series: ManoeuvreSeries
    marks: tuple[ManoeuvreMark, ...] = ()
    indices: tuple[TrialIndex, ...] = ()
    spiral: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    not_computed: tuple[NotComputed, ...] = ()
    notes: tuple[str, ...] = ()

    def index(self, name: str) -> TrialIndex | None:
        """Return the index of a name; None where it was not computed."""
        return next((each for each in self.indices if each.name == name), None)
