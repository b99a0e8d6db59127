"""Simulated trials in a wind, sampled slowly so that they are cheap, and their replays."""

from dataclasses import replace
from functools import cache
from math import radians

from trial_logs import as_log

from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.wind import APPARENT_WIND, REFERENCE_WIND, WIND_SENSORS, Wind
from shiplog import TrialLog, load_vessel

GALE = Wind(12.0, radians(45))
SMOOTHED = {"filter.kind": "extended", "filter.smooth": True}
WINDY = SMOOTHED | {"disturbance.models": ["constant", "wind"]}
RATE = {f"{name}.rate_hz": 2.0 for name in ("yaw_rate", "speed", "rudder", "rpm", *APPARENT_WIND)}


def windy_trial(
    manoeuvre: str = "turning-circle-35",
    *,
    seed: int = 0,
    secs: float = 300.0,
    noise: str = "white",
    wind: Wind = GALE,
    also: tuple[str, ...] = APPARENT_WIND,
) -> SimulatedTrial:
    """A manoeuvre in a wind, with white noise on gyro, log and anemometer, at 2 Hz."""
    vessel, text = load_vessel("table1")
    rates = {key: hz for key, hz in RATE.items() if not key.startswith("app") or key[:-8] in also}
    sensors = suite(noise, rates, also=also)
    return simulate(
        vessel, manoeuvre, duration_secs=secs, seed=seed, sensors=sensors, wind=wind,
        vessel_toml=text,
    )  # fmt: skip


def true_coefficients(trial: SimulatedTrial) -> dict[str, float]:
    """The coefficients of the wind in SI, by the names of the terms."""
    wind, trajectory = trial.trajectory.wind, trial.trajectory
    per_rudder = trajectory.ship.moment_per_rudder(trajectory.constants)[0] / REFERENCE_WIND**2
    return {
        "wind_oblique": per_rudder * wind.oblique,
        "wind_beam": per_rudder * wind.beam,
        "wind_head": wind.drag,
    }


def without(log: TrialLog, *names: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name not in names))


@cache
def windy_log() -> TrialLog:
    """A turning circle in a gale, with all channels of the wind."""
    return as_log(windy_trial(also=WIND_SENSORS))


@cache
def windy_analysis() -> Analysis:
    """Its replay with the wind among the disturbances."""
    return analyse(windy_log(), settings=WINDY)
