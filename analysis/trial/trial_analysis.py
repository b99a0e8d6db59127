"""Results of a trial's analysis: conditions, manoeuvres, and the verdict on each criterion."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan

from analysis.manoeuvres.sailed_manoeuvre import NotComputed, SailedManoeuvre
from analysis.manoeuvres.trial_index import TrialIndex


@dataclass(frozen=True)
class CurrentEstimate:
    """The mean current of a trial.

    Attributes
    ----------
    north, east
        Velocity of the water over the ground, m/s.
    std
        Standard uncertainty of each component, m/s.
    method
        Such as ``pairs of fixes 360° apart in turn 2`` or ``ground and water speed``.
    """

    north: float
    east: float
    std: float
    method: str


@dataclass(frozen=True)
class TrialConditions:
    """Conditions of a trial, as the form of MSC/Circ.1053 asks for them.

    Attributes
    ----------
    ship
        The ship's name; empty where unknown.
    length
        Between perpendiculars, m; NaN where unknown.
    test_speed
        V of the norm: stated in the log, or else the mean of the approach speeds, m/s.
    test_speed_origin
        Where `test_speed` came from.
    stated
        What the log's metadata state, or else `[hull]` of the vessel file, by the name of the
        condition, such as ``{"water_depth": "60 m"}``; see `recorders.trial.conditions.CONDITIONS`.
    wind_speed, wind_direction
        Means of the log's true wind, m/s and rad, from which it blows; NaN without a sensor.
    current
        None where no manoeuvre determines it.
    """

    ship: str = ""
    length: float = nan
    test_speed: float = nan
    test_speed_origin: str = ""
    stated: Mapping[str, str] = field(default_factory=dict)
    wind_speed: float = nan
    wind_direction: float = nan
    current: CurrentEstimate | None = None

    @property
    def length_over_speed(self) -> float:
        """L/V, s, on which the limits of the 10/10 zig-zag depend; NaN where unknown."""
        return self.length / self.test_speed if self.test_speed > 0 else nan


@dataclass(frozen=True)
class CriterionFinding:
    """The verdict of a trial on one criterion of the norm.

    Attributes
    ----------
    name
        Such as ``advance``.
    text
        The limit as the norm gives it, such as ``4.5 L``.
    paragraph
        The norm and its paragraph.
    manoeuvre
        The number of the manoeuvre that decides: the one of the largest value; None where the
        criterion was not tested.
    index
        Its index, with value, interval, limit and verdict; None where not tested.
    side
        Of that manoeuvre.
    reason
        Why the criterion was not tested; else empty.
    """

    name: str
    text: str
    paragraph: str
    manoeuvre: int | None = None
    index: TrialIndex | None = None
    side: str = ""
    reason: str = ""


@dataclass(frozen=True, eq=False)
class TrialAnalysis:
    """What was sailed in a log, and what it shows of the ship.

    Attributes
    ----------
    name
        The name of the log.
    start_ns
        The log's first instant, to which the manoeuvres' times refer; ns since 1970-01-01 UTC.
    duration_secs
        Length of the log, s.
    conditions
        Ship, speed, wind, current, and what the log states.
    start_rule
        The rule by which executes were found.
    manoeuvres
        In the order sailed.
    criteria
        Every criterion of the norm, tested or not.
    not_computed
        What in the log is no manoeuvre, or lacks what an index needs, with the reason.
    warnings
        Problems of the data, each in a sentence.
    """

    name: str
    start_ns: int
    duration_secs: float
    conditions: TrialConditions
    start_rule: str
    manoeuvres: tuple[SailedManoeuvre, ...]
    criteria: tuple[CriterionFinding, ...]
    not_computed: tuple[NotComputed, ...] = ()
    warnings: tuple[str, ...] = ()
