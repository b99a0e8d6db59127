"""What the indices of a report assume, in sentences."""

from collections.abc import Iterator
from math import degrees

from analysis.manoeuvres.start_rules import StartRule
from analysis.trial.trial_options import TrialOptions

START_RULES = {
    StartRule.ORDER: "the rudder's order or, without a channel of orders, the beginning of its "
    "movement",
    StartRule.MOVED: "the rudder has moved by {angle:g}°",
    StartRule.EVENT: "the event in the log that marks it",
    StartRule.STATED: "the times stated, s from the start of the log: {times}",
}


def assumptions(options: TrialOptions) -> Iterator[str]:
    """Describe the start rule, the place of the antenna, and the errors that are assumed.

    Examples
    --------
    >>> list(assumptions(TrialOptions()))[1]
    'The antenna of the positions is at the midship point.'
    """
    rule = START_RULES[options.start_rule].format(
        angle=degrees(options.moved_angle),
        times=", ".join(f"{secs:g}" for secs in options.execute_secs),
    )
    yield f"Execute: {rule}. Time histories and indices count from it."
    forward, starboard = options.antenna_forward, options.antenna_starboard
    if forward or starboard:
        yield (
            f"The antenna of the positions is {forward:g} m forward and {starboard:g} m to "
            "starboard of the midship point; distances are those of the midship point."
        )
    else:
        yield "The antenna of the positions is at the midship point."
    given = options.compass_change_std
    compass = (
        "that of the vessel file or else 0.25° times the secant of the latitude (IMO A.821(19), "
        "4.1.2)"
        if given is None
        else f"{degrees(given):g}°"
    )
    yield (
        "Standard uncertainties that the log does not show: constant error of the heading "
        f"{degrees(options.compass_bias_std):g}°, slow error of the compass in a change of heading "
        f"{compass}, scale of the speed "
        f"{options.speed_scale_std * 100:g} %, each component of a current that the log does not "
        f"determine {options.current_std:g} m/s. Where the log has no orders, the time from an "
        "order to the rudder's movement is not known and counts as none."
    )
