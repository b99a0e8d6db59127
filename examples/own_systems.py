"""Plants of one's own, estimated from a log: roll, speed and thrust, an autopilot's heading loop.

    python examples/own_systems.py FOLDER

simulates a log for each system file of `examples/systems`, writes it to FOLDER, estimates the
system from it and prints how accurate the estimates are. The same from the command line:

    shiplog estimate FOLDER/roll.mcap --system examples/systems/roll.toml -o roll.rrd
"""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from analysis import estimate
from analysis.linear.estimate import SystemEstimate
from shiplog import Channel, TrialLog, write
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE

SYSTEMS = Path(__file__).parent / "systems"
COUNT, DT_SECS = 6000, 0.2
START_NS = 1_700_000_000 * 10**9
SUBSTEPS = 10  # of white noise in a sampling interval
SETTLED = 1500  # samples after which initial errors have decayed


@dataclass(frozen=True, eq=False)
class Simulated:
    """A simulated log, and the true values of what is estimated from it, (n,) by name."""

    log: TrialLog
    truth: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Accuracy:
    """Accuracy of an estimate after the transient.

    Attributes
    ----------
    system, quantity, unit
        The system file, and the quantity.
    error
        Rms error of the estimate.
    sensor
        Rms error of the sensor of the same quantity; NaN where there is none.
    within
        Share of errors within two standard deviations.
    """

    system: str
    quantity: str
    unit: str
    error: float
    sensor: float
    within: float


def motion(
    A: FloatArray, B: FloatArray, u: FloatArray, noise_std: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Simulate x' = A x + B u + w, u (n, r) linear between samples, w white of noise_std²."""
    n, h = len(A), DT_SECS / SUBSTEPS
    whole = expm(np.block([[A, B], [np.zeros((B.shape[1], n + B.shape[1]))]]) * h)
    F, G = whole[:n, :n], whole[:n, n:]
    states, x = np.empty((len(u), n)), np.zeros(n)
    changes = np.diff(u, axis=0, append=u[-1:])
    for k in range(len(u)):
        states[k] = x
        for share in (np.arange(SUBSTEPS) + 0.5) / SUBSTEPS:
            middle = u[k] + share * changes[k]
            x = F @ x + G @ middle + noise_std * np.sqrt(h) * rng.standard_normal(n)
    return states


def as_channel(name: str, values: FloatArray) -> Channel:
    """Return a channel of the simulation, in the unit of the catalogue."""
    times = START_NS + np.round(np.arange(len(values)) * DT_SECS * 1e9).astype(np.int64)
    return Channel(name, "simulated", CATALOGUE[name].unit, times, times, values)


def orders(period_secs: float, size: float) -> FloatArray:
    """Return a square wave, (n,)."""
    at = np.arange(COUNT) * DT_SECS
    return size * np.sign(np.sin(2 * np.pi * at / period_secs + 1e-9))


def roll(rng: np.random.Generator) -> Simulated:
    """Simulate a ship that rolls in waves, with a list of 2°."""
    wave = np.array([[-0.12, -0.36], [1.0, 0.0]])  # 0.6 rad/s, damping ratio 0.1
    gain = np.sqrt(4 * 0.1 * 0.6) * 0.004  # rad/s² rms
    A = np.block(
        [[np.array([[-0.05, -0.25], [1.0, 0.0]]), np.zeros((2, 2))], [np.zeros((2, 2)), wave]]
    )
    A[0, 2] = gain
    u = np.full((COUNT, 1), 0.25 * np.radians(2))
    x = motion(A, np.eye(4, 1), u, np.array([0.0, 0.0, 1.0, 0.0]), rng)
    heel = x[:, 1] + np.radians(0.1) * rng.standard_normal(COUNT)
    truth = {
        "roll": x[:, 1],
        "roll_rate": x[:, 0],
        "wave moment": gain * x[:, 2],
        "heeling moment": u[:, 0],
    }
    return Simulated(TrialLog("roll.mcap", (as_channel("heel", heel),)), truth)


def speed_and_thrust(rng: np.random.Generator) -> Simulated:
    """Simulate changes of the revolutions in a head wind."""
    A, B = np.array([[-0.01, 2e-5], [0.0, -0.2]]), np.array([[0.0, 1.0], [2.0, 0.0]])
    rpm, wind = 60 + orders(600.0, 20.0), np.full(COUNT, -2e-3)
    noise = np.sqrt([1e-7, 20.0])
    x = motion(A, B, np.column_stack((rpm, wind)), noise, rng)
    channels = (
        as_channel("rpm", rpm),
        as_channel("speed", x[:, 0] + 0.05 * rng.standard_normal(COUNT)),
        as_channel("thrust", 1e3 * (x[:, 1] + 20.0 * rng.standard_normal(COUNT))),
    )
    truth = {"speed": x[:, 0], "thrust": x[:, 1], "resistance of wind": wind}
    return Simulated(TrialLog("speed_and_thrust.mcap", channels), truth)


def heading_loop(rng: np.random.Generator) -> Simulated:
    """Simulate an autopilot that changes the heading, with a biased gyro and a yaw moment."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, -1 / 30, 0.08 / 30], [-0.6, -8.0, -0.4]])
    B = np.array([[0.0, 0.0], [0.0, 1.0], [0.6, 0.0]])
    order, moment, bias = orders(400.0, 0.1), np.full(COUNT, 2e-5), 2e-4
    x = motion(A, B, np.column_stack((order, moment)), np.sqrt([0.0, 1e-9, 0.0]), rng)
    noise = rng.standard_normal((COUNT, 3)) * [0.002, 1e-4, 0.003]
    channels = (
        as_channel("heading_order", order),
        as_channel("heading", x[:, 0] + noise[:, 0]),
        as_channel("yaw_rate", x[:, 1] + bias + noise[:, 1]),
        as_channel("rudder", x[:, 2] + noise[:, 2]),
    )
    truth = {
        "heading": x[:, 0],
        "yaw_rate": x[:, 1],
        "rudder": x[:, 2],
        "gyro bias": np.full(COUNT, bias),
        "yaw moment": moment,
    }
    return Simulated(TrialLog("heading_loop.mcap", channels), truth)


def heading_regulator(rng: np.random.Generator) -> Simulated:
    """Simulate a helmsman who steers by a rudder that moves too far and too late."""
    A = np.array([[-1 / 30, 0.0], [1.0, 0.0]])
    B, h = np.array([[0.08 / 30], [0.0]]), DT_SECS / SUBSTEPS
    F, x, turned = expm(A * h), np.zeros(2), np.zeros((COUNT, 2))
    rudder = np.zeros(COUNT)
    for k in range(COUNT):
        turned[k] = x
        late = turned[max(k - 25, 0)]  # 5 s ago
        rudder[k] = np.clip(-0.8 * late[1] - 20 * late[0], -0.3, 0.3)
        for _ in range(SUBSTEPS):
            noise = np.sqrt([1e-9 * h, 1e-10 * h]) * rng.standard_normal(2)
            x = F @ x + h * B[:, 0] * rudder[k] + noise
    noise = rng.standard_normal((COUNT, 2)) * [1e-4, 0.002]
    channels = (
        as_channel("rudder", rudder),
        as_channel("yaw_rate", turned[:, 0] + noise[:, 0]),
        as_channel("heading", turned[:, 1] + noise[:, 1]),
    )
    truth = {"yaw_rate": turned[:, 0], "heading": turned[:, 1]}
    return Simulated(TrialLog("heading_regulator.mcap", channels), truth)


SIMULATIONS = (roll, speed_and_thrust, heading_loop, heading_regulator)


def accuracies(simulated: Simulated, found: SystemEstimate) -> Iterator[Accuracy]:
    """Compare the estimates of a system with the truth."""
    plan, name = found.findings.plan, found.findings.plan.system.name
    outputs = [output.binding.name for output in plan.outputs]
    for quantity in plan.quantities:
        true = simulated.truth[quantity.name][: len(found.time_secs)]
        error = (found[quantity.name] - true)[SETTLED:]
        sensor = np.nan
        if quantity.name in outputs:
            measured = found.chunk.measured[:, outputs.index(quantity.name)]
            sensor = float(np.sqrt(np.nanmean((measured - true)[SETTLED:] ** 2)))
        within = np.mean(np.abs(error) < 2 * found.std(quantity.name)[SETTLED:])
        rms = float(np.sqrt(np.mean(error**2)))
        yield Accuracy(name, quantity.name, quantity.unit, rms, sensor, float(within))


def main(folder: Path) -> None:
    """Simulate, write, estimate and print."""
    folder.mkdir(parents=True, exist_ok=True)
    for simulate in SIMULATIONS:
        simulated = simulate(np.random.default_rng(1))
        write(simulated.log, folder / simulated.log.name)
        found = estimate(folder / simulated.log.name, SYSTEMS / f"{simulate.__name__}.toml")
        print(f"{found.findings.plan.system.name}, by {found.findings.plan.system.method.name}:")
        for each in accuracies(simulated, found):
            sensor = "" if np.isnan(each.sensor) else f" (sensor {each.sensor:.2g})"
            print(
                f"  {each.quantity}: rms error {each.error:.2g} {each.unit}{sensor},"
                f" {each.within:.0%} within 2σ"
            )
        costs = found.findings.costs
        if costs is not None:
            print(
                f"  mean cost: recorded {costs.recorded.total:.3g}, closed loop as predicted"
                f" {costs.predicted.total:.3g}"
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
