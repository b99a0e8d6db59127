from dataclasses import replace

import numpy as np
import pytest

from analysis.design.discrete import discretise
from analysis.design.pseudo_input import pseudo_input_matrices, pseudo_inputs
from analysis.gauge import gauge
from analysis.kalman import (
    OUTPUTS,
    PAPER_RATIO,
    FilterState,
    Noise,
    _motion,
    filter_states,
    noise_of,
)
from analysis.residuals import judge
from recorders.sensors import suite
from recorders.simulate import SimulatedTrial, simulate
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample
from shiplog.settings import FilterSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STATE_OF = {"yaw_rate": 0, "speed": 3}


def on_one_clock(trial: SimulatedTrial) -> Signals:
    return resample(TrialLog("trial", trial.channels), channels=NAMES)


def filtered(trial: SimulatedTrial, vessel: Vessel):  # noqa: ANN201
    signals = on_one_clock(trial)
    noise = noise_of(gauge(signals, vessel.coefficients), vessel.coefficients, vessel.filter)
    return signals, filter_states(signals, vessel.coefficients, noise)


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
    for i, name in enumerate(OUTPUTS):
        found = judge(
            name,
            "",
            estimates.innovations[:, i],
            estimates.innovation_stds[:, i],
            noise_measured=True,
        )
        assert found.white, found
        assert found.consistent, found


def test_the_papers_slow_wave_makes_the_innovations_coloured(zigzag: SimulatedTrial) -> None:
    vessel, _ = load_vessel("table1")
    _, estimates = filtered(zigzag, vessel)
    speed = judge(
        "speed",
        "",
        estimates.innovations[:, 1],
        estimates.innovation_stds[:, 1],
        noise_measured=True,
    )
    assert not speed.white


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


def test_a_joint_gaussian_by_brute_force_agrees_on_a_short_linear_run(vessel: Vessel) -> None:
    """The linear part alone: all that was measured, conditioned on in one go."""
    c = vessel.coefficients._replace(b2=0, b3=0, f=0, g=0, h=0, d=0, e=0)
    n, dt, rng = 12, 0.5, np.random.default_rng(4)
    measured = rng.standard_normal((n, 2)) * [1e-3, 0.1] + [0.01, 8.0]
    measured[4:6, 0] = np.nan
    measured[7, :] = np.nan
    signals = Signals(
        0,
        dt,
        {
            "yaw_rate": measured[:, 0],
            "speed": measured[:, 1],
            "rudder": np.zeros(n),
            "rpm": np.zeros(n),
        },
    )
    r = np.array([1e-3, 0.1]) ** 2
    noise = Noise(np.sqrt(r), np.array([0.3, 0.02]), tuned=False)
    estimates = filter_states(signals, c, noise)

    A, _ = pseudo_input_matrices(c, 1.0)
    F, Q = discretise(A, np.diag(np.repeat(noise.process_ratio * r * dt, (3, 2))), dt)
    # the filter's own prior, read off its first, unmeasured prediction error
    dw, dv = np.nanstd(measured, axis=0) + 1e-9
    rate = abs(c.a) + 1e-3
    P0 = np.diag([dw, rate * dw, rate**2 * dw, dv, 1e-2 * dv]) ** 2
    w0, v0 = measured[0]
    mean0 = np.array([w0, 0.0, c.b1 * w0, v0, 0.0])
    powers = [np.linalg.matrix_power(F, k) for k in range(n)]
    mean = np.concatenate([P @ mean0 for P in powers])
    covariance = np.zeros((5 * n, 5 * n))
    for i in range(n):
        for j in range(n):
            block = powers[i] @ P0 @ powers[j].T
            for k in range(1, min(i, j) + 1):
                block = block + powers[i - k] @ Q @ powers[j - k].T
            covariance[5 * i : 5 * i + 5, 5 * j : 5 * j + 5] = block
    for k in range(n):
        seen = [(t, o) for t in range(k + 1) for o in range(2) if np.isfinite(measured[t, o])]
        rows = [5 * t + (0, 3)[o] for t, o in seen]
        S = covariance[np.ix_(rows, rows)] + np.diag([r[o] for _, o in seen])
        gain = np.linalg.solve(S, covariance[rows]).T
        y = np.array([measured[t, o] for t, o in seen])
        x = (mean + gain @ (y - mean[rows]))[5 * k : 5 * k + 5]
        P = (covariance - gain @ covariance[rows])[5 * k : 5 * k + 5, 5 * k : 5 * k + 5]
        assert estimates.states[k] == pytest.approx(x, rel=1e-9, abs=1e-15)
        assert estimates.stds[k] == pytest.approx(np.sqrt(np.diag(P)), rel=1e-7)


def test_missing_samples_are_predicted_through_and_the_doubt_grows(
    zigzag: SimulatedTrial, vessel: Vessel
) -> None:
    signals = on_one_clock(zigzag)
    noise = noise_of(gauge(signals, vessel.coefficients), vessel.coefficients, vessel.filter)
    holed = {name: values.copy() for name, values in signals.values.items()}
    holed["yaw_rate"][2000:2600] = np.nan
    gapped = replace(signals, values=holed)
    estimates = filter_states(gapped, vessel.coefficients, noise)
    assert np.all(np.isnan(estimates.innovations[2000:2600, 0]))
    assert np.all(np.diff(estimates.stds[2000:2600, 0]) > 0)
    error = errors(zigzag, signals, estimates.states[:, 0], "yaw_rate")
    assert np.abs(error[2000:2600]).max() < 4 * estimates.stds[2599, 0]


def test_with_nothing_measured_the_filter_only_predicts(vessel: Vessel) -> None:
    trial = simulate(vessel, "turning-circle", duration_secs=200.0, sensors=suite("none"))
    signals = on_one_clock(trial)
    values = {name: signals[name].copy() for name in NAMES}
    values["yaw_rate"][1:], values["speed"][1:] = np.nan, np.nan
    noise = Noise(np.array([1e-5, 1e-2]), np.full(2, 1e-4), tuned=False)
    estimates = filter_states(replace(signals, values=values), vessel.coefficients, noise)
    truth = trial.trajectory.at(signals.time_secs)
    assert estimates.states[:, 0] == pytest.approx(truth["yaw_rate"], abs=1e-8)
    assert estimates.states[:, 3] == pytest.approx(truth["speed"], abs=1e-6)


def test_what_the_vessel_file_states_is_taken(zigzag: SimulatedTrial, vessel: Vessel) -> None:
    signals = on_one_clock(zigzag)
    settings = FilterSettings(process_ratio=1e-3, yaw_rate_std=1e-4, speed_std=0.2)
    noise = noise_of(gauge(signals, vessel.coefficients), vessel.coefficients, settings)
    assert noise.measurement_std == pytest.approx([1e-4, 0.2])
    assert noise.process_ratio == pytest.approx([1e-3, 1e-3])
    assert noise.measured == (False, False)
    assert not noise.tuned


def test_a_wrong_model_is_given_more_process_noise_than_the_true_one(
    zigzag: SimulatedTrial, vessel: Vessel
) -> None:
    signals = on_one_clock(zigzag)
    c = vessel.coefficients
    right = noise_of(gauge(signals, c), c, FilterSettings())
    wrong = noise_of(
        gauge(signals, c._replace(d=0.7 * c.d, a=0.7 * c.a)),
        c._replace(d=0.7 * c.d, a=0.7 * c.a),
        FilterSettings(),
    )
    assert right.process_ratio[0] < 3 * PAPER_RATIO
    assert wrong.process_ratio[0] > 10 * right.process_ratio[0]


def test_the_filters_motion_is_a_x_plus_b_u(vessel: Vessel) -> None:
    rng, c = np.random.default_rng(6), vessel.coefficients
    for _ in range(50):
        x = rng.uniform([-0.01, -3e-4, -1e-5, 3, -0.05], [0.01, 3e-4, 1e-5, 12, 0.05])
        delta, rate, n, n_dot = rng.uniform([-0.6, -0.05, 40, -1], [0.6, 0.05, 120, 1])
        A, B = pseudo_input_matrices(c, float(np.sign(x[0])))
        expected = A @ x + B @ pseudo_inputs(x, delta, rate, n, n_dot, c.alpha3)
        assert _motion(c, FilterState(*x), delta, rate, n, n_dot) == pytest.approx(
            expected.tolist(), rel=1e-12, abs=1e-18
        )
