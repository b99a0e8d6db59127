from dataclasses import replace

import numpy as np
import pytest
from filter_runs import (
    PATTERNS,
    SMOOTHABLE,
    five_states,
    in_chunks,
    measured_as,
    pushes,
    signals_of,
    smoothed_in_chunks,
    smoothed_run,
    steered,
    straight,
    three_states,
    together,
)
from gaussian import apart

from analysis.filters import smoother
from analysis.filters.base import Filter, Trace
from analysis.filters.factory import filter_states, make_filter
from analysis.filters.noise_model import NoiseModel, Wave
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Signals, TrialLog, Vessel, resample
from shiplog.vessel.settings import FilterSettings

WAVE = Wave(frequency=0.6, damping=0.1, std=4e-4, evidence=1.0)
STDS = np.array([1e-4, 0.1])
NOISES = {
    "pseudo-input": NoiseModel(STDS, np.array([1e-2, 1e-3])),
    "extended": NoiseModel(STDS, np.array([1e-4, 1e-3])),
}
RUNS = [("pseudo-input", None), ("extended", None), ("extended", WAVE)]
of_each_run = pytest.mark.parametrize(
    ("kind", "wave"), RUNS, ids=["pseudo-input", "extended", "extended among waves"]
)


@pytest.fixture(scope="module")
def signals(vessel: Vessel) -> Signals:
    """A zig-zag with holes, the speed measured seldom."""
    sensors = suite("white", {"speed.rate_hz": 2.0})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=120.0, seed=5, sensors=sensors)
    names = ("yaw_rate", "speed", "rudder", "rpm")
    computed = resample(TrialLog("trial", trial.channels), channels=names)
    yaw_rate = computed["yaw_rate"].copy()
    yaw_rate[300:420] = np.nan
    return replace(computed, values=dict(computed.values) | {"yaw_rate": yaw_rate})


def made(vessel: Vessel, signals: Signals, kind: str, wave: Wave | None = None) -> Filter:
    c = vessel.coefficients
    noise = replace(NOISES[kind], wave=wave)
    return make_filter(c, noise, signal_stats(signals, c), FilterSettings(kind=kind))


@of_each_run
@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("dt", [0.1, 0.4])
def test_a_joint_gaussian_given_all_data_agrees_on_a_short_linear_run(
    vessel: Vessel, pattern: str, dt: float, kind: str, wave: Wave | None
) -> None:
    c, rng = straight(vessel.coefficients), np.random.default_rng(4)
    delta, n = steered(14, dt)
    measured = rng.standard_normal((14, 2)) * [1e-3, 0.1] + [0.01, 8.0]
    measured = measured_as(pattern, measured)
    signals = signals_of(measured, delta, n, dt)
    noise, stats = (
        NoiseModel(np.array([1e-3, 0.1]), np.array([0.3, 0.02]), wave=wave),
        signal_stats(signals, c),
    )
    filtering = make_filter(c, noise, stats, FilterSettings(kind=kind))
    _, _, (x, P) = smoothed_run(filtering, signals)
    run = five_states if kind == "pseudo-input" else three_states
    states, covariances = run(c, noise, stats, delta, n).given(measured)
    own = 5 if kind == "pseudo-input" else 3
    computed = x[:, :own], P[:, :own, :own]
    assert max(apart(computed, (states[:, :own], covariances[:, :own, :own]))) < 1e-9


def by_rauch_tung_striebel(trace: Trace, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The textbook's smoother, with the covariance of each prediction and its inverse."""
    x, P, F = trace.states, trace.covariances, trace.transitions
    predicted = x - np.einsum("no,noi->ni", trace.innovations, trace.gains)
    states, covariances = x.copy(), P.copy()
    for k in range(len(x) - 2, -1, -1):
        ahead = F[k] @ P[k] @ F[k].T + Q
        unit = np.sqrt(np.diag(ahead))
        scaled = np.linalg.solve(ahead / np.outer(unit, unit), F[k] @ P[k] / unit[:, None])
        G = (scaled / unit[:, None]).T
        states[k] += G @ (states[k + 1] - predicted[k + 1])
        covariances[k] += G @ (covariances[k + 1] - ahead) @ G.T
    return states, covariances


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_rauch_tung_and_striebel_agree_on_a_nonlinear_run(
    vessel: Vessel, signals: Signals, kind: str
) -> None:
    c, noise = vessel.coefficients, NOISES[kind]
    stats = signal_stats(signals, c)
    _, trace, computed = smoothed_run(made(vessel, signals, kind), signals)
    if kind == "extended":
        Q = pushes(c, noise, stats)
    else:
        Q = five_states(c, noise, stats, np.zeros(1), np.zeros(1)).Q
    assert max(apart(computed, by_rauch_tung_striebel(trace, Q))) < 1e-8


@of_each_run
@pytest.mark.parametrize("seed", range(3))
def test_a_trial_smoothed_in_chunks_is_as_smoothed_whole(
    vessel: Vessel, signals: Signals, kind: str, wave: Wave | None, seed: int
) -> None:
    """Wherever it is cut, within a hole too, and chunks of one instant."""
    rng = np.random.default_rng(seed)
    cuts = sorted({*rng.choice(np.arange(1, len(signals)), 6).tolist(), 350, 700, 701, 702})
    whole = smoothed_run(made(vessel, signals, kind, wave), signals)[2]
    twice = made(vessel, signals, kind, wave), made(vessel, signals, kind, wave)
    assert max(apart(smoothed_in_chunks(twice, signals, cuts), whole)) < 1e-9


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_chunks_of_one_instant_each_are_smoothed_as_a_whole(
    vessel: Vessel, signals: Signals, kind: str
) -> None:
    part = signals.part(200, 520)
    whole = smoothed_run(made(vessel, part, kind), part)[2]
    twice = made(vessel, part, kind), made(vessel, part, kind)
    assert max(apart(smoothed_in_chunks(twice, part, list(range(1, len(part)))), whole)) < 1e-9


@of_each_run
def test_a_trace_in_chunks_is_that_of_the_whole_to_the_last_bit(
    vessel: Vessel, signals: Signals, kind: str, wave: Wave | None
) -> None:
    filtering = made(vessel, signals, kind, wave)
    _, whole = filtering.trace(signals, last_inputs(signals))
    filtering = made(vessel, signals, kind, wave)
    chunks = in_chunks(signals, [1, 2, 333, 900])
    parts = together([filtering.trace(*chunk)[1] for chunk in chunks])
    for name, values in vars(whole).items():
        assert np.array_equal(getattr(parts, name), values), name


@of_each_run
def test_with_nothing_measured_the_smoother_says_what_the_filter_says(
    vessel: Vessel, signals: Signals, kind: str, wave: Wave | None
) -> None:
    filtering = made(vessel, signals, kind, wave)
    nothing = np.full(len(signals), np.nan)
    unseen = dict(signals.values) | {"yaw_rate": nothing, "speed": nothing}
    _, trace, (x, P) = smoothed_run(filtering, replace(signals, values=unseen))
    assert np.array_equal(x, trace.states)
    assert np.array_equal(P, trace.covariances)


@of_each_run
def test_at_the_end_the_smoother_knows_no_more_than_the_filter_and_before_it_more(
    vessel: Vessel, signals: Signals, kind: str, wave: Wave | None
) -> None:
    _, trace, (x, P) = smoothed_run(made(vessel, signals, kind, wave), signals)
    assert np.array_equal(x[-1], trace.states[-1])
    assert np.array_equal(P[-1], trace.covariances[-1])
    before, after = (np.diagonal(of, axis1=1, axis2=2) for of in (trace.covariances, P))
    assert np.all(after <= before * (1 + 1e-12))
    assert np.all(after[300:420, 0] < 0.7 * before[419, 0])  # a hole is closed from both ends


@of_each_run
def test_smoothed_covariances_are_symmetric_and_positive_semidefinite(
    vessel: Vessel, signals: Signals, kind: str, wave: Wave | None
) -> None:
    _, _, (_, P) = smoothed_run(made(vessel, signals, kind, wave), signals)
    assert np.array_equal(P, np.swapaxes(P, 1, 2))
    unit = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    assert np.linalg.eigvalsh(P / (unit[:, :, None] * unit[:, None, :])).min() > -1e-9


@pytest.mark.parametrize("kind", SMOOTHABLE)
def test_the_settings_smooth_what_is_told_and_leave_the_innovations_alone(
    vessel: Vessel, signals: Signals, kind: str
) -> None:
    c, noise = vessel.coefficients, NOISES[kind]
    plain = filter_states(signals, c, noise, FilterSettings(kind=kind))
    computed = filter_states(signals, c, noise, FilterSettings(kind=kind, smooth=True))
    for name in ("innovations", "innovation_stds", "rejected"):
        assert np.array_equal(getattr(computed, name), getattr(plain, name), equal_nan=True), name
    filtering = made(vessel, signals, kind)
    _, _, (x, P) = smoothed_run(filtering, signals)
    states, stds, *_ = filtering.to_estimates(signals, last_inputs(signals), x, P)
    assert np.array_equal(computed.states, states)
    assert np.array_equal(computed.stds, stds)
    assert not np.array_equal(computed.states, plain.states)


def test_a_smoothed_wave_is_an_estimate_too(vessel: Vessel, signals: Signals) -> None:
    c, noise = vessel.coefficients, replace(NOISES["extended"], wave=WAVE)
    settings = FilterSettings(kind="extended", smooth=True)
    computed = filter_states(signals, c, noise, settings)
    filtering = made(vessel, signals, "extended", WAVE)
    _, _, (x, _) = smoothed_run(filtering, signals)
    assert np.array_equal(computed.wave, x[:, 3:] @ filtering._wave)


@of_each_run
def test_a_trial_longer_than_a_piece_is_smoothed_as_a_whole(
    vessel: Vessel,
    signals: Signals,
    kind: str,
    wave: Wave | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    c, noise = vessel.coefficients, replace(NOISES[kind], wave=wave)
    settings = FilterSettings(kind=kind, smooth=True)
    whole = filter_states(signals, c, noise, settings)
    monkeypatch.setattr(smoother, "PIECE", 177)
    pieces = filter_states(signals, c, noise, settings)
    for name in ("innovations", "innovation_stds", "rejected"):
        assert np.array_equal(getattr(pieces, name), getattr(whole, name), equal_nan=True), name
    for name in ("states", "stds"):
        a, b = getattr(pieces, name), getattr(whole, name)
        assert np.abs(a - b).max(axis=0) == pytest.approx(0, abs=1e-9 * np.abs(b).max())
