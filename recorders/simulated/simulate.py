"""Simulated trials: a ship, a manoeuvre and sensors joined to a source of samples."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from shiplog import Channel, TrialLog, Vessel
from shiplog.errors import UsageError
from shiplog.types import FloatArray, TimeArray
from shiplog.units import CATALOGUE

from .manoeuvres import manoeuvre
from .sensors import Suite, corrupt, delays, sample_times, suite
from .trajectory import Gust, RandomForcing, Trajectory, WaveMoment, compute_trajectory
from .wind import WIND_SENSORS, Wind

CHUNK_SECS = 60.0  # of reception: a damaged chunk loses no more
MAX_SAMPLES = 50_000_000  # of one sensor
START_NS = 1_767_225_600 * 10**9  # 2026-01-01 00:00 UTC; fixed, so that runs repeat
RANDOM_FORCING_CHILD = 1_000_000  # of the seed: far beyond those of the sensors, now and later


@dataclass(frozen=True, eq=False)
class SimulatedTrial:
    """A source of samples: those of every sensor, and the true motion.

    Attributes
    ----------
    channels
        The samples of every sensor.
    trajectory
        The true motion.
    duration_secs
        The length of the trial, s.
    vessel_toml
        The text of the vessel file to keep in the log.
    metadata
        Texts to keep in the log: the source, the manoeuvre and the seed.
    """

    channels: tuple[Channel, ...]
    trajectory: Trajectory
    duration_secs: float
    vessel_toml: str | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Yield the samples in chunks of `CHUNK_SECS` of reception."""
        ends = START_NS + (np.arange(CHUNK_SECS, self.duration_secs, CHUNK_SECS) * 1e9).astype(int)
        cuts = [
            [0, *np.searchsorted(channel.received_ns, ends).tolist(), len(channel)]
            for channel in self.channels
        ]
        for i in range(len(ends) + 1):
            yield tuple(
                channel.part(cut[i], cut[i + 1])
                for channel, cut in zip(self.channels, cuts, strict=True)
            )

    def truth(self, rate_hz: float = 10.0) -> TrialLog:
        """Return the true motion and disturbances as a log, all of the source ``truth``."""
        times = np.arange(int(self.duration_secs * rate_hz) + 1) / rate_hz
        stamps = _stamps(times)
        ship, constants = self.trajectory.ship, self.trajectory.constants
        units = _UNITS | {"yaw_disturbance": ship.moment_per_rudder(constants)[1]}
        channels = [
            _channel(name, "truth", stamps, stamps, values, units.get(name))
            for name, values in self.trajectory.at(times).items()
            if name != "sway" or name in ship.model.outputs
        ]
        metadata = dict(self.metadata) | {"truth_of": self.metadata.get("manoeuvre", "a trial")}
        return TrialLog("truth", tuple(channels), metadata, self.vessel_toml)


def simulate(
    vessel: Vessel,
    manoeuvre_name: str,
    *,
    duration_secs: float,
    seed: int = 0,
    sensors: Suite | None = None,
    gusts: tuple[Gust, ...] = (),
    wave: WaveMoment | None = None,
    random_forcing: RandomForcing | None = None,
    wind: Wind | None = None,
    vessel_toml: str | None = None,
) -> SimulatedTrial:
    """Simulate a manoeuvre and measure it; the same seed gives the same samples to the last bit.

    Parameters
    ----------
    vessel
        The ship.
    manoeuvre_name
        Such as ``zigzag-20-20``; see `recorders.simulated.manoeuvres`.
    duration_secs
        The length of the trial, s.
    seed
        Seed of all random numbers. Each sensor has its own, so that a change of one sensor leaves
        the noise of the others unchanged.
    sensors
        The sensors by channel, from `recorders.simulated.sensors.suite`; the paper's by default.
    gusts, wave, random_forcing, wind
        The disturbances.
    vessel_toml
        The text of the vessel file to keep in the log.

    Raises
    ------
    UsageError
        The manoeuvre is unknown, the duration is not positive, a gust lies outside the trial, a
        random forcing is negative or not finite, or the wind is measured and there is none.

    Examples
    --------
    >>> from shiplog import load_vessel
    >>> trial = simulate(load_vessel("table1")[0], "spiral", duration_secs=60.0)
    >>> [channel.name for channel in trial.channels]
    ['yaw_rate', 'speed', 'rudder', 'rpm', 'heading', 'position']
    """
    sensors = suite("paper") if sensors is None else sensors
    _require_valid(duration_secs, seed, sensors, gusts, random_forcing)
    if wind is None and (anemometers := set(sensors) & set(WIND_SENSORS)):
        raise UsageError(
            f"{min(anemometers)} is measured in a wind only; add one, such as --wind 10,45"
        )
    orders_seed, *sensor_seeds = np.random.SeedSequence(seed).spawn(1 + len(CATALOGUE))
    ordered = manoeuvre(
        manoeuvre_name, duration_secs, vessel.approach_rpm, np.random.default_rng(orders_seed)
    )
    random_forcing_seed = np.random.SeedSequence(seed, spawn_key=(RANDOM_FORCING_CHILD,))
    trajectory = compute_trajectory(
        vessel,
        ordered,
        duration_secs,
        gusts=gusts,
        wave=wave,
        random_forcing=random_forcing,
        wind=wind,
        rng=np.random.default_rng(random_forcing_seed),
    )
    channels = []
    for name, sensor_seed in zip(CATALOGUE, sensor_seeds, strict=True):
        if name in sensors:
            rng = np.random.default_rng(sensor_seed)
            times = sample_times(sensors[name], duration_secs, rng)
            values = corrupt(sensors[name], times, trajectory.at(times)[name], rng)
            if name.endswith("wind_speed"):
                values = np.maximum(values, 0.0)  # an anemometer measures no negative speed
            received = np.maximum.accumulate(times + delays(sensors[name], len(times), rng))
            channels.append(_channel(name, "simulated", _stamps(times), _stamps(received), values))
    metadata = {"source": "simulation", "manoeuvre": ordered.name, "seed": str(seed)}
    return SimulatedTrial(tuple(channels), trajectory, duration_secs, vessel_toml, metadata)


def _require_valid(
    duration_secs: float,
    seed: int,
    sensors: Suite,
    gusts: tuple[Gust, ...],
    random_forcing: RandomForcing | None,
) -> None:
    if not (isfinite(duration_secs) and duration_secs > 0):
        raise UsageError(f"the duration must be positive, got {duration_secs:g} s")
    if seed < 0:
        raise UsageError(f"the seed must not be negative, got {seed}")
    for name, sensor in sensors.items():
        if duration_secs * sensor.rate_hz > MAX_SAMPLES:
            raise UsageError(
                f"{name} at {sensor.rate_hz:g} Hz for {duration_secs:g} s is over "
                f"{MAX_SAMPLES:,} samples; shorten the trial or lower the sensor's rate"
            )
    for gust in gusts:
        if not (0 <= gust.start_secs < duration_secs and gust.duration_secs > 0):
            raise UsageError(
                "a gust must start within the trial and last longer than 0 s, got a start at "
                f"{gust.start_secs:g} s in a trial of {duration_secs:g} s, and a length of "
                f"{gust.duration_secs:g} s"
            )
    if random_forcing and not all(
        isfinite(std) and std >= 0 for std in (random_forcing.rudder, random_forcing.force)
    ):
        raise UsageError(
            "the standard deviations of a random forcing must be finite and not negative, got "
            f"{random_forcing.rudder:g} rad of rudder and {random_forcing.force:g} m/s²"
        )


def _stamps(times_secs: FloatArray) -> TimeArray:
    return START_NS + np.round(times_secs * 1e6).astype(np.int64) * 1000


_UNITS = {"yaw_acceleration": "rad/s²", "surge_disturbance": "m/s²"}


def _channel(
    name: str,
    source: str,
    measured: TimeArray,
    received: TimeArray,
    values: FloatArray,
    unit: str | None = None,
) -> Channel:
    components = ("north", "east") if name == "position" else ()
    unit = unit or CATALOGUE[name].unit
    return Channel(name, source, unit, measured, received, values, components)
