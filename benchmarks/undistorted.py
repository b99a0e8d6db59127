"""Undistorted trials in many conditions, in which a warning of a wrong channel is a false alarm."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from recorders.simulated.sensors import DEG, suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from recorders.simulated.trajectory import RandomForcing, WaveMoment
from shiplog import TrialLog, load_vessel
from shiplog.types import FloatArray

from .distorted_values import KNOT
from .distortion import geographic, on_values, unchanged, with_channel, written_on_change

DURATION_SECS = 300.0
APPROACH_SECS = 600.0  # of a long approach
MANOEUVRES = (
    "zigzag-20-20", "zigzag-10-10-port", "turning-circle", "pseudo-random", "spiral", "pull-out",
)  # fmt: skip
MEASURED = ("yaw_rate", "speed", "rudder", "rpm", "heading", "position")
SENSORS: Mapping[str, float] = {
    f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm")
} | {"heading.white": 0.1 * DEG, "position.white": 1.0}
SECOND_NOISE = {
    "yaw_rate": 0.003 * DEG, "speed": 0.05, "rudder": 0.1 * DEG, "rpm": 0.1, "heading": 0.1 * DEG,
}  # fmt: skip


@dataclass(frozen=True)
class Condition:
    """A condition in which a trial is run and recorded.

    Attributes
    ----------
    name
        The condition, in words.
    change
        What the condition does to a log.
    sensors
        Settings of the sensors beside `SENSORS`.
    noise
        The set of sensors: ``paper`` or ``white``.
    wave, random_forcing
        The disturbances.
    rpm_share
        The revolutions on the approach, over those of the vessel file.
    expected
        Texts of which one is in each warning that is right in this condition.
    """

    name: str
    change: Callable[[TrialLog], TrialLog] = unchanged
    sensors: Mapping[str, float] = field(default_factory=dict)
    noise: str = "paper"
    wave: WaveMoment | None = None
    random_forcing: RandomForcing | None = None
    rpm_share: float = 1.0
    expected: tuple[str, ...] = ()


@cache
def undistorted_trial(seed: int = 3, manoeuvre: str = MANOEUVRES[0]) -> SimulatedTrial:
    """Return a trial with the noise of ordinary sensors."""
    return _simulated(Condition("calm"), seed, manoeuvre)


def as_log(trial: SimulatedTrial) -> TrialLog:
    """Return a trial as a log in memory, without a vessel file."""
    return TrialLog("trial.mcap", trial.channels, trial.metadata)


def undistorted_log(condition: Condition, seed: int) -> TrialLog:
    """Return the log of a trial in a condition; the seeds take the manoeuvres in turn."""
    manoeuvre = MANOEUVRES[seed % len(MANOEUVRES)]
    return condition.change(as_log(_simulated(condition, seed, manoeuvre)))


def false_alarms(seeds: Iterable[int], among: Iterable[Condition] | None = None) -> Iterator[str]:
    """Replay undistorted trials; yield the warnings that are not expected.

    Parameters
    ----------
    seeds
        The seeds of the sensors' noise.
    among
        The conditions; by default all of `conditions`.
    """
    options = ReadingOptions(load_vessel("table1")[0])
    for condition in conditions() if among is None else among:
        for seed in seeds:
            for warning in analyse(undistorted_log(condition, seed), options).findings.warnings:
                if not any(text in warning for text in condition.expected):
                    yield f"{condition.name}, seed {seed}: {warning}"


def conditions() -> tuple[Condition, ...]:
    """Return the conditions: sea, current, speed, sensors, sampling and course of the trial."""
    lost = {f"{name}.dropout": 0.02 for name in MEASURED if name != "rpm"}
    for_seconds = {f"{name}.dropout_secs": 3.0 for name in MEASURED if name != "rpm"}
    slow = {f"{name}.rate_hz": 1.0 for name in MEASURED}
    return (
        Condition("calm"),
        Condition("current", in_current(1.0, -0.8)),
        Condition("strong current, latitude and longitude",
                  lambda log: geographic()(in_current(-1.5, 1.5)(log))),
        Condition("waves", with_antenna(50.0), wave=WaveMoment(5 * DEG, 9.0)),
        Condition("swell", wave=WaveMoment(3 * DEG, 25.0)),
        Condition("random forcing", random_forcing=RandomForcing(0.5 * DEG, 0.005)),
        Condition("slow ship", rpm_share=0.3),
        Condition("slow ship in a current", in_current(0.7, 0.5), rpm_share=0.3),
        Condition("antenna aft, current",
                  lambda log: in_current(0.7, 0.7)(with_antenna(-60.0)(log))),
        Condition("lost samples", sensors=lost),
        Condition("samples lost for seconds", sensors=lost | for_seconds,
                  expected=("samples were lost", "held at its last value there")),
        Condition("second sources", with_second_sources,
                  expected=("simulated is used (the first in the log); --source",)),
        Condition("long approach", with_long_approach, noise="white"),
        Condition("written on change", lambda log: written_on_change("rudder")(
            written_on_change("rpm")(log)), expected=("written only when it changes",)),
        Condition("1 Hz", sensors=slow),
        Condition("few digits", with_few_digits),
        Condition("noisy sensors", sensors={
            "yaw_rate.white": 0.05 * DEG, "speed.uniform": 0.5, "rudder.white": 0.5 * DEG,
            "rpm.white": 1.0, "heading.white": DEG, "position.white": 5.0}),
    )  # fmt: skip


def _simulated(
    condition: Condition, seed: int, manoeuvre: str, duration_secs: float = DURATION_SECS
) -> SimulatedTrial:
    vessel = load_vessel("table1")[0]
    return simulate(
        replace(vessel, approach_rpm=condition.rpm_share * vessel.approach_rpm),
        manoeuvre,
        duration_secs=duration_secs,
        seed=seed,
        sensors=suite(condition.noise, {**SENSORS, **condition.sensors}),
        wave=condition.wave,
        random_forcing=condition.random_forcing,
    )


def in_current(north: float, east: float) -> Callable[[TrialLog], TrialLog]:
    """Return the change of a log by a steady current, m/s: it moves the fixes."""

    def change(log: TrialLog) -> TrialLog:
        fixes = log["position"]
        secs = (fixes.measured_ns - fixes.measured_ns[0]) * 1e-9
        drift = secs[:, None] * np.array([north, east])
        return with_channel(log, "position", values=fixes.values + drift)

    return change


def with_antenna(ahead: float) -> Callable[[TrialLog], TrialLog]:
    """Return the change of a log by an antenna ahead of midship, m.

    A ship that drifts in proportion to its yaw rate moves in the same way.
    """

    def change(log: TrialLog) -> TrialLog:
        fixes, compass = log["position"], log["heading"]
        heading = np.interp(fixes.measured_ns, compass.measured_ns, np.unwrap(compass.values))
        lever = ahead * np.column_stack((np.cos(heading), np.sin(heading)))
        return with_channel(log, "position", values=fixes.values + lever)

    return change


def with_second_sources(log: TrialLog) -> TrialLog:
    """Add a second source of each quantity, with noise of its own."""
    rng = np.random.default_rng(int(log.metadata["seed"]))
    others = []
    for name, std in SECOND_NOISE.items():
        channel = log[name]
        values = channel.values + std * rng.standard_normal(len(channel))
        others.append(replace(channel, source="second", values=values))
    return replace(log, channels=(*log.channels, *others))


def with_long_approach(log: TrialLog) -> TrialLog:
    """Put a straight approach of `APPROACH_SECS` before the trial."""
    straight = Condition("straight", noise="white")
    trial = _simulated(
        straight, 1000 + int(log.metadata["seed"]), "turning-circle-0.001", APPROACH_SECS
    )
    end = trial.trajectory.at(np.array([APPROACH_SECS]))
    channels = []
    for channel in trial.channels:
        before = channel.take(slice(None, -1))  # its last sample is the first of the trial
        after, delay = log[channel.name], round(APPROACH_SECS * 1e9)
        moved = end[channel.name][0] if channel.name in ("heading", "position") else 0.0
        channels.append(replace(
            after,
            measured_ns=np.concatenate((before.measured_ns, after.measured_ns + delay)),
            received_ns=np.concatenate((before.received_ns, after.received_ns + delay)),
            values=np.concatenate((before.values, after.values + moved)),
        ))  # fmt: skip
    return replace(log, channels=tuple(channels))


def with_few_digits(log: TrialLog) -> TrialLog:
    """Round the values as a coarse print does."""
    steps = {"heading": DEG, "rudder": 0.5 * DEG, "speed": 0.1 * KNOT, "yaw_rate": 0.01 * DEG}
    for name, step in steps.items():
        log = on_values(name, _rounded(step))(log)
    return log


def _rounded(step: float) -> Callable[[FloatArray], FloatArray]:
    return lambda values: np.round(values / step) * step
