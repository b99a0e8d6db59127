"""The loop of all filters: measurements correct the state one after the other, then it advances.

The states are those of the core (`core`), then a wave in the yaw rate and disturbances with
dynamics of their own, then heading and position, then the states that change by noise alone: sensor
errors, current, disturbances that are random walks, and the coefficients of the wind (`arrange` in
`further_states` orders them). What only the
further states need is chosen by the type of `further` (`further_steps`).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled, copy_vector, inlined
from shiplog.types import FloatArray

from .core import StepInputs, advance, begin_instant, gain, output_row
from .further_steps import (
    acting_at_instant,
    acting_during_step,
    advance_further,
    begin_wind,
    linearise_output,
    set_slopes,
    show,
)
from .kernels import ACCEPTED, REJECTED, copy_matrix, correct, innovate, propagate


class System(NamedTuple):
    """The constants of a filter of s states and m outputs.

    Attributes
    ----------
    C
        (m, s): the output matrix, without what depends on the state.
    r
        (m,): variances of the measurement noise.
    gate
        The largest accepted innovation, in standard deviations.
    F, Q
        (s, s): the transition matrix as far as it is constant, and the covariance of the noise of a
        step.
    B
        (c, 2): the derivative of a step by moment and force as far as it is constant, of a core of
        c states; (c, 0) where there are no such states.
    linear_end
        Where the states with constant linear dynamics end, which begin after the core's.
    dynamic
        The number of states that change otherwise than by noise.
    shown
        The number of further estimates.
    """

    C: FloatArray
    r: FloatArray
    gate: float
    F: FloatArray
    Q: FloatArray
    B: FloatArray
    linear_end: int
    dynamic: int
    shown: int


class FilterState(NamedTuple):
    """The state of a filter between two chunks; its arrays are updated.

    Attributes
    ----------
    x, P
        (s,) and (s, s): the predicted state of the next instant and its covariance.
    rejected_in_a_row
        (m,): see `kernels.is_accepted`.
    """

    x: FloatArray
    P: FloatArray
    rejected_in_a_row: NDArray[np.int64]


class ShipInputs(NamedTuple):
    """The inputs of a chunk of n instants.

    Attributes
    ----------
    delta, n
        (n + 1,): rudder angle, rad, and revolutions, rpm, the instant after the chunk included.
    dt
        The interval, s.
    """

    delta: FloatArray
    n: FloatArray
    dt: float


class FilterInput(NamedTuple):
    """What a filter takes of a chunk: the outputs (n, m), NaN where not measured, and inputs."""

    measured: FloatArray
    inputs: ShipInputs


class TraceArrays(NamedTuple):
    """The arrays of a `Trace` after its states; without rows where none is kept."""

    covariances: FloatArray
    transitions: FloatArray
    rows: FloatArray
    gains: FloatArray
    innovations: FloatArray
    variances: FloatArray


FilterArrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray, NDArray[np.bool_], TraceArrays]


@compiled
def run_filter(
    core: Any,  # noqa: ANN401
    further: Any,  # noqa: ANN401
    system: System,
    state: FilterState,
    chunk: FilterInput,
    keep: bool,
) -> FilterArrays:
    """Filter a chunk of n instants, and set the state to that after it.

    Returns
    -------
    states
        (n, s).
    rows
        (n, 10): w, w', w'', v, v' and their variances.
    further_rows
        (n, 2 k): the further estimates and their variances.
    innovations
        (n, 2 m): the innovations of the outputs, and their variances.
    rejected
        (n, m): which samples were rejected.
    trace
        The arrays of `Trace` after the states; empty unless `keep`.
    """
    measured, (delta, n, dt), x, P = chunk.measured, chunk.inputs, state.x, state.P
    (count, outputs), size = measured.shape, len(x)
    xs, rows, innovations = (
        np.empty((count, size)), np.empty((count, 10)), np.empty((count, 2 * outputs)),
    )  # fmt: skip
    rejected = np.zeros((count, outputs), np.bool_)
    further_rows = np.empty((count, 2 * system.shown))
    trace = _trace_arrays(count if keep else 0, outputs, size)
    F, B, FP = system.F.copy(), system.B.copy(), np.empty((size, size))
    Pc, K = np.empty(size), np.empty(size)
    c, before, slopes = np.empty(size), np.empty(size), np.zeros((2, size))
    for k in range(count):
        begin_wind(further, k)
        delta_dot, n_dot = (delta[k + 1] - delta[k]) / dt, (n[k + 1] - n[k]) / dt
        given = StepInputs(delta[k], delta_dot, n[k], n_dot, 0.0, 0.0)
        u = acting_at_instant(further, x, given)
        begin_instant(core, x, u)
        for output in range(outputs):
            copy_vector(c, system.C[output])
            y = linearise_output(further, x, c, measured[k, output], output)
            innovation, S, status = innovate(
                x, P, c, system.r[output], y, system.gate, output, state.rejected_in_a_row, Pc
            )
            innovations[k, output], innovations[k, outputs + output] = innovation, S
            rejected[k, output] = status == REJECTED
            if status != ACCEPTED:
                continue
            gain(core, x, Pc, S, u, output, K)
            correct(x, P, K, Pc, innovation, S)
            if keep:
                copy_vector(trace.gains[k, output], K)
                copy_vector(trace.rows[k, output], c)
                trace.innovations[k, output], trace.variances[k, output] = innovation, S
        copy_vector(xs[k], x)
        set_slopes(further, core, x, n[k], slopes)
        output_row(core, x, P, acting_at_instant(further, x, given), slopes, rows[k])
        show(further, x, P, further_rows[k])
        if keep:
            copy_matrix(trace.covariances[k], P)
        copy_vector(before, x)
        advance(core, x, F, B, acting_during_step(further, x, given), dt)
        _advance_linear(x, before, F, len(B), system.linear_end)
        advance_further(further, core, x, before, F, B, n[k], dt)
        if keep:
            copy_matrix(trace.transitions[k], F)
        propagate(P, F, system.Q, FP, system.dynamic)
    return xs, rows, further_rows, innovations, rejected, trace


@inlined
def _trace_arrays(count: int, outputs: int, size: int) -> TraceArrays:
    """Return the arrays of the trace, as of measurements that were not used."""
    return TraceArrays(
        np.empty((count, size, size)), np.empty((count, size, size)),
        np.zeros((count, outputs, size)), np.zeros((count, outputs, size)),
        np.zeros((count, outputs)), np.ones((count, outputs)),
    )  # fmt: skip


@inlined
def _advance_linear(x: FloatArray, before: FloatArray, F: FloatArray, first: int, end: int) -> None:
    """Advance the states from `first` to `end`, which have linear dynamics of their own."""
    for i in range(first, end):
        x[i] = 0.0
        for j in range(first, end):
            x[i] += F[i, j] * before[j]


@compiled
def output_rows(
    core: Any,  # noqa: ANN401
    further: Any,  # noqa: ANN401
    states: FloatArray,
    covariances: FloatArray,
    inputs: ShipInputs,
    shown: int,
) -> tuple[FloatArray, FloatArray]:
    """Compute the outputs of states (n, s) of covariances (n, s, s): `rows` and `further_rows`.

    Both are as in `run_filter`, as are the other parameters; there are `shown` further estimates.
    """
    delta, n, dt = inputs
    rows, further_rows = np.empty((len(states), 10)), np.empty((len(states), 2 * shown))
    slopes = np.zeros((2, states.shape[1]))
    for k in range(len(states)):
        begin_wind(further, k)
        x, rate = states[k], (delta[k + 1] - delta[k]) / dt
        u = acting_at_instant(further, x, StepInputs(delta[k], rate, n[k], 0.0, 0.0, 0.0))
        set_slopes(further, core, x, n[k], slopes)
        output_row(core, x, covariances[k], u, slopes, rows[k])
        show(further, x, covariances[k], further_rows[k])
    return rows, further_rows
