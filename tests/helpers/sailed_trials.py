"""Trials of independent ships, sailed once per process, and their true indices."""

from functools import cache
from itertools import pairwise
from math import radians

import numpy as np
from ships.sea_trial import SHIPS, STEP, SailedTrial, Steering, TrialShip, sail

SECONDS = {
    "circle": {"mariner": 900.0, "kvlcc2": 1200.0, "seiun-maru": 420.0},
    "zigzag": {"mariner": 400.0, "kvlcc2": 700.0, "seiun-maru": 320.0},
}
EXECUTE_SECS = 90.0


@cache
def sailed_circle(
    ship: str, side: float = 1.0, helm_deg: float = 0.0
) -> tuple[SailedTrial, Steering]:
    """Sail a 35° turning circle, with helm in the approach."""
    return _sailed(_named(ship), "circle", side * radians(35.0), None, radians(helm_deg))


@cache
def sailed_zigzag(
    ship: str, angle_deg: float, side: float = 1.0, helm_deg: float = 0.0
) -> tuple[SailedTrial, Steering]:
    """Sail a zig-zag of equal rudder angle and switch heading, with helm in the approach."""
    angle = radians(angle_deg)
    return _sailed(_named(ship), "zigzag", side * angle, angle, radians(helm_deg))


def _named(name: str) -> TrialShip:
    return next(ship for ship in SHIPS if ship.name == name)


def _sailed(
    ship: TrialShip, kind: str, angle: float, switch: float | None, helm: float
) -> tuple[SailedTrial, Steering]:
    steering = Steering(ship, EXECUTE_SECS, angle, switch, course=0.7, helm=helm, helm_period=40.0)
    return sail(ship, steering, SECONDS[kind][ship.name], course=0.7), steering


def true_indices(trial: SailedTrial, steering: Steering) -> dict[str, float]:
    """Compute the indices of the true motion, from the order and the course steered.

    Written apart from the analysis: by the norm's definitions, on noise-free samples.
    """
    side, first = float(np.sign(steering.angle)), round(steering.execute / STEP)
    change = side * (trial.heading - steering.course)
    made = (trial.track @ [1, 1j] - trial.track[first] @ [1, 1j]) * np.exp(-1j * steering.course)
    grid = np.arange(len(change))
    values: dict[str, float] = {}
    if steering.switch is None:
        for angle in (90, 180):
            k = _crossing(change, np.radians(angle), first)
            values[f"time to {angle}°"] = (k - first) * STEP
            across = side * float(np.interp(k, grid, made.imag))
            if angle == 90:
                values |= {"advance": float(np.interp(k, grid, made.real)), "transfer": across}
            else:
                values["tactical diameter"] = across
        return values
    edges = [round(time / STEP) for time in steering.executes] + [len(change)]
    for number, (start, stop) in enumerate(pairwise(edges), 1):
        beyond = (1 if number % 2 else -1) * change[start:stop]
        values[f"overshoot {number}"] = float(np.max(beyond)) - steering.switch
    return values


def _crossing(values: np.ndarray, level: float, first: int) -> float:
    k = first + int(np.argmax(values[first:] >= level))
    return k - 1 + (level - values[k - 1]) / (values[k] - values[k - 1])
