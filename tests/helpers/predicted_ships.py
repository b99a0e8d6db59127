"""The Mariner identified from two zig-zags, with positions and without, each once per process."""

from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
from ships.sea_trial import SHIPS, Sensors, Steering, as_log, sail

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.replay.reading_options import ReadingOptions
from shiplog import TrialLog

MARINER = next(ship for ship in SHIPS if ship.name == "mariner")
MODEL = "slipstream"  # the fastest fit among the models with a drift
LOG_SECS, CIRCLE_SECS = 300.0, 400.0


@cache
def mariner_log(angle_deg: float, *, circle: bool = False) -> TrialLog:
    """Return a zig-zag or a turning circle to starboard, without a sway sensor."""
    angle = radians(angle_deg)
    steering = Steering(MARINER, 60.0, angle, None if circle else angle)
    trial = sail(MARINER, steering, CIRCLE_SECS if circle else LOG_SECS, course=0.0)
    rng = np.random.default_rng(round(angle_deg))
    name = f"{'circle' if circle else 'zigzag'}-{angle_deg:.0f}.mcap"
    return as_log(trial, replace(Sensors(), interval=2.0), rng, name=name, without=("sway",))


def without_position(log: TrialLog) -> TrialLog:
    """Return a log without its positions."""
    return replace(log, channels=tuple(c for c in log.channels if c.name != "position"))


@cache
def ship_with_positions() -> IdentifiedShip:
    """Return the ship identified with positions, its length given."""
    logs = [mariner_log(10.0), mariner_log(20.0)]
    return identify(logs, MODEL, options=ReadingOptions(length=MARINER.length))


@cache
def ship_without_positions() -> IdentifiedShip:
    """Return the ship identified without positions, its length not given; a circle is predicted."""
    logs = [without_position(mariner_log(each)) for each in (10.0, 20.0)]
    return identify(logs, MODEL, validation_logs=[mariner_log(35.0, circle=True)])
