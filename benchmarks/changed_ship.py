"""Simulated trials of a ship whose coefficients change during the trial."""

from collections.abc import Mapping

import numpy as np

from recorders.simulated.manoeuvres import manoeuvre
from recorders.simulated.sensors import Suite, corrupt
from recorders.simulated.trajectory import Trajectory
from shiplog import Channel, TrialLog, Vessel
from shiplog.compiled import compiled
from shiplog.ships.paper import Coefficients
from shiplog.ships.under_way import Excitation, ShipConstants, runge_kutta_step
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE
from shiplog.vessel.ship import ship_from_vessel

RATE_HZ = 10.0  # of the integration, and the highest rate of a sensor
START_NS = 1_767_225_600 * 10**9


def changed_trial(
    vessel: Vessel,
    manoeuvre_name: str,
    factors: Mapping[str, float],
    *,
    at_secs: float,
    duration_secs: float,
    sensors: Suite,
    seed: int = 0,
    vessel_toml: str | None = None,
) -> TrialLog:
    """Simulate a trial in which coefficients are multiplied by `factors` from `at_secs` on.

    The noise differs from that of `simulate` with the same seed.
    """
    rng = np.random.default_rng(seed)
    ordered = manoeuvre(manoeuvre_name, duration_secs, vessel.approach_rpm, rng)
    before, ship = vessel.paper_coefficients, ship_from_vessel(vessel)
    rpm = ordered.orders[0].rpm
    speed = ship.steady_speed(rpm)
    constants = ship.constants(speed, rpm)
    changed = {name: factor * getattr(before, name) for name, factor in factors.items()}
    zigzag = ordered.zigzag
    rows = _sail(
        before,
        before._replace(**changed),
        constants,
        ship.straight_state(speed),
        at_secs,
        np.array([(o.time_secs, o.rudder, o.rpm) for o in ordered.orders]),
        (zigzag.start_secs, zigzag.rudder, zigzag.heading) if zigzag else (np.inf, 0.0, 0.0),
        vessel.rudder_rate,
        np.arange(round(duration_secs * RATE_HZ) + 1) / RATE_HZ,
    )
    sailed, channels = Trajectory(ship, constants, rows), []
    for name in (name for name in CATALOGUE if name in sensors):
        times = np.arange(int(duration_secs * sensors[name].rate_hz) + 1) / sensors[name].rate_hz
        stamps = START_NS + np.round(times * 1e9).astype(np.int64)
        values = corrupt(sensors[name], times, sailed.at(times)[name], rng)
        components = ("north", "east") if name == "position" else ()
        unit = CATALOGUE[name].unit
        channels.append(Channel(name, "simulated", unit, stamps, stamps, values, components))
    return TrialLog("changed.mcap", tuple(channels), {"source": "simulation"}, vessel_toml)


@compiled
def _sail(
    before: Coefficients,
    after: Coefficients,
    constants: ShipConstants,
    state: FloatArray,
    change: float,
    orders: FloatArray,
    zigzag: tuple[float, float, float],
    rudder_rate: float,
    times: FloatArray,
) -> FloatArray:
    """Return rows of a `Trajectory`, one per instant; a zig-zag reverses its rudder at one."""
    start, angle, limit = zigzag
    rows = np.zeros((len(times), 14))
    work = np.empty((3, len(state)))
    delta, aim, at, h = 0.0, 0.0, 0, times[1] - times[0]
    for k in range(len(times)):
        t = times[k]
        while at + 1 < len(orders) and orders[at + 1, 0] <= t:
            at += 1
        if t < start:
            aim = orders[at, 1]
        elif aim == 0.0:
            aim = angle
        elif state[3] * np.sign(aim) >= limit:
            aim = -aim
        turn = min(max(aim - delta, -rudder_rate * h), rudder_rate * h)
        acting = Excitation(delta, turn / h, orders[at, 2], 0.0, 0.0, 0.0, 0.0)
        rows[k, 0] = t
        # element by element: Numba compiles the assignment of a slice much more slowly
        for i in range(6):
            rows[k, 1 + i] = state[i]
        for i in range(7):
            rows[k, 7 + i] = acting[i]
        after_step = runge_kutta_step(
            before if t < change else after, constants, state, acting, t, h, work
        )
        for i in range(len(state)):
            state[i] = after_step[i]
        delta += turn
    return rows
