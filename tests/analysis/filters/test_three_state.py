from dataclasses import replace

import numpy as np
import pytest
from filter_runs import (
    PATTERNS,
    designed_gain,
    estimates_of,
    measured_as,
    pushes,
    rates,
    sailed,
    signals_of,
    steered,
    straight,
    three_states,
)
from gaussian import apart
from scipy.integrate import solve_ivp

from analysis.filters.core import StepInputs
from analysis.filters.factory import filter_states, make_filter
from analysis.filters.gains import linear_axes
from analysis.filters.noise_model import NoiseModel, Wave
from analysis.filters.ship_step import predict_ship, ship_row
from analysis.filters.tuning import noise_of
from analysis.replay.residuals import assess_innovations
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample
from shiplog.ships.paper import PAPER_OUTPUTS, Coefficients
from shiplog.vessel.settings import FilterSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STATE_OF = {"yaw_rate": 0, "speed": 3}
KINDS = ("extended", "steady-state", "quality", "per-tick")
EXTENDED = FilterSettings(kind="extended")
WAVE = Wave(frequency=0.6, damping=0.1, std=4e-4, evidence=1.0)
WAVES = pytest.mark.parametrize("wave", [None, WAVE], ids=["calm", "waves"])
STDS, SPREAD = np.array([1e-4, 0.1]), np.array([1e-3, 0.5])
UNITS = np.array([1e-3, 1e-4, 1.0])  # of w, w' and v
NOISE = NoiseModel(STDS, np.array([1e-4, 1e-3]))


def on_one_clock(trial: SimulatedTrial) -> Signals:
    return resample(TrialLog("trial", trial.channels), channels=NAMES)


def errors(trial: SimulatedTrial, signals: Signals, values: np.ndarray, name: str) -> np.ndarray:
    return values - trial.trajectory.at(signals.time_secs)[name]


def helm(count: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Rudder and revolutions, both in motion."""
    delta, n = steered(count, dt)
    return delta, n + 20 * np.sin(np.arange(count) * dt / 15)


def stats_of(c: Coefficients, signals: Signals, **known: object) -> SignalStats:
    """Of signals that need not have been measured."""
    there = dict(signals.values)
    there |= {"yaw_rate": np.full(len(signals), 2e-3), "speed": np.full(len(signals), 7.0)}
    return replace(signal_stats(replace(signals, values=there), c), std=SPREAD, **known)


def drawn(rng: np.random.Generator) -> tuple[np.ndarray, float, float, float, float]:
    """A ship in motion: w, w', v, and rudder and revolutions, each with its rate."""
    x = rng.uniform([-8e-3, -2e-4, 2.0], [8e-3, 2e-4, 11.0])
    return x, *rng.uniform([-0.6, -0.05, 40, -1], [0.6, 0.05, 120, 1]).tolist()


def acting(*u: float, moment: float = 0.0, force: float = 0.0) -> StepInputs:
    return StepInputs(*u, moment, force)


def step(c: Coefficients, x: np.ndarray, u: tuple[float, ...], dt: float) -> np.ndarray:
    moved = x.copy()
    predict_ship(c, moved, np.zeros((len(x), len(x))), np.zeros((3, 0)), acting(*u), dt)
    return moved


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("dt", [0.1, 1.0])
def test_a_step_is_the_ships_own(vessel: Vessel, seed: int, dt: float) -> None:
    c = vessel.coefficients
    x, delta, delta_dot, n, n_dot = drawn(np.random.default_rng(seed))

    def moving(t: float, s: np.ndarray) -> np.ndarray:
        return rates(c, s, delta + delta_dot * t, delta_dot, n + n_dot * t)

    exact = solve_ivp(moving, (0, dt), x, "DOP853", rtol=1e-13, atol=1e-18).y[:, -1]
    result = step(c, x, (delta, delta_dot, n, n_dot), dt)
    np.testing.assert_allclose(result, exact, rtol=1e-7 * dt**4 + 1e-10)


@pytest.mark.parametrize("seed", range(20))
def test_the_transition_is_the_derivative_of_the_step(vessel: Vessel, seed: int) -> None:
    c, dt = vessel.coefficients, 0.7
    x, *u = drawn(np.random.default_rng(seed))
    F = np.zeros((3, 3))
    predict_ship(c, x.copy(), F, np.zeros((3, 0)), acting(*u), dt)
    for j, h in enumerate((1e-6, 1e-6, 1e-4)):
        shift = h * np.eye(3)[j]
        slope = (step(c, x + shift, u, dt) - step(c, x - shift, u, dt)) / (2 * h)
        assert F[:, j] / UNITS == pytest.approx(slope / UNITS, rel=1e-6, abs=1e-6 / UNITS[j])


@WAVES
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("dt", [0.1, 0.4])
@pytest.mark.parametrize("seed", range(2))
def test_a_joint_gaussian_by_brute_force_agrees_on_a_short_linear_run(
    vessel: Vessel, pattern: str, dt: float, wave: Wave | None, seed: int
) -> None:
    """All that was measured, conditioned on in one go; the rudder moves."""
    c, rng = straight(vessel.coefficients), np.random.default_rng(seed)
    delta, n = steered(14, dt)
    delta = delta + 0.2 * rng.random(14)
    measured = rng.standard_normal((14, 2)) * [1e-3, 0.1] + [0.01, 8.0]
    measured = measured_as(pattern, measured)
    signals = signals_of(measured, delta, n, dt)
    noise = NoiseModel(np.array([1e-3, 0.1]), np.array([0.1, 0.02]), wave=wave)
    stats = signal_stats(signals, c)
    estimates, trace = make_filter(c, noise, stats, EXTENDED).trace(signals, last_inputs(signals))
    run = three_states(c, noise, stats, delta, n)
    states, covariances = run.filtered(measured)
    result = trace.states[:, :3], trace.covariances[:, :3, :3]
    assert max(apart(result, (states[:, :3], covariances[:, :3, :3]))) < 1e-9
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    stds = np.sqrt(variances[:, :3])
    np.testing.assert_allclose(estimates.stds[:, [0, 1, 3]], stds, rtol=1e-9)
    if wave is None:
        assert estimates.wave is None
    else:
        expected = states[:, 3:] @ run.C[0, 3:]
        assert estimates.wave == pytest.approx(expected, rel=1e-9, abs=1e-9 * wave.std)


def transition(c: Coefficients, x: np.ndarray, u: tuple[float, ...], dt: float) -> np.ndarray:
    """The derivative of the ship's motion by where it begins, by its own equation."""
    delta, delta_dot, n, n_dot = u

    def moving(t: float, s: np.ndarray) -> np.ndarray:
        w, _, v = s[:3]
        steering, turns = c.d * (delta + delta_dot * t) + c.e * delta_dot, n + n_dot * t
        slope = c.alpha1 - c.alpha2 * c.alpha3 * turns * np.exp(-c.alpha3 * v)
        J = [
            [0, 1, 0],
            [c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w**2, c.a, slope * steering],
            [2 * c.f * w, 0, 2 * c.g * v],
        ]
        whole = rates(c, s[:3], delta + delta_dot * t, delta_dot, turns)
        return np.concatenate((whole, (J @ s[3:].reshape(3, 3)).ravel()))

    start = np.concatenate((x, np.eye(3).ravel()))
    done = solve_ivp(moving, (0, dt), start, "DOP853", rtol=1e-13, atol=1e-18)
    return done.y[3:, -1].reshape(3, 3)


@pytest.mark.parametrize("kind", KINDS)
def test_with_nothing_measured_at_all_it_is_the_ships_motion_and_the_doubt_grows_with_it(
    vessel: Vessel, kind: str
) -> None:
    c, dt, count = vessel.coefficients, 0.1, 80
    delta, n = helm(count, dt)
    signals = signals_of(np.full((count, 2), np.nan), delta, n, dt)
    start = np.array([2e-3, 0.0, 7.0])
    stats = stats_of(c, signals, first=start[[0, 2]], yaw_rate_rms=4e-3, median_speed=6.0)
    filtering = make_filter(c, NOISE, stats, FilterSettings(kind=kind))
    estimates, trace = filtering.trace(signals, last_inputs(signals))
    path = sailed(c, start, delta, n, dt)
    expected = estimates_of(c, path, delta, n, dt)
    for result, true in zip(estimates.states.T, expected.T, strict=True):
        assert result == pytest.approx(true, abs=1e-9 * np.abs(true).max())
    P, Q = trace.covariances[0], pushes(c, NOISE, stats)
    for k in range(count - 1):
        u = delta[k], (delta[k + 1] - delta[k]) / dt, n[k], (n[k + 1] - n[k]) / dt
        F = transition(c, path[k], u, dt)
        P = F @ P @ F.T + Q
        result = trace.states[k + 1], trace.covariances[k + 1]
        assert max(apart(result, (path[k + 1], P))) < 1e-9


def test_every_gain_begins_as_unsure_as_the_signals_vary(vessel: Vessel) -> None:
    c = vessel.coefficients
    signals = signals_of(np.full((4, 2), np.nan), *helm(4, 0.1), 0.1)
    stats = stats_of(c, signals, first=np.array([2e-3, 8.0]))
    for kind in KINDS:
        filtering = make_filter(c, NOISE, stats, FilterSettings(kind=kind))
        estimates = filtering.step(signals, last_inputs(signals))
        assert estimates.states[0, [0, 1, 3]] == pytest.approx([2e-3, 0.0, 8.0])
        assert estimates.stds[0, [0, 3]] == pytest.approx(SPREAD, rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_state_is_the_slope_of_what_is_one(vessel: Vessel, kind: str) -> None:
    """Differences of five points; the rudder and the revolutions move evenly."""
    c, dt, count = vessel.coefficients, 0.1, 300
    delta, n = np.linspace(-0.2, 0.3, count), np.linspace(60.0, 90.0, count)
    signals = signals_of(np.full((count, 2), np.nan), delta, n, dt)
    stats = stats_of(c, signals, first=np.array([2e-3, 7.0]))
    filtering = make_filter(c, NOISE, stats, FilterSettings(kind=kind))
    states = filtering.step(signals, last_inputs(signals)).states
    for derivative, of in ((2, 1), (4, 3)):
        x = states[:, of]
        slope = (x[:-4] - 8 * x[1:-3] + 8 * x[3:-1] - x[4:]) / (12 * dt)
        away = np.abs(states[2:-2, 0]) > 1e-5  # where w|w| has no corner
        assert states[2:-2, derivative][away] == pytest.approx(slope[away], rel=1e-6, abs=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_no_state_is_as_unsure_as_the_states_it_follows_from(
    vessel: Vessel, seed: int
) -> None:
    rng, c, dt = np.random.default_rng(seed), vessel.coefficients, 0.1
    x, delta, delta_dot, n, _ = drawn(rng)
    root = 1e-3 * UNITS[:, None] * rng.standard_normal((3, 3))
    row = np.empty(10)
    u = acting(delta, delta_dot, n, 0.0)
    ship_row(c, x, root @ root.T, u, np.zeros((2, 3)), row)
    helm = np.array([delta, delta + delta_dot * dt]), np.full(2, n)
    close = np.testing.assert_allclose
    close(row[:5], estimates_of(c, np.array([x, x]), *helm, dt)[0], rtol=1e-12)
    cloud = x + rng.standard_normal((200_000, 3)) @ root.T
    w, w_dot, v = cloud.T
    _, turning, driving = rates(c, cloud, delta, delta_dot, n).T
    drawn_stds = np.std((w, w_dot, turning, v, driving), axis=1)
    close(np.sqrt(row[5:]), drawn_stds, rtol=0.01)
    slopes = [
        (
            estimates_of(c, np.array([x + h] * 2), *helm, dt)
            - estimates_of(c, np.array([x - h] * 2), *helm, dt)
        )[0]
        for h in np.diag(1e-4 * UNITS)
    ]
    J = np.array(slopes).T / (2e-4 * UNITS)
    close(row[5:], np.diag(J @ root @ root.T @ J.T), rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS[1:])
def test_any_other_gain_is_kept_in_a_straight_ship_once_the_best_one_has_fallen_to_it(
    vessel: Vessel, kind: str
) -> None:
    """x + K (y - C x), measurement by measurement, and the ship's own motion between them."""
    c, dt, count = straight(vessel.coefficients), 0.1, 1200
    rng, (delta, n) = np.random.default_rng(2), steered(count, dt)
    measured = rng.standard_normal((count, 2)) * STDS + [2e-3, 8.0]
    measured[::3, 1] = np.nan
    signals = signals_of(measured, delta, n, dt)
    stats = signal_stats(signals, c)
    settings = FilterSettings(kind=kind, gate=1e6)
    K = np.zeros((2, 3))
    of_yaw, of_surge = linear_axes(c, NOISE, stats)
    K[0, :2], K[1, 2:] = (designed_gain(settings, one)[0] for one in (of_yaw, of_surge))
    filtering = make_filter(c, NOISE, stats, settings)
    estimates, trace = filtering.trace(signals, last_inputs(signals))
    run = three_states(c, NOISE, stats, delta, n)
    deviation, P, handed_over, taken = np.zeros(3), run.P, [False, False], [0, 0]
    poles = [np.abs(designed_gain(settings, one)[1]).max() for one in (of_yaw, of_surge)]
    for k in range(count):
        for output in np.flatnonzero(np.isfinite(measured[k])):
            C = run.C[output]
            best = P @ C / (C @ P @ C + run.r[output])
            taken[output] += 1
            handed_over[output] |= bool(C @ best <= 1.5 * C @ K[output])
            handed_over[output] |= bool(poles[output] ** taken[output] < np.exp(-1))
            gain = K[output] if handed_over[output] else best
            kept = np.eye(3) - np.outer(gain, C)
            deviation = deviation + gain * (measured[k, output] - C @ (run.mean[k] + deviation))
            P = kept @ P @ kept.T + run.r[output] * np.outer(gain, gain)
        result = trace.states[k], trace.covariances[k]
        assert max(apart(result, (run.mean[k] + deviation, P))) < 1e-9
        deviation, P = run.F @ deviation, run.F @ P @ run.F.T + run.Q
    assert handed_over == [True, True]
    assert not estimates.rejected.any()


@WAVES
@pytest.mark.parametrize("kind", KINDS[1:])
def test_the_gains_taken_are_those_designed_for_the_sensors_own_interval(
    vessel: Vessel, kind: str, wave: Wave | None
) -> None:
    c, dt, count = straight(vessel.coefficients), 0.2, 3000
    delta, n = steered(count, dt)
    measured = np.random.default_rng(2).standard_normal((count, 2)) * STDS + [2e-3, 8.0]
    measured[np.arange(count) % 4 > 0, 0], measured[1::2, 1] = np.nan, np.nan
    signals, noise = signals_of(measured, delta, n, dt), replace(NOISE, wave=wave)
    stats, settings = signal_stats(signals, c), FilterSettings(kind=kind, gate=1e6)
    yaw, surge = linear_axes(c, noise, stats)
    assert (yaw.interval_secs, surge.interval_secs) == pytest.approx((4 * dt, 2 * dt))
    filtering = make_filter(c, noise, stats, settings)
    _, trace = filtering.trace(signals, last_inputs(signals))
    designed = np.delete(trace.gains[::4, 0], 2, axis=1), trace.gains[::2, 1, 2:3]
    for result, channel in zip(designed, (yaw, surge), strict=True):
        gain, _ = designed_gain(settings, channel)
        once_settled = result[len(result) // 2 :]
        np.testing.assert_allclose(once_settled, np.tile(gain, (len(once_settled), 1)), rtol=1e-7)


def stated(c: Coefficients, signals: Signals, kind: str = "extended"):  # noqa: ANN201
    settings = FilterSettings(kind=kind, process_ratio=2.5e-5)
    return noise_of(signal_stats(signals, c), c, settings), settings


@pytest.mark.parametrize("preset", ["table1", "table1-rad"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_under_the_papers_noise_the_filter_is_three_times_nearer_the_truth(
    preset: str, seed: int
) -> None:
    vessel, _ = load_vessel(preset)
    sensors = suite("paper", angle_unit=vessel.angle_unit)
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, seed=seed, sensors=sensors)
    signals = on_one_clock(trial)
    estimates = filter_states(signals, vessel.coefficients, *stated(vessel.coefficients, signals))
    for name, state in STATE_OF.items():
        measured = errors(trial, signals, signals[name], name)
        estimated = errors(trial, signals, estimates.states[:, state], name)
        assert np.std(measured) / np.sqrt(np.mean(estimated**2)) >= 3


@pytest.mark.parametrize("seed", range(5))
def test_under_white_noise_the_true_models_innovations_are_white_and_as_large_as_expected(
    vessel: Vessel, seed: int
) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=500.0, seed=seed, sensors=suite("white"))
    signals = on_one_clock(trial)
    estimates = filter_states(signals, vessel.coefficients, *stated(vessel.coefficients, signals))
    for i, name in enumerate(PAPER_OUTPUTS):
        e, s = estimates.innovations[:, i], estimates.innovation_stds[:, i]
        result = assess_innovations(name, "", e, s, noise_measured=True)
        assert result.white, result
        assert result.consistent, result


@pytest.mark.parametrize("kind", KINDS)
def test_without_noise_the_filter_follows_the_truth_in_all_five_states(
    vessel: Vessel, kind: str
) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=300.0, sensors=suite("none"))
    signals, c = on_one_clock(trial), vessel.coefficients
    estimates = filter_states(signals, c, *stated(c, signals, kind))
    truth = trial.trajectory.at(signals.time_secs)
    assert estimates.states[:, 0] == pytest.approx(truth["yaw_rate"], abs=2e-7)
    assert estimates.states[:, 3] == pytest.approx(truth["speed"], abs=2e-5)
    w_dot = truth["yaw_acceleration"]
    assert estimates.states[:, 1] == pytest.approx(w_dot, abs=1e-3 * np.abs(w_dot).max())
    rise = slice(115, 175)  # where the rudder moves evenly, w'' has no jumps
    slope = np.gradient(w_dot, signals.dt_secs)[rise]
    assert estimates.states[rise, 2] == pytest.approx(slope, rel=0.02, abs=1e-7)
    surge = np.gradient(truth["speed"], signals.dt_secs)[rise]
    assert estimates.states[rise, 4] == pytest.approx(surge, rel=0.02, abs=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_missing_samples_are_predicted_through_and_the_doubt_grows(
    zigzag: SimulatedTrial, vessel: Vessel, kind: str
) -> None:
    """Not for ever: the memory of a ship that turns faster is shorter."""
    signals, c = on_one_clock(zigzag), vessel.coefficients
    noise = replace(stated(c, signals)[0], process_ratio=np.array([1e-4, 1e-3]))
    holed = {name: values.copy() for name, values in signals.values.items()}
    holed["yaw_rate"][2000:2600] = np.nan
    signals = replace(signals, values=holed)
    estimates = filter_states(signals, c, noise, FilterSettings(kind=kind))
    assert np.all(np.isnan(estimates.innovations[2000:2600, 0]))
    std = estimates.stds[1999:2600, 0]
    assert np.all(np.diff(std[:200]) > 0)
    assert np.all(std[200:] > 1.5 * std[0])
    error = errors(zigzag, signals, estimates.states[:, 0], "yaw_rate")
    assert np.abs(error[2000:2600]).max() < 4 * estimates.stds[2599, 0]


@pytest.mark.parametrize("kind", KINDS)
def test_a_wave_that_is_told_of_is_told_from_the_ships_own_turning(
    vessel: Vessel, kind: str
) -> None:
    trial = simulate(vessel, "zigzag-20-20", duration_secs=400.0, sensors=suite("white"))
    signals, c = on_one_clock(trial), vessel.coefficients
    t, frequency = signals.time_secs, WAVE.frequency
    waves = 2e-3 * np.sin(frequency * t) * np.sin(0.02 * t + 0.3)
    signals = replace(
        signals, values=dict(signals.values) | {"yaw_rate": signals["yaw_rate"] + waves}
    )
    noise = NoiseModel(np.array([9e-5, 0.1]), np.array([1e-4, 1e-3]))
    rough = replace(noise, wave=replace(WAVE, std=1e-3))
    stds = []
    for assumed in (noise, rough):
        estimates = filter_states(signals, c, assumed, FilterSettings(kind=kind))
        stds.append(np.std(errors(trial, signals, estimates.states[:, 0], "yaw_rate")[200:]))
    assert np.std((estimates.wave - waves)[200:]) < 0.2 * np.std(waves)
    assert stds[1] < 0.25 * stds[0]
