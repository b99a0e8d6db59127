"""Coefficients of the wind as states: against a joint Gaussian of the whole run, and the signs."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from filter_runs import (
    SMOOTHABLE,
    five_states,
    signals_of,
    smoothed_in_chunks,
    smoothed_run,
    steered,
    straight,
    three_states,
)
from gaussian import apart, band, held
from scipy.linalg import block_diag
from windy_trials import true_coefficients, windy_trial

from analysis.filters.factory import make_filter
from analysis.filters.further_parts import FORCE_SHARE, HOUR, MIN_FORCE, MOMENT_RUDDER
from analysis.filters.noise_model import ForceNoise, FurtherModel, NoiseModel
from analysis.filters.wind_terms import (
    WIND_CHANGE,
    WIND_TERMS,
    apparent_wind,
    wind_prior_std,
    wind_regressors,
)
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import Signals, Vessel
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

DT, COUNT = 0.25, 20
STDS = np.array([1e-4, 0.1])
SLOW = {"yaw": ForceNoise(0, 0.05), "surge": ForceNoise(0, 0.02)}
NOISE = NoiseModel(STDS, np.array([1e-4, 1e-3]), further=FurtherModel(wind=tuple(WIND_TERMS)))
NOISE = replace(NOISE, further=replace(NOISE.further, **SLOW))


def windy_run() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The inputs of a steered ship (n, 2), and the regressors of a storm that backs and freshens.

    It is so strong that a few seconds show something of its coefficients.
    """
    t = DT * np.arange(COUNT)
    wind = wind_regressors(60 + 4 * t, 1.0 - 0.3 * t, np.full(COUNT, 8.0))
    return np.column_stack(steered(COUNT, DT)), wind


def signals_with(measured: np.ndarray, inputs: np.ndarray, wind: dict[str, np.ndarray]) -> Signals:
    signals = signals_of(measured, *inputs.T, DT)
    return replace(signals, values=dict(signals.values) | wind)


def stats_of(c: Coefficients, inputs: np.ndarray, wind: dict[str, np.ndarray]) -> SignalStats:
    measured = np.tile([2e-3, 8.0], (COUNT, 1))
    stats = signal_stats(signals_with(measured, inputs, wind), c)
    return replace(stats, first=np.array([2e-3, 8.0]), std=np.array([1e-3, 0.5]))


def joint(
    kind: str, c: Coefficients, stats: SignalStats, inputs: np.ndarray, wind: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean (n, s) and the covariance (n s, n s) of all states of a run, and C (2, s).

    The states are the ship's, yaw moment, surge force, and the coefficients of the wind, by which
    the ship is driven in each step as by a constant moment and force.
    """
    q = NOISE.process_ratio * STDS**2 * stats.interval_secs
    yaw = np.array([[0, 1], [c.b1, c.a]])
    if kind == "extended":
        run, A = three_states(c, NOISE, stats, *inputs.T), block_diag(yaw, 0.0)
        intensity, pushed = np.diag([0.0, *q]), np.array([[0.0, 0], [1, 0], [0, 1]])
    else:
        run, A = five_states(c, NOISE, stats, *inputs.T), np.zeros((5, 5))
        A[:2, :2], A[2, 1:3] = yaw, yaw[1]
        intensity = np.diag(np.repeat(q, (3, 2)))
        pushed = np.array([[0.0, 0], [1, 0], [c.a, 0], [0, 1], [0, 0]])
    own, R = len(A), STDS**2 * stats.interval_secs
    driven = np.block([[A, pushed], [np.zeros((2, own + 2))]])
    walk = [0.05**6 * R[0], 0.02**4 * R[1]]
    F, Q = held(driven, block_diag(intensity, np.diag(walk)), DT)
    typical = np.array([MOMENT_RUDDER * abs(c.d) * stats.max_rudder_effect, 0.0])
    typical[1] = FORCE_SHARE * abs(c.h) * 80.0
    priors = [wind_prior_std(WIND_TERMS[name], c, stats) for name in wind]
    first = block_diag(run.P, np.diag((typical + MIN_FORCE) ** 2), np.diag(np.square(priors)))
    Q = block_diag(Q, np.diag(np.square(priors) * WIND_CHANGE**2 / HOUR * DT))
    size = len(first)
    own_covariance, whole = first, np.zeros((COUNT, size, COUNT, size))
    for i in range(COUNT):
        later = own_covariance
        for j in range(i, COUNT):
            whole[j, :, i], whole[i, :, j] = later, later.T
            later = transition(F, wind, own, j) @ later
        step = transition(F, wind, own, i)
        own_covariance = step @ own_covariance @ step.T + Q
    mean, C = np.zeros((COUNT, size)), np.zeros((2, size))
    mean[:, :own], C[:, :own] = run.mean, run.C
    return mean, whole.reshape(COUNT * size, COUNT * size), C


def transition(F: np.ndarray, wind: dict[str, np.ndarray], own: int, k: int) -> np.ndarray:
    """The matrix of a step in which the wind acts on the ship as moment and force do."""
    step = block_diag(F, np.eye(len(wind)))
    for j, (name, values) in enumerate(wind.items()):
        step[:own, own + 2 + j] = F[:own, own + WIND_TERMS[name].axis] * values[k]
    return step


def conditioned(
    mean: np.ndarray, covariance: np.ndarray, C: np.ndarray, measured: np.ndarray, until: int
) -> tuple[np.ndarray, np.ndarray]:
    """States (n, s) and covariances (n, s, s), by least squares on all measured before `until`."""
    n, s = mean.shape
    seen = (np.isfinite(measured) & (np.arange(n)[:, None] < until)).ravel()
    H = np.kron(np.eye(n), C)[seen]
    S = H @ covariance @ H.T + np.diag(np.tile(STDS**2, n)[seen])
    gain = np.linalg.solve(S, H @ covariance).T
    states = mean + (gain @ (measured.ravel()[seen] - H @ mean.ravel())).reshape(n, s)
    blocks = (covariance - gain @ H @ covariance).reshape(n, s, n, s)
    return states, np.array([blocks[k, :, k] for k in range(n)])


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_coefficients_of_the_wind_agree_with_a_joint_gaussian(vessel: Vessel, kind: str) -> None:
    c = straight(vessel.paper_coefficients)
    inputs, wind = windy_run()
    stats = stats_of(c, inputs, wind)
    mean, covariance, C = joint(kind, c, stats, inputs, wind)
    rng = np.random.default_rng(3)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    drawn = scale * (vectors @ (np.sqrt(np.maximum(values, 0)) * rng.standard_normal(len(values))))
    true = mean + drawn.reshape(mean.shape)
    measured = true @ C.T + STDS * rng.standard_normal((COUNT, 2))
    measured[[3, 4, 9], 0], measured[1::3, 1] = np.nan, np.nan
    signals = signals_with(measured, inputs, wind)
    new = make_filter(c, NOISE, replace(stats, head=signals), FilterSettings(kind=kind, gate=1e6))
    estimates, trace, smoothed = smoothed_run(deepcopy(new), signals)
    filtered = [conditioned(mean, covariance, C, measured, k + 1) for k in range(COUNT)]
    expected = (
        np.array([states[k] for k, (states, _) in enumerate(filtered)]),
        np.array([stds[k] for k, (_, stds) in enumerate(filtered)]),
    )
    assert max(apart((trace.states, trace.covariances), expected)) < 1e-8
    whole = conditioned(mean, covariance, C, measured, COUNT)
    assert max(apart(smoothed, whole)) < 1e-8
    first = np.diagonal(covariance[: len(C.T), : len(C.T)])
    shares = np.sqrt(np.diagonal(whole[1][-1])[-3:] / first[-3:])
    assert shares.max() < 0.9  # else nothing above could fail
    assert estimates.further.names[-3:] == tuple(WIND_TERMS)
    cut = smoothed_in_chunks((deepcopy(new), deepcopy(new)), signals, [1, 7, 12])
    assert max(apart(cut, smoothed)) < 1e-9


def test_the_coefficients_are_within_their_intervals_over_many_trials(vessel: Vessel) -> None:
    """Of simulated turning circles, whose wind is measured with noise."""
    c = vessel.paper_coefficients
    errors = []
    for seed in range(24):
        trial = windy_trial(seed=seed)
        channels = {channel.name: channel.values for channel in trial.channels}
        wind = wind_regressors(
            channels["apparent_wind_speed"], channels["apparent_wind_angle"], channels["speed"]
        )
        measured = np.column_stack((channels["yaw_rate"], channels["speed"]))
        signals = signals_of(measured, channels["rudder"], channels["rpm"], 0.5)
        signals = replace(signals, values=dict(signals.values) | wind)
        noise = NoiseModel(
            np.array([np.radians(0.005), 0.1]), np.array([1e-12, 1e-6]), further=NOISE.further
        )
        slow = {name: replace(force, frequency=0.002) for name, force in SLOW.items()}
        noise = replace(noise, further=replace(noise.further, **slow))
        filter_ = make_filter(c, noise, signal_stats(signals, c), FilterSettings(kind="extended"))
        _, _, (states, covariances) = smoothed_run(filter_, signals)
        true = np.array(list(true_coefficients(trial).values()))
        stds = np.sqrt(np.diagonal(covariances[-1]))[-3:]
        errors.append((states[-1, -3:] - true) / stds)
    low, high = band(np.size(errors))
    assert low < np.sum(np.square(errors)) < high, np.std(errors, axis=0)
    assert np.mean(np.abs(errors) < 1.96) > 0.9


def test_the_relative_wind_of_a_ship_is_that_of_two_velocities() -> None:
    rng = np.random.default_rng(1)
    speed, angle, ahead = 20 * rng.random(50), rng.uniform(-4, 4, 50), rng.uniform(-3, 10, 50)
    V, gamma = apparent_wind(speed, angle, ahead)
    assert np.allclose(V * np.exp(1j * gamma), speed * np.exp(1j * angle) + ahead)


def test_the_regressors_have_the_signs_of_the_wind() -> None:
    at = np.radians([0.0, 45.0, 90.0, 135.0, -45.0, 180.0])
    terms = wind_regressors(np.full(6, 10.0), at, np.full(6, 5.0))
    assert np.allclose(terms["wind_oblique"], [0, 100, 0, -100, -100, 0])
    assert np.allclose(terms["wind_beam"], 100 * np.sin(at))
    assert np.allclose(terms["wind_head"], 25 - 100 * np.cos(at))  # a head wind brakes


def test_the_priors_are_finite_for_a_ship_that_hardly_moves(vessel: Vessel) -> None:
    c = vessel.paper_coefficients
    stats = replace(stats_of(c, *windy_run()), median_speed=0.0)
    stds = [wind_prior_std(term, c, stats) for term in WIND_TERMS.values()]
    assert all(0 < std < 1 for std in stds)
