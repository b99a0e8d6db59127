"""What holds of every filter, whichever it is."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from filter_runs import FILTERS, in_chunks, signals_of, steered, together
from trial_logs import InChunks, as_log

from analysis.filters.base import Estimates, Filter
from analysis.filters.factory import filter_states, make_filter
from analysis.filters.kernels import MAX_REJECTED_IN_A_ROW
from analysis.filters.noise_model import NoiseModel, Wave
from analysis.signals.hold import InputHold, held_throughout, last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Channel, Signals, TrialLog, Vessel, resample
from shiplog.checks.log_stats import compute_log_stats
from shiplog.resampling import choose_clock, resample_chunks
from shiplog.ships.paper import steady_speed
from shiplog.vessel.settings import FilterSettings

NAMES = ("yaw_rate", "speed", "rudder", "rpm")
STDS = np.array([1e-4, 0.1])
WAVE = Wave(frequency=0.6, damping=0.1, std=4e-4, evidence=1.0)
CASES = [*((kind, None) for kind in FILTERS), *((kind, WAVE) for kind in FILTERS[1:])]
of_each = pytest.mark.parametrize(
    ("kind", "wave"), CASES, ids=[f"{k}{' among waves' if w else ''}" for k, w in CASES]
)
of_each_output = pytest.mark.parametrize(("output", "name"), [(0, "yaw_rate"), (1, "speed")])
of_each_kind = pytest.mark.parametrize("kind", FILTERS)


def noise_for(kind: str, wave: Wave | None = None) -> NoiseModel:
    ratios = [1e-2, 1e-2] if kind == "pseudo-input" else [1e-4, 1e-2]
    return NoiseModel(STDS, np.array(ratios), wave=wave)


def made(vessel: Vessel, stats: SignalStats, kind: str, wave: Wave | None = None) -> Filter:
    return make_filter(vessel.coefficients, noise_for(kind, wave), stats, FilterSettings(kind=kind))


def straight_run(vessel: Vessel, seed: int, count: int = 1000) -> Signals:
    """A ship on a straight course, measured with white noise."""
    speed = steady_speed(vessel.coefficients, 80.0)
    measured = np.random.default_rng(seed).standard_normal((count, 2)) * STDS + [0.0, speed]
    return signals_of(measured, np.zeros(count), np.full(count, 80.0), 0.1)


def off_by(signals: Signals, name: str, at: slice, size: float) -> Signals:
    values = signals[name].copy()
    values[at] += size
    return replace(signals, values=dict(signals.values) | {name: values})


def filtered(vessel: Vessel, signals: Signals, kind: str, gate: float = 6.0) -> Estimates:
    settings = FilterSettings(kind=kind, gate=gate)
    return filter_states(signals, vessel.coefficients, noise_for(kind), settings)


@of_each_kind
@of_each_output
def test_a_spike_is_rejected_counted_and_hardly_changes_the_estimate(
    vessel: Vessel, kind: str, output: int, name: str
) -> None:
    clean = straight_run(vessel, 1)
    spiked = off_by(clean, name, slice(500, 501), 20 * STDS[output])
    before, after = (filtered(vessel, signals, kind) for signals in (clean, spiked))
    assert np.argwhere(after.rejected).tolist() == [[500, output]]
    assert after.innovations[500, output] > 6 * after.innovation_stds[500, output]
    assert after.rejected[500, output]
    assert np.all(np.abs(after.states - before.states) < after.stds)


@of_each_kind
@of_each_output
def test_rejected_sample_is_treated_as_missing(
    vessel: Vessel, kind: str, output: int, name: str
) -> None:
    clean = straight_run(vessel, 1)
    spiked = off_by(clean, name, slice(500, 503), 20 * STDS[output])
    missing = off_by(clean, name, slice(500, 503), np.nan)
    assert filtered(vessel, spiked, kind).rejected.sum() == 3
    stats, result = signal_stats(clean, vessel.coefficients), []
    for signals in (spiked, missing):
        filtering = made(vessel, stats, kind)
        result.append(filtering.trace(signals, last_inputs(signals)))
    (estimates, trace), (expected, without) = result
    assert np.array_equal(estimates.states, expected.states)
    assert np.array_equal(estimates.stds, expected.stds)
    for part, values in vars(without).items():
        assert np.array_equal(getattr(trace, part), values), part


@of_each_kind
@of_each_output
def test_with_the_gate_wide_open_a_spike_is_taken_in(
    vessel: Vessel, kind: str, output: int, name: str
) -> None:
    clean = straight_run(vessel, 1)
    spiked = off_by(clean, name, slice(500, 501), 20 * STDS[output])
    before, after = (filtered(vessel, signals, kind, 1e6) for signals in (clean, spiked))
    assert not after.rejected.any()
    state = (0, 3)[output]
    assert after.states[500, state] - before.states[500, state] > after.stds[500, state]


@of_each_kind
@of_each_output
def test_a_step_that_lasts_is_believed_after_five_samples(
    vessel: Vessel, kind: str, output: int, name: str
) -> None:
    stepped = off_by(straight_run(vessel, 1), name, slice(500, None), 20 * STDS[output])
    result = filtered(vessel, stepped, kind)
    assert MAX_REJECTED_IN_A_ROW == 5
    at = np.flatnonzero(result.rejected[:530, output])
    assert at.tolist() == [500 + k for k in range(MAX_REJECTED_IN_A_ROW)]
    assert not result.rejected[:, 1 - output].any()
    state = (0, 3)[output]
    assert result.states[-1, state] - result.states[499, state] > 10 * STDS[output]


@of_each_kind
@of_each_output
def test_a_step_that_is_believed_is_not_doubted_again_on_the_way_to_it(
    vessel: Vessel, kind: str, output: int, name: str
) -> None:
    """Else what noise takes towards the estimate is taken in, and what it takes away is not."""
    stepped = off_by(straight_run(vessel, 1), name, slice(500, None), 20 * STDS[output])
    assert filtered(vessel, stepped, kind).rejected.sum() == MAX_REJECTED_IN_A_ROW


@of_each_kind
@pytest.mark.parametrize("seed", range(5))
def test_of_white_noise_no_sample_is_rejected(vessel: Vessel, kind: str, seed: int) -> None:
    assert not filtered(vessel, straight_run(vessel, seed), kind).rejected.any()


@pytest.fixture(scope="module")
def log(vessel: Vessel) -> TrialLog:
    """A zig-zag with sensors of several rates, which drop out."""
    settings = {"speed.rate_hz": 1.0, "yaw_rate.dropout": 0.1, "yaw_rate.dropout_secs": 3.0}
    sensors = suite("white", settings)
    return as_log(simulate(vessel, "zigzag-20-20", duration_secs=150.0, seed=3, sensors=sensors))


def same(result: Estimates, expected: Estimates) -> None:
    for name, values in vars(expected).items():
        if values is not None:
            assert np.array_equal(getattr(result, name), values, equal_nan=True), name


@of_each
@pytest.mark.parametrize("cuts", [[1], [700], [3, 4, 5, 400, 401, 1100], "everywhere"])
def test_in_chunks_a_filter_says_the_same_to_the_last_bit(
    vessel: Vessel, log: TrialLog, kind: str, wave: Wave | None, cuts: list[int] | str
) -> None:
    signals = resample(log, channels=NAMES)
    at = list(range(1, len(signals))) if cuts == "everywhere" else cuts
    stats = signal_stats(signals, vessel.coefficients)
    whole = made(vessel, stats, kind, wave).step(signals, last_inputs(signals))
    filtering = made(vessel, stats, kind, wave)
    same(together([filtering.step(*chunk) for chunk in in_chunks(signals, at)]), whole)


@of_each
def test_a_trace_is_kept_without_changing_the_estimates(
    vessel: Vessel, log: TrialLog, kind: str, wave: Wave | None
) -> None:
    signals = resample(log, channels=NAMES)
    stats = signal_stats(signals, vessel.coefficients)
    filtering = made(vessel, stats, kind, wave)
    result, trace = filtering.trace(signals, last_inputs(signals))
    same(result, made(vessel, stats, kind, wave).step(signals, last_inputs(signals)))
    estimates = filtering.to_estimates(
        signals, last_inputs(signals), trace.states, trace.covariances
    )
    for name, values in zip(("states", "stds", "wave", "further"), estimates, strict=True):
        expected = getattr(result, name)
        assert values is expected is None or np.array_equal(values, expected), name


def shuffled(channel: Channel, rng: np.random.Generator) -> Channel:
    return channel.take(rng.permutation(len(channel)))


def placed(log: TrialLog | InChunks) -> Iterator[Signals]:
    clock = choose_clock(log, compute_log_stats(log), channels=NAMES)
    return (
        held
        for _, held, _ in held_throughout(resample_chunks(log.chunks(), clock), InputHold(clock))
    )


@of_each_kind
@pytest.mark.parametrize("seed", range(3))
def test_the_order_in_which_samples_stand_in_a_log_changes_nothing(
    vessel: Vessel, log: TrialLog, kind: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    (signals,) = placed(log)
    whole = filtered(vessel, signals, kind)
    turned = tuple(log.channels[k] for k in rng.permutation(len(log.channels)))
    mixed = tuple(shuffled(channel, rng) for channel in turned)
    for other in (replace(log, channels=turned), replace(log, channels=mixed)):
        (signals,) = placed(other)
        same(filtered(vessel, signals, kind), whole)


@of_each_kind
@pytest.mark.parametrize("seed", range(3))
def test_where_a_log_is_cut_changes_nothing(
    vessel: Vessel, log: TrialLog, kind: str, seed: int
) -> None:
    cuts = np.sort(np.random.default_rng(seed).uniform(0, 150, 12)).tolist()
    (signals,) = placed(log)
    parted = InChunks(log, cuts)
    clock = choose_clock(parted, compute_log_stats(parted), channels=NAMES)
    stats = signal_stats(signals, vessel.coefficients)
    filtering = made(vessel, stats, kind)
    chunks = held_throughout(resample_chunks(parted.chunks(), clock), InputHold(clock))
    result = [filtering.step(held, following) for _, held, following in chunks]
    assert len(result) > 5
    whole = made(vessel, stats, kind).step(signals, last_inputs(signals))
    same(together(result), whole)


@of_each
def test_covariances_stay_symmetric_and_positive_over_a_long_run_with_gaps(
    vessel: Vessel, kind: str, wave: Wave | None
) -> None:
    count, rng = 20_000, np.random.default_rng(8)
    delta, n = steered(count, 0.1)
    measured = rng.standard_normal((count, 2)) * STDS + [0.0, 7.0]
    for output, steps in enumerate((1, 7)):
        measured[np.arange(count) % steps > 0, output] = np.nan
        for start in rng.integers(0, count, 8):
            measured[start : start + rng.integers(10, 2000), output] = np.nan
    signals = signals_of(measured, delta, n, 0.1)
    stats = replace(signal_stats(signals, vessel.coefficients), first=np.array([0.0, 7.0]))
    _, trace = made(vessel, stats, kind, wave).trace(signals, last_inputs(signals))
    P = trace.covariances
    assert np.array_equal(P, np.swapaxes(P, 1, 2))
    unit = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    assert np.all(unit > 0)
    assert np.linalg.eigvalsh(P / (unit[:, :, None] * unit[:, None, :])).min() > 0


@of_each_kind
def test_the_inputs_are_never_asked_for_beyond_the_instant_that_follows(
    vessel: Vessel, kind: str
) -> None:
    """What follows a chunk changes the next estimates, not those of the chunk."""
    signals = straight_run(vessel, 2, 200)
    stats = signal_stats(signals, vessel.coefficients)
    result = [
        made(vessel, stats, kind).step(signals, {"rudder": delta, "rpm": 80.0})
        for delta in (0.0, 0.1)
    ]
    assert np.array_equal(result[0].states[:-1], result[1].states[:-1])
    assert np.array_equal(result[0].states[:, [0, 1, 3]], result[1].states[:, [0, 1, 3]])
