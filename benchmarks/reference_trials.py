"""Trials of the reference ships: the logs to identify a ship from, and the manoeuvres to predict.

The ships are those of `examples/ships`, by their published equations, independent of the models of
shiplog. The logs have sensors; the manoeuvres to predict are exact.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import cos, pi, radians, sin

import numpy as np

from examples.ships.sea_trial import (
    GOOD,
    POOR,
    SHIPS,
    STEP,
    SailedTrial,
    Sensors,
    Steering,
    TrialShip,
    as_log,
    sail,
)
from examples.ships.true_indices import circle_indices, zigzag_indices
from shiplog import TrialLog

ZIGZAGS_DEG = (10.0, 20.0)
CIRCLE_DEG = 35.0
SIDES = {"starboard": 1.0, "port": -1.0}
LOG_SECS = 600.0
APPROACH_SECS = 60.0  # in the logs, before the execute
HELM_DEG, HELM_PERIOD_SECS = 0.5, (30.0, 60.0)
LEAD_SECS = 12.0  # on a straight course before the execute of a manoeuvre to predict
CIRCLE_LENGTHS, ZIGZAG_LENGTHS = 40.0, 25.0  # ship lengths at the approach speed
CIRCLE_INDICES = (
    "advance", "transfer", "tactical diameter", "time to 90°", "time to 180°", "steady yaw rate",
    "steady speed",
)  # fmt: skip
OVERSHOOTS = 2  # of each zig-zag that are predicted


@dataclass(frozen=True)
class Setting:
    """The sensors and the sea of a set of logs.

    Attributes
    ----------
    title
        Describes the setting.
    sensors
        Noise and intervals.
    current
        Speed of a constant current, m/s; its direction is random.
    log_scale_std, gyro_bias_std, compass_bias_std
        Standard deviations of constant errors that all logs of a ship have in common: of the log,
        relative; of the yaw rate, rad/s; of the heading, rad.
    """

    title: str
    sensors: Sensors
    current: float = 0.0
    log_scale_std: float = 0.0
    gyro_bias_std: float = 0.0
    compass_bias_std: float = 0.0


SETTINGS = {
    "no sway": Setting("no sway sensor, GNSS of 1 m", GOOD),
    "sway": Setting("with a sway sensor", replace(GOOD, sway=0.05)),
    "current": Setting("no sway sensor, in a current of 0.5 m/s", GOOD, current=0.5),
    "poor": Setting(
        "no sway sensor, poor sensors", POOR, log_scale_std=0.01,
        gyro_bias_std=radians(0.01), compass_bias_std=radians(0.5),
    ),
}  # fmt: skip
SHIP_NAMES = tuple(ship.name for ship in SHIPS)


@dataclass(frozen=True, eq=False)
class ExactManoeuvre:
    """A manoeuvre to predict, sailed without sensors.

    Attributes
    ----------
    name
        Kind, angles and side.
    trial
        The exact motion, beginning `LEAD_SECS` before the execute on a straight course.
    steering
        The orders; with a switch heading it is a zig-zag.
    indices
        The true values of `CIRCLE_INDICES`, or of the first overshoots, SI.
    """

    name: str
    trial: SailedTrial
    steering: Steering
    indices: dict[str, float]


def reference_ship(name: str) -> TrialShip:
    """Return a reference ship by its name."""
    return next(ship for ship in SHIPS if ship.name == name)


def zigzag_logs(
    ship: TrialShip, setting: Setting, seed: int, secs: float, interval: float | None = None
) -> list[TrialLog]:
    """Simulate zig-zags 10/10 and 20/20, begun to either side, as sensors record them.

    Parameters
    ----------
    ship, setting
        The ship, its sensors and the sea.
    seed
        Of the noise, the courses, the helm in the approach, and the constant errors of the sensors.
    secs
        Duration of each log, s.
    interval
        Between samples, s, where not that of the setting.
    """
    rng = np.random.default_rng([seed, SHIP_NAMES.index(ship.name)])
    sensors = replace(
        setting.sensors,
        interval=interval or setting.sensors.interval,
        speed_scale=rng.normal(0.0, setting.log_scale_std),
        gyro_bias=rng.normal(0.0, setting.gyro_bias_std),
        compass_bias=rng.normal(0.0, setting.compass_bias_std),
    )
    direction = rng.uniform(-pi, pi)
    current = setting.current * cos(direction), setting.current * sin(direction)
    logs = []
    for angle in ZIGZAGS_DEG:
        for side_name, side in SIDES.items():
            steering = Steering(
                ship, APPROACH_SECS, side * radians(angle), radians(angle),
                course=rng.uniform(-pi, pi), helm=radians(HELM_DEG),
                helm_period=rng.uniform(*HELM_PERIOD_SECS), phase=rng.uniform(0.0, 2 * pi),
            )  # fmt: skip
            trial = sail(ship, steering, secs, course=steering.course)
            name = f"{ship.name} {angle:.0f}/{angle:.0f} {side_name}.mcap"
            logs.append(as_log(trial, sensors, rng, current, name=name))
    return logs


def exact_manoeuvres(ship: TrialShip) -> Iterator[ExactManoeuvre]:
    """Yield the 35° circles and the zig-zags 10/10 and 20/20 to both sides, with true indices."""
    secs_per_length = ship.length / ship.speed
    for side_name, side in SIDES.items():
        steering = Steering(ship, LEAD_SECS, side * radians(CIRCLE_DEG))
        trial = sail(ship, steering, LEAD_SECS + CIRCLE_LENGTHS * secs_per_length)
        values = circle_indices(trial.turn(steering))
        indices = {name: values[name] for name in CIRCLE_INDICES}
        yield ExactManoeuvre(f"circle {side_name}", trial, steering, indices)
    for angle in ZIGZAGS_DEG:
        for side_name, side in SIDES.items():
            steering = Steering(ship, LEAD_SECS, side * radians(angle), radians(angle))
            trial = sail(ship, steering, LEAD_SECS + ZIGZAG_LENGTHS * secs_per_length)
            first = round(LEAD_SECS / STEP)
            executes = [round(time / STEP) - first for time in steering.executes]
            values = zigzag_indices(trial.turn(steering), radians(angle), executes)
            names = [f"overshoot {number}" for number in range(1, OVERSHOOTS + 1)]
            yield ExactManoeuvre(
                f"{angle:.0f}/{angle:.0f} {side_name}", trial, steering,
                {name: values.get(name, np.nan) for name in names},
            )  # fmt: skip
