"""Trials of independent ships, sailed once per process, and their true indices."""

from functools import cache
from math import radians

from ships.sea_trial import SHIPS, STEP, SailedTrial, Steering, TrialShip, sail
from ships.true_indices import circle_indices, zigzag_indices

SECONDS = {
    "circle": {"mariner": 900.0, "kvlcc2": 1200.0, "seiun-maru": 420.0},
    "zigzag": {"mariner": 400.0, "kvlcc2": 700.0, "seiun-maru": 320.0},
}
EXECUTE_SECS = 90.0
CIRCLE_INDICES = ("time to 90°", "advance", "transfer", "time to 180°", "tactical diameter")


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
    """Compute the indices of the true motion, from the order and the course steered."""
    turn, first = trial.turn(steering), round(steering.execute / STEP)
    if steering.switch is None:
        return {name: circle_indices(turn)[name] for name in CIRCLE_INDICES}
    executes = [round(time / STEP) - first for time in steering.executes]
    values = zigzag_indices(turn, steering.switch, executes)
    return {name: value for name, value in values.items() if name.startswith("overshoot")}
