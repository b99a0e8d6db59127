"""Ship + manoeuvre + sensors = a simulated trial.

The ship is integrated exactly between the knots of its forcing: a step ends where the rudder
arrives, where an order is given, and where the heading of a zig-zag calls for the next one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite, pi

import numpy as np

from shiplog import Channel, TrialLog, Vessel
from shiplog.compiled import compiled
from shiplog.errors import UsageError
from shiplog.ship import Coefficients, Forcing, State, rudder_effect, steady_speed, step
from shiplog.types import FloatArray, TimeArray
from shiplog.units import CATALOGUE

from .manoeuvres import Manoeuvre, manoeuvre
from .sensors import Suite, corrupt, delays, sample_times, suite

GRID_SECS = 0.1  # the longest step; Runge-Kutta's error is then below 1e-10
SLAB_SECS = 60.0  # of reception: what one damaged chunk can cost
MOST_SAMPLES = 50_000_000  # of one sensor
START_NS = 1_767_225_600 * 10**9  # 2026-01-01 00:00 UTC: a fixed instant, so that runs repeat

# one row of a trajectory: the time, the state, and the forcing from there on
_TIME, _STATE, _FORCING = 0, slice(1, 7), slice(7, 13)
_ROW = 13


@dataclass(frozen=True)
class Gust:
    """A yaw moment that sets in and ceases, as large as so much rudder at the approach speed."""

    rudder: float  # rad
    start_secs: float
    duration_secs: float = inf


@dataclass(frozen=True)
class WaveMoment:
    """A sinusoidal yaw moment, its amplitude as large as so much rudder at the approach speed."""

    rudder: float  # rad
    period_secs: float


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A voyage: rows at the grid and at every knot, (n, 13)."""

    coefficients: Coefficients
    rows: FloatArray

    def at(self, times_secs: FloatArray) -> dict[str, FloatArray]:
        """The truth at any times, (n,) each: integrated from the row before, not interpolated."""
        found = np.searchsorted(self.rows[:, _TIME], times_secs, side="right") - 1
        states = _states_at(self.coefficients, self.rows, found, times_secs)
        row, after = self.rows[found], times_secs - self.rows[found, _TIME]
        delta, delta_dot, rpm, moment, wave, frequency = row[:, _FORCING].T
        return {
            "yaw_rate": states[:, 0],
            "yaw_acceleration": states[:, 1],
            "speed": states[:, 2],
            "heading": states[:, 3],
            "position": states[:, 4:6],
            "rudder": delta + delta_dot * after,
            "rpm": rpm,
            "yaw_disturbance": moment + wave * np.sin(frequency * times_secs),
        }


@dataclass(frozen=True, eq=False)
class SimulatedTrial:
    """A `Source`: the samples of every sensor, and the truth they were taken from."""

    channels: tuple[Channel, ...]
    trajectory: Trajectory
    duration_secs: float
    vessel_toml: str | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def slabs(self) -> Iterator[tuple[Channel, ...]]:
        """The samples in slabs of `SLAB_SECS` of reception."""
        ends = START_NS + (np.arange(SLAB_SECS, self.duration_secs, SLAB_SECS) * 1e9).astype(int)
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
        channels = [
            _channel(name, "truth", stamps, stamps, values)
            for name, values in self.trajectory.at(times).items()
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
    vessel_toml: str | None = None,
) -> SimulatedTrial:
    """Sail a manoeuvre and measure it; the same seed gives the same samples to the last bit.

    Raises `UsageError` for an unknown manoeuvre or a duration that is not positive.
    """
    sensors = suite("paper") if sensors is None else sensors
    _require_sensible(duration_secs, seed, sensors, gusts)
    orders_seed, *sensor_seeds = np.random.SeedSequence(seed).spawn(1 + len(CATALOGUE))
    ordered = manoeuvre(
        manoeuvre_name, duration_secs, vessel.approach_rpm, np.random.default_rng(orders_seed)
    )
    trajectory = sail(vessel, ordered, duration_secs, gusts=gusts, wave=wave)
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
    duration_secs: float, seed: int, sensors: Suite, gusts: tuple[Gust, ...]
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


def sail(
    vessel: Vessel,
    ordered: Manoeuvre,
    duration_secs: float,
    *,
    gusts: tuple[Gust, ...] = (),
    wave: WaveMoment | None = None,
) -> Trajectory:
    """The ship's way through a manoeuvre, free of noise."""
    c, rpm = vessel.coefficients, ordered.orders[0].rpm
    speed = ordered.initial_speed
    speed = steady_speed(c, rpm) if speed is None else speed
    per_rudder = c.d * rudder_effect(c, speed, rpm)  # a moment of so much rudder, rad/s^3
    waves = (per_rudder * wave.rudder, 2 * pi / wave.period_secs) if wave else (0.0, 0.0)
    zigzag = ordered.zigzag
    sailed = _sail(
        c,
        State(0.0, 0.0, speed, 0.0, 0.0, 0.0),
        _schedule(ordered, gusts, per_rudder),
        (zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (inf, 0.0, 0.0),
        waves,
        vessel.rudder_max,
        vessel.rudder_rate,
        duration_secs,
        GRID_SECS,
    )
    if not np.all(np.isfinite(sailed)):
        raise UsageError(
            f"{vessel.name} runs away in {ordered.name}: its model is unstable there; "
            "correct its coefficients or choose a gentler manoeuvre"
        )
    return Trajectory(c, sailed)


def _schedule(ordered: Manoeuvre, gusts: tuple[Gust, ...], per_rudder: float) -> FloatArray:
    """Rows of time, rudder ordered, rpm and moment, valid from that time on, (n, 4)."""
    edges = [edge for g in gusts for edge in (g.start_secs, g.start_secs + g.duration_secs)]
    times = sorted({order.time_secs for order in ordered.orders} | {e for e in edges if e < inf})
    rows = []
    for time in times:
        order = max(
            (o for o in ordered.orders if o.time_secs <= time), key=lambda order: order.time_secs
        )
        moment = sum(
            g.rudder for g in gusts if g.start_secs <= time < g.start_secs + g.duration_secs
        )
        rows.append((time, order.rudder, order.rpm, per_rudder * moment))
    return np.array(rows)


@compiled
def _sail(
    c: Coefficients,
    state: State,
    schedule: FloatArray,
    zigzag: tuple[float, float, float],
    waves: tuple[float, float],
    rudder_max: float,
    rudder_rate: float,
    duration: float,
    grid: float,
) -> FloatArray:
    zigzag_start, zigzag_rudder, zigzag_heading = zigzag
    rows = np.empty((int(duration / grid) + 64, _ROW))
    count, t, delta, at, grid_index = 0, 0.0, 0.0, 0, 0
    order = schedule[0, 1]
    while True:
        while at + 1 < len(schedule) and schedule[at + 1, 0] <= t:
            at += 1
            if t < zigzag_start:
                order = schedule[at, 1]
        if t >= zigzag_start and order == 0.0:
            order = zigzag_rudder
        # what acts until the next knot
        delta, delta_dot, arrival = _steer(delta, order, t, rudder_max, rudder_rate)
        forcing = Forcing(delta, delta_dot, schedule[at, 2], schedule[at, 3], waves[0], waves[1])
        if count == len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[count, _TIME] = t
        rows[count, 1:7] = state
        rows[count, 7:13] = forcing
        count += 1
        if t >= duration:
            return rows[:count]
        while grid_index * grid <= t + 1e-9:
            grid_index += 1
        end = min(grid_index * grid, duration, arrival)
        end = min(end, schedule[at + 1, 0] if at + 1 < len(schedule) else inf)
        end = min(end, zigzag_start if t < zigzag_start else inf)
        # a zig-zag turns the rudder at the very instant the heading is reached
        after = step(c, state, forcing, t, end - t)
        if t >= zigzag_start and after.heading * np.sign(order) >= zigzag_heading:
            end = t + _reaching(c, state, forcing, t, end - t, np.sign(order), zigzag_heading)
            after = step(c, state, forcing, t, end - t)
            order = -order
        delta += delta_dot * (end - t)
        state, t = after, end


@compiled
def _steer(
    delta: float, order: float, t: float, largest: float, rate: float
) -> tuple[float, float, float]:
    """Where the rudder is, how fast it moves, and when it arrives: never, if it is there."""
    aim = min(max(order, -largest), largest)
    arrival = t + abs(aim - delta) / rate
    if arrival > t + 1e-12:
        return delta, np.sign(aim - delta) * rate, arrival
    return aim, 0.0, inf


@compiled
def _reaching(
    c: Coefficients,
    state: State,
    forcing: Forcing,
    t: float,
    within: float,
    side: float,
    heading: float,
) -> float:
    """After how long, at most `within`, the heading is reached on that side: by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        if step(c, state, forcing, t, middle).heading * side >= heading:
            high = middle
        else:
            low = middle
    return high


@compiled
def _states_at(
    c: Coefficients, rows: FloatArray, found: TimeArray, times: FloatArray
) -> FloatArray:
    states = np.empty((len(times), 6))
    for i in range(len(times)):
        row = rows[found[i]]
        state = State(row[1], row[2], row[3], row[4], row[5], row[6])
        forcing = Forcing(row[7], row[8], row[9], row[10], row[11], row[12])
        states[i] = step(c, state, forcing, row[0], times[i] - row[0])
    return states


def _stamps(times_secs: FloatArray) -> TimeArray:
    return START_NS + np.round(times_secs * 1e6).astype(np.int64) * 1000


_UNITS = {"yaw_acceleration": "rad/s²", "yaw_disturbance": "rad/s³"}


def _channel(
    name: str, source: str, measured: TimeArray, received: TimeArray, values: FloatArray
) -> Channel:
    unit = CATALOGUE[name].unit if name in CATALOGUE else _UNITS[name]
    components = ("north", "east") if name == "position" else ()
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
