"""Sea trials of ships by their published equations: helmsman, steering gear, sensors, current.

The ships know nothing of shiplog; only `as_log` makes a log of a trial, as a recorder would.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from shiplog import Channel, TrialLog

from . import container_ship, esso_tanker, mariner
from .mmg import KVLCC2, SEIUN_MARU, MmgShip
from .true_indices import Turn, turn_from_execute

STEP = 0.25  # s, of the integration and of the true motion
START_NS = 1_767_225_600 * 10**9
Motion = tuple[float, ...]  # speed ahead, sway, yaw rate, and further states a ship may have
Rates = Callable[[Motion, float, float], Motion]
Helmsman = Callable[[float, float, float, float], float]  # time, heading, yaw rate, rudder


@dataclass(frozen=True)
class TrialShip:
    """A ship that can be sailed: its equations, and what its helmsman needs to know.

    `further` are the initial values of the states after the yaw rate, on a straight course; `shaft`
    is the place in the motion of the revolutions of a shaft with dynamics, None without them.
    """

    name: str
    length: float
    speed: float
    rpm: float
    rudder_rate: float
    neutral: float
    rates: Rates
    further: Motion = ()
    shaft: int | None = None


def _mmg(name: str, ship: MmgShip) -> TrialShip:
    rate = radians(ship.rudder_rate_deg)
    return TrialShip(name, ship.length, ship.speed, ship.rpm, rate, 0.0, ship.rates)


SHIPS = (
    TrialShip(
        "mariner", mariner.LENGTH, mariner.SPEED, mariner.RPM, radians(mariner.RUDDER_RATE_DEG),
        radians(-1.1), mariner.rates,
    ),
    _mmg("kvlcc2", KVLCC2),
    _mmg("seiun-maru", SEIUN_MARU),
    TrialShip(
        "container", container_ship.LENGTH, container_ship.SPEED, container_ship.RPM,
        radians(container_ship.RUDDER_RATE_DEG), 0.0, container_ship.rates,
        further=(0.0, 0.0, container_ship.RPM), shaft=5,
    ),
    TrialShip(
        "tanker", esso_tanker.LENGTH, esso_tanker.SPEED, esso_tanker.RPM,
        radians(esso_tanker.RUDDER_RATE_DEG), radians(0.5), esso_tanker.rates,
    ),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class SailedTrial:
    """The true motion of a trial, sampled every `STEP`."""

    ship: TrialShip
    time: NDArray[np.float64]
    speed: NDArray[np.float64]
    sway: NDArray[np.float64]
    yaw_rate: NDArray[np.float64]
    heading: NDArray[np.float64]
    rudder: NDArray[np.float64]
    order: NDArray[np.float64]
    rpm: NDArray[np.float64]
    track: NDArray[np.float64]  # (n, 2) north and east through the water

    def turn(self, steering: "Steering") -> Turn:
        """Return the motion from the execute of the manoeuvre on."""
        return turn_from_execute(
            STEP,
            round(steering.execute / STEP),
            float(np.sign(steering.angle)),
            steering.course,
            self.heading,
            np.column_stack((self.speed, self.sway, self.yaw_rate)),
            self.track,
        )


def sail(
    ship: TrialShip,
    helmsman: Helmsman,
    duration: float,
    *,
    course: float = 0.0,
    revolutions: Callable[[float], float] | None = None,
    speed: float | None = None,
) -> SailedTrial:
    """Sail a ship for a time, s, from a straight course, by the orders of a helmsman."""
    count = round(duration / STEP) + 1
    rows = np.empty((count, 9))
    motion: Motion = (ship.speed if speed is None else speed, 0.0, 0.0, *ship.further)
    heading, north, east = course, 0.0, 0.0
    rudder = ship.neutral
    for k in range(count):
        time = k * STEP
        rpm = ship.rpm if revolutions is None else revolutions(time)
        order = helmsman(time, heading, motion[2], rudder)
        turned = rpm if ship.shaft is None else motion[ship.shaft]
        rows[k] = (*motion[:3], heading, rudder, order, turned, north, east)
        moved = max(-1.0, min(1.0, (order - rudder) / (ship.rudder_rate * STEP)))
        rudder += moved * ship.rudder_rate * STEP
        before, heading_before = motion, heading
        motion = _advanced(ship.rates, motion, rudder, rpm)
        heading += (before[2] + motion[2]) / 2 * STEP
        u, v = (before[0] + motion[0]) / 2, (before[1] + motion[1]) / 2
        middle = (heading + heading_before) / 2
        north += (u * cos(middle) - v * sin(middle)) * STEP
        east += (u * sin(middle) + v * cos(middle)) * STEP
    columns = rows.T
    return SailedTrial(ship, np.arange(count) * STEP, *columns[:3], *columns[3:7], columns[7:].T)


def _advanced(rates: Rates, motion: Motion, rudder: float, rpm: float) -> Motion:
    """Return the motion after `STEP`, by the classical Runge-Kutta method."""

    def moved(slope: Motion, share: float) -> Motion:
        return tuple(m + share * STEP * s for m, s in zip(motion, slope, strict=True))

    k1 = rates(motion, rudder, rpm)
    k2 = rates(moved(k1, 0.5), rudder, rpm)
    k3 = rates(moved(k2, 0.5), rudder, rpm)
    k4 = rates(moved(k3, 1.0), rudder, rpm)
    slopes = zip(k1, k2, k3, k4, strict=True)
    return moved(tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in slopes), 1.0)


@dataclass
class Steering:
    """A helmsman who keeps the course with small helm until the execute, then sails a manoeuvre.

    After `execute` the rudder is `angle`; with `switch` it is reversed whenever the heading has
    changed by `switch` to its side, and from `ends` on it is neutral. All angles in rad.
    """

    ship: TrialShip
    execute: float
    angle: float
    switch: float | None = None
    course: float = 0.0
    helm: float = 0.0
    helm_period: float = 50.0
    phase: float = 0.0
    ends: float = np.inf
    side: float = field(init=False)
    executes: list[float] = field(init=False)

    def __post_init__(self) -> None:
        self.side = float(np.sign(self.angle))
        self.executes = []

    def __call__(self, time: float, heading: float, yaw_rate: float, _rudder: float) -> float:
        """Return the rudder ordered."""
        if time < self.execute:
            keep = -1.0 * (heading - self.course) - 15.0 * yaw_rate
            wave = sin(2 * pi * time / self.helm_period + self.phase)
            return self.ship.neutral + max(-0.15, min(0.15, keep)) + self.helm * wave
        if time >= self.ends:
            return self.ship.neutral
        change = heading - self.course
        if self.switch is not None and self.side * change >= self.switch:
            self.side = -self.side
            self.executes.append(time)
        return self.side * abs(self.angle)


@dataclass(frozen=True)
class Sensors:
    """Errors of the sensors: standard deviations of white noise, biases, and sampling.

    `sway` is the noise of a log with two axes; None for one that measures the speed ahead alone.
    """

    interval: float = 0.5
    heading: float = radians(0.1)
    yaw_rate: float = radians(0.02)
    speed: float = 0.05
    rudder: float = radians(0.1)
    position: float = 1.0
    sway: float | None = None
    compass_bias: float = 0.0
    speed_scale: float = 0.0
    gyro_bias: float = 0.0
    rudder_zero: float = 0.0
    compass_deflection: float = 0.0  # from `deflected_at`, s, within `DEFLECTION_SECS`
    deflected_at: float = 0.0


DEFLECTION_SECS = 10.0
GOOD = Sensors()
POOR = Sensors(1.0, radians(0.3), radians(0.05), 0.15, radians(0.3), 3.0)


def as_log(
    trial: SailedTrial,
    sensors: Sensors,
    rng: np.random.Generator,
    current: tuple[float, float] = (0.0, 0.0),
    *,
    name: str = "trial.mcap",
    without: tuple[str, ...] = (),
    orders: bool = False,
) -> TrialLog:
    """Return the log that sensors make of a trial in a current north and east, m/s."""
    at = np.arange(rng.uniform(0.0, min(sensors.interval, STEP)), trial.time[-1], sensors.interval)
    ground = trial.track + np.outer(trial.time, current)

    def sampled(values: NDArray[np.float64], std: float) -> NDArray[np.float64]:
        return np.interp(at, trial.time, values) + rng.normal(0.0, std, len(at))

    share = np.clip((trial.time - sensors.deflected_at) / DEFLECTION_SECS, 0.0, 1.0)
    shown = trial.heading + sensors.compass_bias + sensors.compass_deflection * share
    heading = sampled(shown, sensors.heading) % (2 * pi)
    columns = {
        "yaw_rate": ("rad/s", sampled(trial.yaw_rate + sensors.gyro_bias, sensors.yaw_rate)),
        "speed": ("m/s", sampled(trial.speed * (1 + sensors.speed_scale), sensors.speed)),
        "rudder": ("rad", sampled(trial.rudder + sensors.rudder_zero, sensors.rudder)),
        "rpm": ("rpm", sampled(trial.rpm, 0.1)),
        "heading": ("rad", heading),
    }
    if orders:
        before = np.searchsorted(trial.time, at, side="right") - 1
        columns["rudder_order"] = ("rad", trial.order[before])
    if sensors.sway is not None:
        columns["sway"] = ("m/s", sampled(trial.sway, sensors.sway))
    fixes = np.column_stack([sampled(column, sensors.position) for column in ground.T])
    times = START_NS + np.round(at * 1e9).astype(np.int64)
    channels = [
        Channel(key, "bridge", unit, times, times, values)
        for key, (unit, values) in columns.items()
        if key not in without
    ]
    if "position" not in without:
        channels.append(Channel("position", "bridge", "m", times, times, fixes, ("north", "east")))
    return TrialLog(name, tuple(channels))
