from dataclasses import replace

import numpy as np
import pytest
from filter_runs import (
    PATTERNS,
    estimates_of,
    five_states,
    measured_as,
    sailed,
    signals_of,
    steered,
    straight,
)
from gaussian import apart

from analysis.design.pseudo_input_system import (
    printed_input_matrix,
    pseudo_input_matrices,
    pseudo_inputs,
)
from analysis.filters.factory import filter_states, make_filter
from analysis.filters.noise_model import NoiseModel
from analysis.filters.pseudo_input import MotionState, motion
from analysis.filters.tuning import noise_of
from analysis.replay.residuals import assess_innovations
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS, rudder_effect
from shiplog.vessel.settings import FilterSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STATE_OF = {"yaw_rate": 0, "speed": 3}
STATED = FilterSettings(kind="pseudo-input", process_ratio=2.5e-5)
SPREAD = np.array([1e-3, 0.5])


def on_one_clock(trial: SimulatedTrial) -> Signals:
    return resample(TrialLog("trial", trial.channels), channels=NAMES)


def filtered(trial: SimulatedTrial, vessel: Vessel):  # noqa: ANN201
    signals, c = on_one_clock(trial), vessel.coefficients
    noise = noise_of(signal_stats(signals, c), c, STATED)
    return signals, filter_states(signals, c, noise, STATED)


def errors(trial: SimulatedTrial, signals: Signals, values: np.ndarray, name: str) -> np.ndarray:
    return values - trial.trajectory.at(signals.time_secs)[name]


@pytest.mark.parametrize("preset", ["table1", "table1-rad"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_under_the_papers_noise_the_filter_is_three_times_nearer_the_truth(
    preset: str, seed: int
) -> None:
    vessel, _ = load_vessel(preset)
    sensors = suite("paper", angle_unit=vessel.angle_unit)
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, seed=seed, sensors=sensors)
    signals, estimates = filtered(trial, vessel)
    for name, state in STATE_OF.items():
        measured = errors(trial, signals, signals[name], name)
        estimated = errors(trial, signals, estimates.states[:, state], name)
        assert np.std(measured) / np.sqrt(np.mean(estimated**2)) >= 3


@pytest.mark.parametrize("seed", range(5))
def test_under_white_noise_the_true_models_innovations_are_white_and_as_large_as_expected(
    vessel: Vessel, seed: int
) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, seed=seed, sensors=suite("white"))
    _, estimates = filtered(trial, vessel)
    for i, name in enumerate(PAPER_OUTPUTS):
        e, s = estimates.innovations[:, i], estimates.innovation_stds[:, i]
        result = assess_innovations(name, "", e, s, noise_measured=True)
        assert result.white, result
        assert result.consistent, result


def test_the_papers_slow_wave_makes_the_innovations_coloured(
    zigzag: SimulatedTrial, vessel: Vessel
) -> None:
    _, estimates = filtered(zigzag, vessel)
    e, s = estimates.innovations[:, 1], estimates.innovation_stds[:, 1]
    assert not assess_innovations("speed", "", e, s, noise_measured=True).white


def test_without_noise_the_filter_follows_the_truth_in_all_five_states(vessel: Vessel) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=300.0, sensors=suite("none"))
    signals, estimates = filtered(trial, vessel)
    truth = trial.trajectory.at(signals.time_secs)
    assert estimates.states[:, 0] == pytest.approx(truth["yaw_rate"], abs=2e-7)
    assert estimates.states[:, 3] == pytest.approx(truth["speed"], abs=2e-5)
    w_dot = truth["yaw_acceleration"]
    assert estimates.states[:, 1] == pytest.approx(w_dot, abs=1e-3 * np.abs(w_dot).max())
    rise = slice(115, 175)  # where the rudder moves evenly, w'' has no jumps
    slope = np.gradient(w_dot, signals.dt_secs)[rise]
    assert estimates.states[rise, 2] == pytest.approx(slope, rel=0.02, abs=1e-7)


def test_missing_samples_are_predicted_through_and_the_doubt_grows(
    zigzag: SimulatedTrial, vessel: Vessel
) -> None:
    signals, c = on_one_clock(zigzag), vessel.coefficients
    noise = noise_of(signal_stats(signals, c), c, STATED)
    holed = {name: values.copy() for name, values in signals.values.items()}
    holed["yaw_rate"][2000:2600] = np.nan
    estimates = filter_states(replace(signals, values=holed), c, noise, STATED)
    assert np.all(np.isnan(estimates.innovations[2000:2600, 0]))
    assert np.all(np.diff(estimates.stds[2000:2600, 0]) > 0)
    error = errors(zigzag, signals, estimates.states[:, 0], "yaw_rate")
    assert np.abs(error[2000:2600]).max() < 4 * estimates.stds[2599, 0]


def test_with_nothing_measured_the_filter_only_predicts(vessel: Vessel) -> None:
    trial = simulate(vessel, "turning-circle", duration_secs=200.0, sensors=suite("none"))
    signals = on_one_clock(trial)
    values = {name: signals[name].copy() for name in NAMES}
    values["yaw_rate"][1:], values["speed"][1:] = np.nan, np.nan
    noise = NoiseModel(np.array([1e-5, 1e-2]), np.full(2, 1e-4))
    estimates = filter_states(replace(signals, values=values), vessel.coefficients, noise)
    truth = trial.trajectory.at(signals.time_secs)
    assert estimates.states[:, 0] == pytest.approx(truth["yaw_rate"], abs=1e-8)
    assert estimates.states[:, 3] == pytest.approx(truth["speed"], abs=1e-6)


def test_the_filters_motion_is_a_x_plus_b_u(vessel: Vessel) -> None:
    rng, c = np.random.default_rng(6), vessel.coefficients
    for _ in range(50):
        x = rng.uniform([-0.01, -3e-4, -1e-5, 3, -0.05], [0.01, 3e-4, 1e-5, 12, 0.05])
        delta, rate, n, n_dot = rng.uniform([-0.6, -0.05, 40, -1], [0.6, 0.05, 120, 1])
        A, B = pseudo_input_matrices(c, float(np.sign(x[0])))
        expected = A @ x + B @ pseudo_inputs(x, delta, rate, n, n_dot, c.alpha3)
        assert motion(c, MotionState(*x), delta, rate, n, n_dot) == pytest.approx(
            expected.tolist(), rel=1e-12, abs=1e-18
        )


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("dt", [0.1, 0.4])
def test_a_joint_gaussian_by_brute_force_agrees_on_a_short_linear_run(
    vessel: Vessel, pattern: str, dt: float
) -> None:
    """All that was measured, conditioned on in one go; the rudder moves."""
    c, rng = straight(vessel.coefficients), np.random.default_rng(4)
    delta, n = steered(14, dt)
    delta = delta + 0.2 * rng.random(14)
    measured = rng.standard_normal((14, 2)) * [1e-3, 0.1] + [0.01, 8.0]
    measured = measured_as(pattern, measured)
    signals = signals_of(measured, delta, n, dt)
    noise, stats = (
        NoiseModel(np.array([1e-3, 0.1]), np.array([0.3, 0.02])),
        signal_stats(signals, c),
    )
    filtering = make_filter(c, noise, stats, STATED)
    estimates, trace = filtering.trace(signals, last_inputs(signals))
    by_force = five_states(c, noise, stats, delta, n).filtered(measured)
    assert max(apart((trace.states, trace.covariances), by_force)) < 1e-9
    assert np.array_equal(estimates.states, trace.states)
    variances = np.diagonal(by_force[1], axis1=1, axis2=2)
    np.testing.assert_allclose(estimates.stds, np.sqrt(variances), rtol=1e-9)


def test_with_nothing_measured_at_all_it_is_the_ships_motion_and_the_doubt_is_a_s(
    vessel: Vessel,
) -> None:
    c, dt = vessel.coefficients, 0.1
    delta, n = steered(600, dt)
    n = n + 20 * np.sin(np.arange(600) * dt / 15)
    start = np.array([2e-3, 0.0, 7.0])
    signals = signals_of(np.full((600, 2), np.nan), delta, n, dt)
    stats = replace(
        signal_stats(signals_of(np.ones((600, 2)), delta, n, dt), c),
        first=start[[0, 2]],
        std=SPREAD,
    )
    noise = NoiseModel(np.array([1e-4, 0.1]), np.array([1e-2, 1e-3]))
    filtering = make_filter(c, noise, stats, STATED)
    estimates, trace = filtering.trace(signals, last_inputs(signals))
    expected = estimates_of(c, sailed(c, start, delta, n, dt), delta, n, dt)
    for result, true in zip(estimates.states[:-1].T, expected[:-1].T, strict=True):
        assert result == pytest.approx(true, abs=1e-8 * np.abs(true).max())
    run = five_states(straight(c), noise, stats, delta[:1], n[:1])
    P = trace.covariances[0]
    np.testing.assert_allclose(P, run.P, rtol=1e-12)
    for result in trace.covariances[1:]:
        P = run.F @ P @ run.F.T + run.Q
        np.testing.assert_allclose(result, P, rtol=1e-9)


def test_as_printed_the_jump_of_the_rudder_is_missing_from_the_yaw_jerk(vessel: Vessel) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=60.0, sensors=suite("none"))
    signals = resample(TrialLog("trial", trial.channels), channels=(*PAPER_OUTPUTS, *PAPER_INPUTS))
    c, stats = vessel.coefficients, signal_stats(signals, vessel.coefficients)
    noise = NoiseModel(np.array([1e-5, 1e-2]), np.full(2, 1e-4))
    ours, printed = (
        make_filter(c, noise, stats, replace(STATED, as_printed=flag)).step(
            signals, last_inputs(signals)
        )
        for flag in (False, True)
    )
    starts = int(np.flatnonzero(np.diff(signals["rudder"]))[0])
    assert np.array_equal(ours.states[:starts], printed.states[:starts])
    v, rate = ours.states[starts, 3], np.diff(signals["rudder"])[starts] / signals.dt_secs
    jump = rudder_effect(c, v, signals["rpm"][starts]) * c.e * rate
    missing = ours.states[starts, 2] - printed.states[starts, 2]
    assert missing == pytest.approx(jump, rel=0.02)


def test_the_matrix_as_printed_is_not_the_derivative_and_ours_is(vessel: Vessel) -> None:
    c = vessel.coefficients
    right, printed = pseudo_input_matrices(c, 1.0)[1], printed_input_matrix(c)
    assert printed.shape == (5, 19)
    wrong = np.flatnonzero(np.any(right[:, :19] != printed, axis=1))
    assert wrong.tolist() == [2, 4]  # the rows of w''' and v''
