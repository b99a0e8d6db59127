"""Ship + manoeuvre + sensors = a simulated trial."""

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

CHUNK_SECS = 60.0  # of reception: what one damaged chunk can cost
MOST_SAMPLES = 50_000_000  # of one sensor
START_NS = 1_767_225_600 * 10**9  # 2026-01-01 00:00 UTC: a fixed instant, so that runs repeat
RANDOM_FORCING_CHILD = 1_000_000  # of the seed: far behind the sensors' own, of which more may come


@dataclass(frozen=True, eq=False)
class SimulatedTrial:
    """A `Source`: the samples of every sensor, and the truth they were taken from."""

    channels: tuple[Channel, ...]
    trajectory: Trajectory
    duration_secs: float
    vessel_toml: str | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """The samples in chunks of `CHUNK_SECS` of reception."""
        ends = START_NS + (np.arange(CHUNK_SECS, self.duration_secs, CHUNK_SECS) * 1e9).astype(int)
        cuts = [
            [0, *np.searchsorted(channel.received_ns, ends).tolist(), len(channel)]
            for channel in self.channels
        ]
        for i in range(len(ends) + 1):
            yield tuple(
                _part(channel, cut[i], cut[i + 1])
                for channel, cut in zip(self.channels, cuts, strict=True)
            )

    def truth(self, rate_hz: float = 10.0) -> TrialLog:
        """What really happened, as a log of source `truth`."""
        times = np.arange(int(self.duration_secs * rate_hz) + 1) / rate_hz
        stamps = _stamps(times)
        ship, constants = self.trajectory.ship, self.trajectory.constants
        units = _UNITS | {"yaw_disturbance": ship.moment_per_rudder(constants)[1]}
        channels = [
            _channel(name, "truth", stamps, stamps, values, units.get(name))
            for name, values in self.trajectory.at(times).items()
            if name != "sway" or name in ship.model.outputs
        ]
        return TrialLog("truth", tuple(channels), self.metadata, self.vessel_toml)


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
    vessel_toml: str | None = None,
) -> SimulatedTrial:
    """Sail a manoeuvre and measure it; the same seed gives the same samples to the last bit.

    Raises `UsageError` for an unknown manoeuvre, a duration that is not positive, a gust outside
    the trial, or an random_forcing that is negative or not finite.
    """
    sensors = suite("paper") if sensors is None else sensors
    _require_sensible(duration_secs, seed, sensors, gusts, random_forcing)
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
        rng=np.random.default_rng(random_forcing_seed),
    )
    channels = []
    for name, sensor_seed in zip(CATALOGUE, sensor_seeds, strict=True):
        if name in sensors:
            rng = np.random.default_rng(sensor_seed)
            times = sample_times(sensors[name], duration_secs, rng)
            values = corrupt(sensors[name], times, trajectory.at(times)[name], rng)
            received = np.maximum.accumulate(times + delays(sensors[name], len(times), rng))
            channels.append(_channel(name, "simulated", _stamps(times), _stamps(received), values))
    metadata = {"source": "simulation", "manoeuvre": ordered.name, "seed": str(seed)}
    return SimulatedTrial(tuple(channels), trajectory, duration_secs, vessel_toml, metadata)


def _require_sensible(
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
        if duration_secs * sensor.rate_hz > MOST_SAMPLES:
            raise UsageError(
                f"{name} at {sensor.rate_hz:g} Hz for {duration_secs:g} s is over "
                f"{MOST_SAMPLES:,} samples; shorten the trial or slow the sensor"
            )
    for gust in gusts:
        if not (0 <= gust.start_secs < duration_secs and gust.duration_secs > 0):
            raise UsageError(
                f"a gust must begin within the trial and last: it begins at {gust.start_secs:g} s "
                f"of {duration_secs:g} s, for {gust.duration_secs:g} s"
            )
    if random_forcing and not all(
        isfinite(std) and std >= 0 for std in (random_forcing.rudder, random_forcing.force)
    ):
        raise UsageError(
            "an random_forcing's standard deviations must be finite and not negative, got "
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


def _part(channel: Channel, start: int, stop: int) -> Channel:
    cut = slice(start, stop)
    return Channel(
        channel.name,
        channel.source,
        channel.unit,
        channel.measured_ns[cut],
        channel.received_ns[cut],
        channel.values[cut],
        channel.fields,
        channel.metadata,
    )
