"""Zig-zags of the KVLCC2 by its published equations, and the fit of the MMG model to them."""

from functools import cache
from math import radians

import numpy as np

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.segment import Segment
from analysis.identification.runs import run_from_log
from analysis.replay.reading_options import ReadingOptions
from examples.ships.sea_trial import (
    SHIPS,
    SailedTrial,
    Sensors,
    Steering,
    TrialShip,
    as_log,
    sail,
)
from shiplog.ships import ship_model

EXECUTE_SECS, SECS = 60.0, 600.0
CURRENT = (0.3, -0.5)  # m/s north and east
SENSORS = Sensors(interval=2.0)


def tanker() -> TrialShip:
    """Return the KVLCC2 by the equations of Yasukawa and Yoshimura."""
    return next(ship for ship in SHIPS if ship.name == "kvlcc2")


@cache
def sailed(rudder_deg: float, switch_deg: float | None, secs: float = SECS) -> SailedTrial:
    """Return the true motion of a zig-zag, or of a turning circle."""
    switch = None if switch_deg is None else radians(switch_deg)
    steering = Steering(tanker(), EXECUTE_SECS, radians(rudder_deg), switch)
    return sail(tanker(), steering, secs)


@cache
def zigzag_segments(*, with_positions: bool = True) -> tuple[Segment, ...]:
    """Return the segments of zig-zags 10/10 and 20/20, in a current, without a sway sensor."""
    rng, segments = np.random.default_rng(1), []
    for angle in (10.0, 20.0):
        without = () if with_positions else ("position",)
        trial = sailed(angle, angle)
        log = as_log(trial, SENSORS, rng, CURRENT, name=f"zz{angle:.0f}.mcap", without=without)
        segments += run_from_log(log, ReadingOptions(length=tanker().length)).segments
    return tuple(segments)


@cache
def mmg_fit() -> OutputError:
    """Return the fit of the MMG model to the zig-zags."""
    return output_error(zigzag_segments(), ship_model("mmg"), length=tanker().length)
