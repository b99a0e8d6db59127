"""Sensor errors, heading and disturbances as states, against a joint Gaussian of the whole run."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from filter_runs import (
    SMOOTHABLE,
    five_states,
    in_chunks,
    signals_of,
    smoothed_in_chunks,
    smoothed_run,
    steered,
    straight,
    three_states,
)
from gaussian import LinearRun, apart, band, held, normalised_squared
from scipy.linalg import block_diag, expm

from analysis.filters.base import SmoothableFilter, Trace
from analysis.filters.factory import make_filter
from analysis.filters.further_parts import (
    FIRST_HEADING_STD,
    FORCE_SHARE,
    HOUR,
    MIN_FORCE,
    MOMENT_RUDDER,
    SENSOR_WALKS,
    WAVE_DECAY,
)
from analysis.filters.noise_model import (
    FURTHER_OUTPUTS,
    ForceNoise,
    FurtherModel,
    NoiseModel,
    SlowError,
)
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


def gyro_run(vessel: Vessel, count: int) -> tuple[LinearRun, np.ndarray, Signals, SmoothableFilter]:
    """A run of a straight ship with a gyro bias, and a filter at its start."""
    c, rng = straight(vessel.paper_coefficients), np.random.default_rng(0)
    inputs = np.column_stack(steered(count, DT))
    stats = stats_of(c, inputs)
    run = linear_run(c, stats, inputs, NOISE)
    _, measured = run.drawn(rng)
    signals = measured_signals(measured, inputs)
    run = replace(run, mean=run.mean + measured[0, 2] * np.eye(7)[3])
    settings = FilterSettings(kind="extended", gate=1e6)
    stats = replace(stats, head=signals)
    return run, measured, signals, make_filter(c, NOISE, stats, settings)


@pytest.mark.parametrize("cuts", [[], [7, 20, 41]], ids=["whole", "in pieces"])
def test_smoothed_covariances_are_those_of_a_joint_gaussian_in_extended_precision(
    vessel: Vessel, cuts: list[int]
) -> None:
    run, measured, signals, filter_ = gyro_run(vessel, 45)
    smoothed = smoothed_in_chunks((deepcopy(filter_), filter_), signals, cuts)
    expected = run.in_extended_precision().given(measured)
    states, covariances = (each.astype(float) for each in expected)
    assert apart(smoothed, (states, covariances))[1] < 1e-8


def test_smoothed_variances_round_as_far_as_the_filtered_ones_exceed_them(vessel: Vessel) -> None:
    """Where a piece ends changes the rounding, and neither way is nearer to the exact variances.

    At the start a filtered variance is far above the smoothed one, which is the difference of it
    and of what follows: the rounding of that, by each instant, is a share of the filtered one.
    """
    count = 600
    _, _, signals, filter_ = gyro_run(vessel, count)
    _, trace, _ = smoothed_run(deepcopy(filter_), signals)
    exact = smoothed_variances(trace)
    filtered = np.diagonal(trace.covariances, axis1=1, axis2=2)
    assert np.max(filtered / exact) > 1e4
    bound = exact.size * np.finfo(float).eps * filtered / exact
    for cuts in ([], [200, 450]):
        _, P = smoothed_in_chunks((deepcopy(filter_), deepcopy(filter_)), signals, cuts)
        errors = np.abs(np.diagonal(P, axis1=1, axis2=2) / exact - 1)
        assert np.all(errors <= bound), np.max(errors / bound)


def smoothed_variances(trace: Trace) -> np.ndarray:
    """Variances (n, s) by the recursion of Bierman in extended precision."""
    size, variances = trace.states.shape[1], np.empty(trace.states.shape)
    unit = np.eye(size, dtype=np.longdouble)
    curvature = np.zeros_like(unit)
    for k in range(len(variances) - 1, -1, -1):
        F, P = (array[k].astype(np.longdouble) for array in (trace.transitions, trace.covariances))
        curvature = F.T @ curvature @ F
        variances[k] = np.diag(P - P @ curvature @ P)
        for output in range(trace.rows.shape[1] - 1, -1, -1):
            c = trace.rows[k, output].astype(np.longdouble)
            M = unit - np.outer(trace.gains[k, output], c)
            curvature = M.T @ curvature @ M + np.outer(c, c) / trace.variances[k, output]
    return variances


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


# ---- ramps, waves and a slow error of the heading as states, of both filters that are smoothed

RAMP_AND_WAVE = replace(
    FURTHER,
    yaw=ForceNoise(1, 0.08, wave=0.7),
    surge=ForceNoise(1, 0.05, wave=0.5),
    heading_error=SlowError(5e-3, 3.0),
)
NOISES = {
    "extended": replace(NOISE, further=RAMP_AND_WAVE),
    "pseudo-input": NoiseModel(STDS, np.array([1e-2, 1e-3]), further=RAMP_AND_WAVE),
}
# dynamics, intensity of the noise, covariance at the start; the first state acts on the ship
Force = tuple[np.ndarray, np.ndarray, np.ndarray]


def ramp_and_wave(c: Coefficients, stats: SignalStats, noise: NoiseModel, axis: int) -> list[Force]:
    """The states of the yaw moment (0) or the surge force (1) of a straight ship."""
    force = (noise.further.yaw, noise.further.surge)[axis]
    R = (noise.measurement_std**2 * stats.interval_secs)[axis]
    std = (MOMENT_RUDDER * abs(c.d) * stats.max_rudder_effect, FORCE_SHARE * abs(c.h) * 80.0)[axis]
    std += MIN_FORCE
    slow, fast = force.frequency, force.wave
    integrators = 4 - axis  # from the noise of the slope to the output
    ramp = (
        np.array([[0.0, 1.0], [0.0, 0.0]]),
        np.diag([0.0, slow ** (2 * integrators) * R]),
        np.diag([std, std * slow]) ** 2,
    )
    s = 1j * fast
    plant = abs(s**2 - c.a * s - c.b1 if axis == 0 else s)  # from the output to the force
    intensity = 2 * R * (plant * WAVE_DECAY * fast) ** 2
    harmonic = np.array([[0.0, fast], [-fast, 0.0]])
    return [ramp, (harmonic, intensity * np.eye(2), std**2 * np.eye(2))]


def ship_of(
    kind: str, c: Coefficients, stats: SignalStats, inputs: np.ndarray
) -> tuple[LinearRun, np.ndarray, np.ndarray, np.ndarray]:
    """A filter's own states, their dynamics, their noise, and columns of moment and force."""
    noise = NOISES[kind]
    q = noise.process_ratio * STDS**2 * stats.interval_secs
    yaw = np.array([[0, 1], [c.b1, c.a]])
    if kind == "extended":
        run, intensity = three_states(c, noise, stats, *inputs.T), np.diag([0.0, *q])
        return run, block_diag(yaw, 0.0), intensity, np.array([[0.0, 0], [1, 0], [0, 1]])
    A = np.zeros((5, 5))
    A[:2, :2], A[2, 1:3] = yaw, yaw[1]
    pushed = np.array([[0.0, 0], [1, 0], [c.a, 0], [0, 1], [0, 0]])
    return five_states(c, noise, stats, *inputs.T), A, np.diag(np.repeat(q, (3, 2))), pushed


def by_mean_force(A: np.ndarray, pushed: np.ndarray, dynamics: np.ndarray) -> np.ndarray:
    """The change of a system in a step by the mean of a force, per state of the force."""
    driven = np.zeros((len(A) + 1, len(A) + 1))
    driven[:-1, :-1], driven[:-1, -1] = A, pushed
    nodes, weights = np.polynomial.legendre.leggauss(12)
    means = [expm(dynamics * DT / 2 * (1 + t))[0] for t in nodes]
    return np.outer(expm(driven * DT)[:-1, -1], weights / 2 @ means)


def forced_run(
    c: Coefficients, stats: SignalStats, inputs: np.ndarray, kind: str, heading: float
) -> LinearRun:
    """The ship's states, the heading's error, four pairs of force states, heading, and two biases.

    A force acts in a step by its mean, as in the filter; its noise acts at every moment.
    """
    run, A, intensity, pushed = ship_of(kind, c, stats, inputs)
    forces = [
        (axis, *force) for axis in (0, 1) for force in ramp_and_wave(c, stats, NOISES[kind], axis)
    ]
    own, error = len(A), NOISES[kind].further.heading_error
    psi = own + 9
    A = block_diag(A, [[-1 / error.secs]], *(force[1] for force in forces), np.zeros((3, 3)))
    A[psi, 0] = 1.0
    moved = [*range(own), psi]
    of_ship, pushed = A[np.ix_(moved, moved)], np.vstack((pushed, np.zeros(2)))
    places = [[own + 1 + 2 * i, own + 2 + 2 * i] for i in range(4)]
    for place, (axis, *_) in zip(places, forces, strict=True):
        A[moved, place[0]] = pushed[:, axis]
    walks = [SENSOR_WALKS[name] for name in ("gyro", "log")]
    walking = np.diag([0.0, *(walk.hourly_std**2 / HOUR for walk in walks)])
    slow = 2 * error.std**2 / error.secs
    F, Q = held(A, block_diag(intensity, [[slow]], *(force[2] for force in forces), walking), DT)
    for place, (axis, dynamics, *_) in zip(places, forces, strict=True):
        F[np.ix_(moved, place)] = by_mean_force(of_ship, pushed[:, axis], dynamics)
    priors = np.diag([FIRST_HEADING_STD, *(walk.std for walk in walks)]) ** 2
    P = block_diag(run.P, [[error.std**2]], *(force[3] for force in forces), priors)
    C = np.zeros((3, len(P)))
    C[:2, :own] = run.C
    C[0, psi + 1], C[1, psi + 2], C[2, [own, psi]] = 1.0, 1.0, 1.0
    mean = np.zeros((len(inputs), len(P)))
    mean[:, :own], mean[:, psi] = run.mean, sailed_with_heading(c, inputs)[:, 3] + heading
    return LinearRun(mean, F, Q, P, C, np.array([*STDS**2, HEADING_STD**2]))


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_ramps_and_waves_agree_with_a_joint_gaussian(vessel: Vessel, kind: str) -> None:
    c, inputs = straight(vessel.paper_coefficients), np.column_stack(steered(16, DT))
    stats = stats_of(c, inputs)
    _, measured = forced_run(c, stats, inputs, kind, 0.0).drawn(np.random.default_rng(2))
    measured[[3, 4, 9], 0], measured[1::3, 1], measured[[1, 2, 7], 2] = np.nan, np.nan, np.nan
    signals = measured_signals(measured, inputs)
    filter_ = make_filter(
        c, NOISES[kind], replace(stats, head=signals), FilterSettings(kind=kind, gate=1e6)
    )
    _, trace, smoothed = smoothed_run(filter_, signals)
    run = forced_run(c, stats, inputs, kind, measured[0, 2])
    # the batch rounds more, as the heading is at first known to half a radian only
    assert max(apart((trace.states, trace.covariances), run.filtered(measured))) < 1e-7
    assert max(apart(smoothed, run.given(measured))) < 1e-7


def test_the_errors_of_the_enlarged_pseudo_input_filter_are_as_its_covariance_states(
    vessel: Vessel,
) -> None:
    """Where the process noise drives all states, as the paper assumes."""
    kind = "pseudo-input"
    c, inputs = straight(vessel.paper_coefficients), np.column_stack(steered(200, DT))
    stats = stats_of(c, inputs)
    run = forced_run(c, stats, inputs, kind, 0.0)
    size = run.mean.shape[1]
    head = measured_signals(run.mean @ run.C.T, inputs)
    new = make_filter(
        c, NOISES[kind], replace(stats, head=head), FilterSettings(kind=kind, gate=1e6)
    )
    squares = np.zeros((2, 3))
    for seed in range(SEEDS):
        true, measured = run.drawn(np.random.default_rng(seed))
        _, trace, smoothed = smoothed_run(deepcopy(new), measured_signals(measured, inputs))
        for way, (x, P) in enumerate(((trace.states, trace.covariances), smoothed)):
            for i, at in enumerate((20, 90, 199)):
                squares[way, i] += normalised_squared(x[at] - true[at], P[at])
    low, high = band(SEEDS * size)
    assert low < squares.min(), squares
    assert squares.max() < high, squares


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_where_chunks_are_cut_changes_smoothed_further_states_by_rounding_alone(
    vessel: Vessel, kind: str
) -> None:
    """All sensor errors, heading, position, current, and both forces with ramp and wave."""
    c, count, rng = vessel.paper_coefficients, 120, np.random.default_rng(5)
    inputs = np.column_stack(steered(count, DT))
    psi = 2e-3 * DT * np.arange(count)
    track = np.cumsum(8 * DT * np.column_stack((np.cos(psi), np.sin(psi))), axis=0)
    true = np.column_stack((np.full(count, 2e-3), np.full(count, 8.0), psi, track))
    measured = true + np.array([*STDS, HEADING_STD, 1.0, 1.0]) * rng.standard_normal((count, 5))
    measured[30:50, 0], measured[1::2, 3:] = np.nan, np.nan
    signals = measured_signals(measured[:, :3], inputs)
    position = {"north": measured[:, 3], "east": measured[:, 4]}
    signals = replace(signals, values=dict(signals.values) | position)
    further = replace(
        RAMP_AND_WAVE,
        outputs=FURTHER_OUTPUTS, output_stds=(HEADING_STD, 1.0, 1.0), sensors=tuple(SENSOR_WALKS),
    )  # fmt: skip
    noise, stats = replace(NOISES[kind], further=further), stats_of(c, inputs)
    stats = replace(stats, head=signals)
    new = make_filter(c, noise, stats, FilterSettings(kind=kind))
    whole = smoothed_run(deepcopy(new), signals)[2]
    for cuts in ([1, 17, 40, 80], list(range(1, count))):
        cut = smoothed_in_chunks((deepcopy(new), deepcopy(new)), signals, cuts)
        assert max(apart(cut, whole)) < 1e-9
