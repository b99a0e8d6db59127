"""Options of a trial's analysis: the start rule, the antenna's place, and assumed errors."""

from dataclasses import dataclass
from math import radians

from analysis.manoeuvres.start_rules import StartRule


@dataclass(frozen=True)
class TrialOptions:
    """How the manoeuvres of a log are analysed.

    Attributes
    ----------
    start_rule
        Where a manoeuvre begins: at the rudder order, when the rudder has moved by
        `moved_angle`, at a marked event, or at the times stated.
    moved_angle
        Of the rule ``moved``, rad.
    execute_secs
        Of the rule ``stated``: the executes, s since the log's first instant; each holds for the
        manoeuvre whose rudder moves next.
    antenna_forward, antenna_starboard
        Place of the position's antenna from the midship point, m.
    test_speed
        V of the norm, m/s; by default what the log states, or else the mean of the approaches.
    compass_bias_std
        Assumed standard deviation of a constant error of the heading, rad.
    compass_change_std
        Assumed standard deviation of the compass's error in a change of heading from the approach,
        rad; None takes that of the vessel file or, without one, the 0.25° times the secant of the
        latitude that IMO A.821(19), 4.1.2, permits as the root mean square of the differences of
        ten settled headings, 20 minutes apart, from their mean.
    speed_scale_std
        Assumed standard deviation of the scale error of the speed through the water.
    current_std
        Assumed standard deviation of each component of a current that the log does not
        determine, m/s.
    """

    start_rule: StartRule = StartRule.ORDER
    moved_angle: float = radians(0.5)
    execute_secs: tuple[float, ...] = ()
    antenna_forward: float = 0.0
    antenna_starboard: float = 0.0
    test_speed: float | None = None
    compass_bias_std: float = radians(0.5)
    compass_change_std: float | None = None
    speed_scale_std: float = 0.02
    current_std: float = 0.25


DEFAULT_TRIAL_OPTIONS = TrialOptions()
