"""The examples of the papers as logs, estimated by their methods.

    python examples/paper_logs.py FOLDER

simulates a log for each system file of `examples/papers/systems`, writes it to FOLDER, estimates
the system from it and prints the gain. The same from the command line:

    shiplog estimate FOLDER/gust.mcap --system examples/papers/systems/gust.toml -o gust.rrd
"""

import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from analysis import estimate
from shiplog import Channel, TrialLog, write
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE

SYSTEMS = Path(__file__).parent / "papers" / "systems"
DT_SECS, SUBSTEPS = 0.1, 10
START_NS = 1_700_000_000 * 10**9


def log_of(name: str, **values: FloatArray) -> TrialLog:
    """Return a log of channels of 10 Hz, by name."""
    channels = []
    for channel, samples in values.items():
        times = START_NS + np.round(np.arange(len(samples)) * DT_SECS * 1e9).astype(np.int64)
        unit = CATALOGUE[channel].unit if channel in CATALOGUE else "1"
        channels.append(Channel(channel, "simulated", unit, times, times, samples))
    return TrialLog(f"{name}.mcap", tuple(channels))


def driven(A: FloatArray, noise: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Simulate x' = A x + white noise of intensity noise²: (count, n)."""
    h = DT_SECS / SUBSTEPS
    F, x, states = expm(A * h), np.zeros(len(A)), np.empty((count, len(A)))
    for k in range(count):
        states[k] = x
        for _ in range(SUBSTEPS):
            x = F @ x + noise * np.sqrt(h) * rng.standard_normal(len(A))
    return states


def gust(rng: np.random.Generator) -> tuple[TrialLog, FloatArray]:
    """Simulate the aircraft in gusts; return the log and the gust, (n,)."""
    T, count = 3.49, 4000
    A = np.array([[-1.02, 0.91], [0.82, -1.08]])
    Aw = np.array([[-2 / T, -1 / T**2], [1.0, 0.0]])
    Cw = 10 * np.sqrt(6 / T) * np.array([[1.0, 1 / (T * np.sqrt(3))]])
    whole = np.block([[A, np.array([[0.00203], [-0.00164]]) @ Cw], [np.zeros((2, 2)), Aw]])
    x = driven(whole, np.array([0.0, 0.0, 1.0, 0.0]), count, rng)
    noise = rng.standard_normal((count, 2)) / np.sqrt([20 * DT_SECS, 60 * DT_SECS])
    acceleration = x[:, :2] @ [15.87, 1.4811] + noise[:, 0]
    log = log_of(
        "gust",
        elevator_command=np.zeros(count),
        normal_acceleration=acceleration,
        pitch_rate=x[:, 1] + noise[:, 1],
    )
    return log, x[:, 2:] @ Cw[0]


def roll_moment(_: np.random.Generator) -> tuple[TrialLog, FloatArray]:
    """Simulate a ship at rest under the moment 0.25 Nm + 0.005 Nm/s t; return it, (n,)."""
    at = DT_SECS * np.arange(1001)
    rate = (0.25 * at + 5e-3 * at**2 / 2) / 1000
    return log_of("roll_moment", torque=np.zeros(1001), roll_rate=rate), 0.25 + 5e-3 * at


def spacecraft(_: np.random.Generator) -> tuple[TrialLog, FloatArray]:
    """Simulate a free rigid body; return its rates, (n, 3)."""
    inertia = np.array([2000.0, 3000.0, 2500.0])

    def rate(_: float, x: FloatArray) -> FloatArray:
        phi, theta, w = x[0], x[1], x[3:]
        turn = w[1] * np.sin(phi) + w[2] * np.cos(phi)
        across = w[1] * np.cos(phi) - w[2] * np.sin(phi)
        angles = [w[0] + np.tan(theta) * turn, across, turn / np.cos(theta)]
        return np.concatenate((angles, np.cross(inertia * w, w) / inertia))

    at, start = DT_SECS * np.arange(400), [0.1, -0.2, 0.3, 0.05, -0.04, 0.06]
    x = solve_ivp(rate, at[[0, -1]], start, "DOP853", at, rtol=1e-12, atol=1e-14).y.T
    return log_of("spacecraft", roll=x[:, 0], pitch=x[:, 1], heading=x[:, 2]), x[:, 3:]


def quality(rng: np.random.Generator) -> tuple[TrialLog, FloatArray]:
    """Simulate a yaw rate under random moments; return it, (n,)."""
    A, count = np.array([[0.0, 1.0], [-1 / 7500, -200 / 7500]]), 6000
    rate = driven(A, np.array([0.0, 1e-6]), count, rng)[:, 0]
    measured = rate + np.sqrt(2.5e-9 / DT_SECS) * rng.standard_normal(count)
    return log_of("quality", rudder=np.zeros(count), yaw_rate=measured), rate


SIMULATIONS = (gust, roll_moment, spacecraft, quality)


def main(folder: Path) -> None:
    """Simulate, write, estimate and print."""
    folder.mkdir(parents=True, exist_ok=True)
    for simulate in SIMULATIONS:
        log, _ = simulate(np.random.default_rng(5))
        write(log, folder / log.name)
        found = estimate(folder / log.name, SYSTEMS / f"{simulate.__name__}.toml")
        plan = found.findings.plan
        print(f"{plan.system.name}, by {plan.system.method.name}:")
        for state, row in zip(plan.states, plan.design.gain, strict=True):
            print(f"  L of {state}: {', '.join(f'{value:.8g}' for value in row)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
