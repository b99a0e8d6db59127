"""Sensor errors, heading and disturbances as states, against a joint Gaussian of the whole run."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from filter_runs import in_chunks, signals_of, smoothed_run, steered, straight
from gaussian import LinearRun, apart, band, held, normalised_squared
from scipy.linalg import block_diag

from analysis.filters.factory import make_filter
from analysis.filters.further_states import (
    FIRST_HEADING_STD,
    HOUR,
    MIN_FORCE,
    MOMENT_RUDDER,
    SENSOR_WALKS,
)
from analysis.filters.noise_model import ForceNoise, FurtherModel, NoiseModel
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import Signals, Vessel
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

DT, SEEDS = 0.5, 60
STDS, HEADING_STD = np.array([1e-4, 0.1]), 2e-3
FURTHER = FurtherModel(
    ("compass",), (HEADING_STD,), ("gyro", "log"), yaw=ForceNoise(0, 0.05), surge=None
)
NOISE = NoiseModel(STDS, np.array([1e-4, 1e-3]), further=FURTHER)
SPREAD, FIRST = np.array([1e-3, 0.5]), np.array([2e-3, 8.0])
KINDS = ("extended", "steady-state", "quality", "per-tick")


def measured_signals(measured: np.ndarray, inputs: np.ndarray) -> Signals:
    """Yaw rate, speed and heading, (n, 3), and the inputs (n, 2)."""
    signals = signals_of(measured[:, :2], *inputs.T, DT)
    return replace(signals, values=dict(signals.values) | {"compass": measured[:, 2]})


def stats_of(c: Coefficients, inputs: np.ndarray) -> SignalStats:
    measured = np.column_stack((np.full(len(inputs), 2e-3), np.full(len(inputs), 8.0)))
    signals = measured_signals(np.column_stack((measured, np.zeros(len(inputs)))), inputs)
    return replace(signal_stats(signals, c), first=FIRST, std=SPREAD)


def linear_run(
    c: Coefficients, stats: SignalStats, inputs: np.ndarray, noise: NoiseModel
) -> LinearRun:
    """w, w', v, heading, gyro bias, log bias and yaw moment of a straight ship, in this order."""
    R = noise.measurement_std**2 * stats.interval_secs
    A = np.zeros((7, 7))
    A[0, 1], A[1, :2], A[3, 0], A[1, 6] = 1.0, (c.b1, c.a), 1.0, 1.0
    walks = [SENSOR_WALKS[name] for name in ("gyro", "log")]
    q_walks = [walk.hourly_std**2 / HOUR for walk in walks]
    forces = noise.process_ratio * R
    q_moment = [0.05**6 * R[0]] if noise.further.yaw else [0.0]
    F, Q = held(A, np.diag([0.0, *forces, 0.0, *q_walks, *q_moment]), DT)
    typical = MOMENT_RUDDER * abs(c.d) * stats.max_rudder_effect + MIN_FORCE
    moment = typical if noise.further.yaw else 0.0
    dw, dv = stats.std + 1e-9
    rate = (abs(c.a) + 1e-3) * dw
    stds = np.array([dw, rate, dv, FIRST_HEADING_STD, *(walk.std for walk in walks), moment])
    C = np.zeros((3, 7))
    C[0, [0, 4]], C[1, [2, 5]], C[2, 3] = 1.0, 1.0, 1.0
    ship = sailed_with_heading(c, inputs)
    mean = np.column_stack((ship, np.zeros((len(ship), 3))))
    r = np.array([*noise.measurement_std**2, HEADING_STD**2])
    return LinearRun(mean, F, Q, np.diag(stds**2), C, r)


def sailed_with_heading(c: Coefficients, inputs: np.ndarray) -> np.ndarray:
    """w, w', v and heading (n, 4) of the undisturbed straight ship: exact for even inputs."""
    effect = c.alpha2 * inputs[0, 1]  # the rudder acts in the slipstream alone
    A = block_diag([[0, 1, 0, 0], [c.b1, c.a, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]])
    states = [np.array([FIRST[0], 0.0, FIRST[1], 0.0])]
    thrust = c.h * inputs[0, 1]
    for k in range(len(inputs) - 1):
        delta, rate = inputs[k, 0], (inputs[k + 1, 0] - inputs[k, 0]) / DT
        # the rudder and a constant as states of a larger linear system
        driven = np.zeros((7, 7))
        driven[:4, :4] = A
        driven[1, 4], driven[4, 5] = effect * c.d, 1.0
        driven[1, 6], driven[2, 6] = effect * c.e * rate, thrust
        step, _ = held(driven, np.zeros((7, 7)), DT)
        states.append((step @ np.array([*states[-1], delta, rate, 1.0]))[:4])
    return np.array(states)


@pytest.mark.parametrize("seed", range(3))
def test_filter_and_smoother_agree_with_a_joint_gaussian(vessel: Vessel, seed: int) -> None:
    c, rng = straight(vessel.paper_coefficients), np.random.default_rng(seed)
    inputs = np.column_stack(steered(16, DT))
    stats = stats_of(c, inputs)
    run = linear_run(c, stats, inputs, NOISE)
    _, measured = run.drawn(rng)
    measured[[3, 4, 9], 0], measured[1::3, 1], measured[[1, 2, 7], 2] = np.nan, np.nan, np.nan
    signals = measured_signals(measured, inputs)
    stats = replace(stats, head=signals)
    first_heading = measured[0, 2]
    run = replace(run, mean=run.mean + first_heading * np.eye(7)[3])
    filter_ = make_filter(c, NOISE, stats, FilterSettings(kind="extended", gate=1e6))
    _, trace, smoothed = smoothed_run(filter_, signals)
    # the batch rounds more, as the heading is at first known to half a radian only
    assert max(apart((trace.states, trace.covariances), run.filtered(measured))) < 1e-7
    assert max(apart(smoothed, run.given(measured))) < 1e-7


@pytest.mark.parametrize("kind", KINDS)
def test_the_errors_are_as_large_as_their_covariances_state(vessel: Vessel, kind: str) -> None:
    """Of the ship's states, the heading and the sensor errors, over many runs."""
    c = straight(vessel.paper_coefficients)
    further = replace(FURTHER, yaw=ForceNoise(0, 0.05) if kind == "extended" else None)
    noise = replace(NOISE, further=further)
    inputs = np.column_stack(steered(200, DT))
    stats = stats_of(c, inputs)
    stats = replace(stats, std=STDS) if kind != "extended" else stats
    run = linear_run(c, stats, inputs, noise)
    size = 7 if kind == "extended" else 6
    if kind != "extended":
        small = np.diag(run.P).copy()
        small[[0, 1, 2]] = [
            STDS[0] ** 2, ((abs(c.a) + 1e-3) * STDS[0]) ** 2, STDS[1] ** 2,
        ]  # fmt: skip
        run = replace(run, P=np.diag(small))
    new = make_filter(
        c, noise, replace(stats, head=measured_signals(run.mean[:, [0, 2, 3]], inputs)),
        FilterSettings(kind=kind, gate=1e6),
    )  # fmt: skip
    squares = np.zeros((2, 3))
    for seed in range(SEEDS):
        true, measured = run.drawn(np.random.default_rng(seed))
        signals = measured_signals(measured, inputs)
        filter_ = deepcopy(new)
        _, trace, smoothed = smoothed_run(filter_, signals)
        ways = (trace.states, trace.covariances), smoothed
        for way, (x, P) in enumerate(ways):
            for i, at in enumerate((20, 90, 199)):
                error = x[at, :size] - true[at, :size]
                squares[way, i] += normalised_squared(error, P[at, :size, :size])
    low, high = band(SEEDS * size)
    judged = squares if kind == "extended" else squares[:1]  # the smoother assumes the optimal gain
    assert low < judged.min(), squares
    assert judged.max() < high, squares


@pytest.mark.parametrize("kind", ["extended", "pseudo-input", "per-tick"])
def test_where_chunks_are_cut_changes_no_bit(vessel: Vessel, kind: str) -> None:
    c, inputs = vessel.paper_coefficients, np.column_stack(steered(120, DT))
    rng = np.random.default_rng(5)
    heading = np.cumsum(np.full(120, 2e-3)) + HEADING_STD * rng.standard_normal(120)
    measured = np.column_stack(
        (2e-3 + 1e-4 * rng.standard_normal(120), 8 + 0.1 * rng.standard_normal(120), heading)
    )
    signals = measured_signals(measured, inputs)
    stats = replace(stats_of(c, inputs), head=signals)
    made = [make_filter(c, NOISE, stats, FilterSettings(kind=kind)) for _ in range(2)]
    whole = made[0].step(signals, last_inputs(signals))
    parts = [made[1].step(*part) for part in in_chunks(signals, [1, 17, 80])]
    for name in ("values", "stds"):
        cut = np.concatenate([getattr(part.further, name) for part in parts])
        assert np.array_equal(getattr(whole.further, name), cut)
    assert np.array_equal(whole.innovations, np.concatenate([part.innovations for part in parts]))


def test_a_heading_that_passes_north_is_no_innovation(vessel: Vessel) -> None:
    """The compass jumps from a full turn to zero, and the estimate goes on."""
    c, count = vessel.paper_coefficients, 60
    inputs = np.column_stack((np.zeros(count), np.full(count, 80.0)))
    heading = 6.2 + 4e-3 * np.arange(count)
    measured = np.column_stack((np.full(count, 8e-3), np.full(count, 8.0), heading % (2 * np.pi)))
    signals = measured_signals(measured, inputs)
    stats = replace(stats_of(c, inputs), head=signals)
    noise = replace(NOISE, further=replace(FURTHER, sensors=(), yaw=None))
    estimates = make_filter(c, noise, stats, FilterSettings(kind="extended")).step(
        signals, last_inputs(signals)
    )
    assert np.abs(estimates.innovations[:, 2]).max() < 0.1
    assert not estimates.rejected[:, 2].any()
    found, _ = estimates.further.of("heading")
    assert found[-1] == pytest.approx(heading[-1], abs=0.05)
