"""Compiled integration of a simulated run, from knot to knot of its inputs.

A step ends where the rudder arrives at its order, where an order is given, where the heading of a
zig-zag triggers the next one, and after `RUN_STEP_SECS` at the latest.
"""

from math import inf
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled, copy_vector
from shiplog.ships.under_way import (
    CoefficientTuple,
    Excitation,
    ShipConstants,
    observed_real,
    outputs_si,
    runge_kutta_step,
    write_rates_si,
)
from shiplog.types import FloatArray, TimeArray

from .wind import WindLoad, wind_on_ship

RUN_STEP_SECS = 0.1  # Runge-Kutta's error is then below 1e-10
INSTANT_SECS = 1e-9  # times closer than this are the same
TIME = 0  # the column of the time in a row; the state follows it
EXCITATION_COLUMNS = 7  # at the end of a row


class RunPlan(NamedTuple):
    """What compiled code needs of a run: orders, disturbances and the steering gear.

    Attributes
    ----------
    schedule
        (n, 4) rows of time, ordered rudder, rpm and gust, each valid from its time on.
    zigzag_start
        When a zig-zag begins, s; infinite where there is none.
    zigzag_rudder, zigzag_heading
        Its first rudder and the heading at which the rudder is reversed, rad.
    wave, wave_frequency
        The amplitude, rad of rudder, and the frequency, rad/s, of a sinusoidal yaw moment.
    forcing
        (k, 2) the random moment and force of each step, the last row for all that follow.
    wind
        The wind, which acts in each step as at its start.
    rudder_max, rudder_rate
        The limits of the steering gear, rad and rad/s.
    duration
        The length of the run, s.
    """

    schedule: FloatArray
    zigzag_start: float
    zigzag_rudder: float
    zigzag_heading: float
    wave: float
    wave_frequency: float
    forcing: FloatArray
    wind: WindLoad
    rudder_max: float
    rudder_rate: float
    duration: float


@compiled
def integrate_run(
    c: CoefficientTuple, constants: ShipConstants, state: FloatArray, plan: RunPlan
) -> FloatArray:
    """Integrate a run from knot to knot of its inputs.

    Parameters
    ----------
    c
        The coefficients of the ship model's equations.
    constants
        What compiled code needs of the ship besides them.
    state
        (s + 2,) the initial state with the position; it is overwritten.
    plan
        The orders, the disturbances and the steering gear.

    Returns
    -------
    (n, s + 10) array
        A row for each step: the time, the state and the excitation from there on.
    """
    schedule = plan.schedule
    rows = np.empty((int(plan.duration / RUN_STEP_SECS) + 64, 1 + len(state) + EXCITATION_COLUMNS))
    work, own = np.empty((3, len(state))), 1 + len(state)
    count, t, delta, at, step = 0, 0.0, 0.0, 0, 0
    order = schedule[0, 1]
    while True:
        while at + 1 < len(schedule) and schedule[at + 1, 0] <= t:
            at += 1
            if t < plan.zigzag_start:
                order = schedule[at, 1]
        if t >= plan.zigzag_start and order == 0.0:
            order = plan.zigzag_rudder
        while step * RUN_STEP_SECS <= t + INSTANT_SECS:
            step += 1
        delta, delta_dot, arrival = _steer(delta, order, t, plan.rudder_max, plan.rudder_rate)
        random_moment, force = plan.forcing[min(step, len(plan.forcing)) - 1]
        moment = schedule[at, 3] + random_moment
        if plan.wind.acts:
            _, ahead, sway, heading = observed_real(c, state)
            turning, braking = wind_on_ship(
                plan.wind, heading, constants.speed * ahead, constants.speed * sway
            )
            moment += turning
            force += braking
        u = Excitation(
            delta, delta_dot, schedule[at, 2], moment, plan.wave, plan.wave_frequency, force
        )
        if count == len(rows):
            rows = np.concatenate((rows, np.empty_like(rows)))
        rows[count, TIME] = t
        copy_vector(rows[count, 1:own], state)
        copy_vector(rows[count, own:], u)
        count += 1
        if t >= plan.duration:
            return rows[:count]
        end = min(step * RUN_STEP_SECS, plan.duration, arrival)
        end = min(end, schedule[at + 1, 0] if at + 1 < len(schedule) else inf)
        end = min(end, plan.zigzag_start if t < plan.zigzag_start else inf)
        # a zig-zag reverses the rudder at the very instant the heading is reached
        side, within = np.sign(order), end - t
        after = runge_kutta_step(c, constants, state, u, t, within, work)
        if t >= plan.zigzag_start and observed_real(c, after)[3] * side >= plan.zigzag_heading:
            heading = plan.zigzag_heading
            end = t + _time_to_heading(c, constants, state, u, t, within, side, heading, work)
            after = runge_kutta_step(c, constants, state, u, t, end - t, work)
            order = -order
        delta += delta_dot * (end - t)
        copy_vector(state, after)
        t = end


@compiled
def _steer(
    delta: float, order: float, t: float, rudder_max: float, rate: float
) -> tuple[float, float, float]:
    """Compute the rudder's angle, its rate, and when it arrives: infinite where it is there."""
    aim = min(max(order, -rudder_max), rudder_max)
    arrival = t + abs(aim - delta) / rate
    if arrival > t + 1e-12:
        return delta, np.sign(aim - delta) * rate, arrival
    return aim, 0.0, inf


@compiled
def _time_to_heading(
    c: CoefficientTuple,
    constants: ShipConstants,
    state: FloatArray,
    u: Excitation,
    t: float,
    within: float,
    side: float,
    heading: float,
    work: FloatArray,
) -> float:
    """Compute the time, at most `within`, to the heading on a side, s: by bisection."""
    low, high = 0.0, within
    for _ in range(60):
        middle = (low + high) / 2
        after = runge_kutta_step(c, constants, state, u, t, middle, work)
        if observed_real(c, after)[3] * side >= heading:
            high = middle
        else:
            low = middle
    return high


@compiled
def outputs_at(
    c: CoefficientTuple,
    constants: ShipConstants,
    rows: FloatArray,
    before: TimeArray,
    acting: TimeArray,
    times: FloatArray,
    yaw: int,
) -> FloatArray:
    """Compute the outputs at any times of a run.

    Parameters
    ----------
    c, constants
        Those of `integrate_run`.
    rows
        What it returned.
    before
        (n,) the row from which the state is integrated to each time.
    acting
        (n,) the row whose excitation gives the acceleration at each time.
    times
        (n,) the times, s.
    yaw
        The index of the yaw rate in the state.

    Returns
    -------
    (n, 7) array
        The values of `shiplog.ships.under_way.outputs_si`.
    """
    out, own = np.empty((len(times), 7)), rows.shape[1] - EXCITATION_COLUMNS
    work, rates = np.empty((3, own - 1)), np.empty(own - 1)
    for i in range(len(times)):
        row, now = rows[before[i]], rows[acting[i]]
        state = runge_kutta_step(
            c, constants, row[1:own], _excitation(row[own:]), row[0], times[i] - row[0], work
        )
        write_rates_si(
            c, constants, state, _excitation(now[own:]), now[0], times[i] - now[0], rates
        )
        copy_vector(out[i], outputs_si(c, constants, state, rates, yaw))
    return out


@compiled
def _excitation(row: FloatArray) -> Excitation:
    return Excitation(row[0], row[1], row[2], row[3], row[4], row[5], row[6])
