from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import isnan, nan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shiplog import Channel, LogError, TrialLog, UsageError, resample
from shiplog.checks.log_stats import compute_log_stats
from shiplog.resampling import choose_clock, resample_chunks
from shiplog.types import concatenate_signals

START = 1_700_000_000_000_000_000
SEC = 1_000_000_000


def channel(
    name: str, seconds: Sequence[float], values: Sequence[float], source: str = "test"
) -> Channel:
    at = START + np.round(np.asarray(seconds) * 1e9).astype(np.int64)
    return Channel(name, source, "1", at, at, np.asarray(values, float))


def log_of(*channels: Channel) -> TrialLog:
    return TrialLog("trial.mcap", channels)


def brute_force_means(measured: Channel, start_ns: int, dt_ns: int, count: int) -> list[float]:
    """Average the samples within half a step of each instant, in integer nanoseconds."""
    means = []
    for k in range(count):
        middle = start_ns + k * dt_ns
        near = [
            float(value)
            for at, value in zip(measured.measured_ns.tolist(), measured.values, strict=True)
            if -dt_ns <= 2 * (at - middle) < dt_ns and not isnan(value)
        ]
        means.append(sum(near) / len(near) if near else nan)
    return means


def brute_force_interpolation(
    commanded: Channel, start_ns: int, dt_ns: int, count: int, gap_ns: float
) -> list[float]:
    """Interpolate between the samples on either side of each instant, in integer ns."""
    samples = sorted(
        (at, float(value))
        for at, value in zip(commanded.measured_ns.tolist(), commanded.values, strict=True)
        if not isnan(value)
    )
    placed = []
    for k in range(count):
        now = start_ns + k * dt_ns
        before = [sample for sample in samples if sample[0] <= now]
        after = [sample for sample in samples if sample[0] >= now]
        if not before or not after:
            placed.append(nan)
            continue
        (t0, y0), (t1, y1) = before[-1], after[0]
        if t0 == t1:
            placed.append(y0)
        else:
            placed.append(y0 + (y1 - y0) * (now - t0) / (t1 - t0) if t1 - t0 <= gap_ns else nan)
    return placed


def scattered(name: str, rng: np.random.Generator, count: int, span_secs: float) -> Channel:
    """Make a channel of irregular odd ns times, out of order, a tenth of it not measured."""
    at = START + 2 * rng.choice(round(span_secs * 1e9) // 2, count, replace=False) + 1
    values = rng.normal(size=count)
    values[rng.random(count) < 0.1] = nan
    return Channel(name, "test", "1", at, at, values)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dt_ns", [100_000_000, 250_000_000, 1_000_000_000])
def test_a_measured_channel_is_the_mean_of_the_nearest_samples(seed: int, dt_ns: int) -> None:
    measured = scattered("yaw_rate", np.random.default_rng(seed), 60, 20.0)
    signals = resample(log_of(measured), dt_ns * 1e-9)
    expected = brute_force_means(measured, signals.start_ns, dt_ns, len(signals))
    np.testing.assert_allclose(signals["yaw_rate"], expected, rtol=1e-13)
    there = np.isfinite(measured.values)
    assert signals.start_ns == measured.measured_ns[there].min()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dt_ns", [100_000_000, 250_000_000, 1_000_000_000])
def test_a_commanded_channel_is_interpolated_but_not_across_a_gap(seed: int, dt_ns: int) -> None:
    commanded = scattered("rudder", np.random.default_rng(seed), 40, 60.0)
    signals = resample(log_of(commanded), dt_ns * 1e-9)
    gap_ns = compute_log_stats(log_of(commanded))[commanded.name].gap_threshold_secs * 1e9
    expected = brute_force_interpolation(commanded, signals.start_ns, dt_ns, len(signals), gap_ns)
    np.testing.assert_allclose(signals["rudder"], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["yaw_rate", "rudder", "heading"])
@given(seed=st.integers(0, 2**32 - 1))
@settings(derandomize=True, deadline=None, max_examples=25)
def test_the_order_of_the_samples_does_not_matter(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ordered = scattered(name, rng, 20, 10.0)
    mixed = rng.permutation(20)
    shuffled = Channel(
        name,
        "test",
        "1",
        ordered.measured_ns[mixed],
        ordered.received_ns[mixed],
        ordered.values[mixed],
    )
    once, again = (resample(log_of(c), 0.2) for c in (ordered, shuffled))
    assert once.start_ns == again.start_ns
    np.testing.assert_allclose(once[name], again[name], rtol=1e-12, atol=1e-14)


def test_samples_on_the_clock_are_unchanged() -> None:
    seconds = np.arange(1000) * 0.1
    values = np.random.default_rng(1).normal(size=1000)
    for name in ("yaw_rate", "rudder"):
        signals = resample(log_of(channel(name, seconds, values)))
        np.testing.assert_allclose(signals[name], values, rtol=1e-9, atol=1e-11)
        assert signals.dt_secs == pytest.approx(0.1, rel=1e-12)


def test_instants_without_a_measurement_are_nan() -> None:
    rudder = channel("rudder", np.arange(11), np.zeros(11))
    speed = channel("speed", [0, 1, 2, 8, 9, 10], [5, nan, 5, 5, 5, 5])
    signals = resample(log_of(rudder, speed), 1.0)
    np.testing.assert_array_equal(
        np.isnan(signals["speed"]), [False, True, False, *[True] * 5, False, False, False]
    )
    assert np.all(np.isfinite(signals["rudder"]))


def test_a_gap_of_a_commanded_channel_is_nan_inside_and_known_at_its_ends() -> None:
    seconds = [0, 1, 2, 3, 13, 14, 15]
    signals = resample(log_of(channel("rudder", seconds, [float(s) for s in seconds])), 1.0)
    np.testing.assert_allclose(signals["rudder"], [0, 1, 2, 3, *[nan] * 9, 13, 14, 15], rtol=1e-12)


def test_an_interval_below_a_second_is_not_a_gap_even_in_a_fast_channel() -> None:
    seconds = [*np.arange(0, 1, 0.01), *np.arange(1.9, 3, 0.01)]
    signals = resample(log_of(channel("rudder", seconds, seconds)), 0.1)
    np.testing.assert_allclose(signals["rudder"], signals.time_secs, atol=1e-9)


def test_channels_of_different_rates_are_placed_on_one_clock() -> None:
    log = log_of(
        channel("yaw_rate", np.arange(0, 10.001, 0.01), np.arange(0, 10.001, 0.01)),
        channel("rudder", np.arange(0, 11), np.arange(0, 11)),
        channel("speed", np.arange(0, 10.1, 0.5), np.arange(0, 10.1, 0.5)),
    )
    signals = resample(log, 0.25)
    assert len(signals) == 41
    np.testing.assert_allclose(signals["rudder"], signals.time_secs, atol=1e-12)
    np.testing.assert_allclose(signals["yaw_rate"][1:-1], signals.time_secs[1:-1], atol=0.006)
    np.testing.assert_allclose(signals["speed"][::2], signals.time_secs[::2])
    assert np.all(np.isnan(signals["speed"][1::2]))


def test_jittered_times_keep_the_median_interval_and_lose_no_sample() -> None:
    rng = np.random.default_rng(3)
    seconds = np.arange(500) * 0.1 + rng.uniform(-0.02, 0.02, 500)
    jittered = channel("yaw_rate", seconds, np.arange(500.0))
    assert compute_log_stats(log_of(jittered))[jittered.name].interval_secs == pytest.approx(
        0.1, abs=0.005
    )
    signals = resample(log_of(jittered), 0.1)
    assert np.nanmax(np.abs(np.diff(signals["yaw_rate"]))) <= 2
    assert np.isfinite(signals["yaw_rate"]).mean() > 0.9


def test_the_default_step_is_the_median_interval_of_the_first_channel() -> None:
    log = log_of(
        channel("speed", np.arange(0, 10, 0.5), np.ones(20)),
        channel("rudder", np.arange(0, 10, 0.2), np.ones(50)),
    )
    assert resample(log).dt_secs == pytest.approx(0.5)
    assert resample(log, channels=("rudder", "speed")).dt_secs == pytest.approx(0.2)


def test_the_clock_runs_while_all_commanded_channels_are_known() -> None:
    log = log_of(
        channel("rudder", np.arange(2, 21), np.zeros(19)),
        channel("rpm", np.arange(0, 18), np.full(18, 80.0)),
        channel("speed", np.arange(0, 30), np.ones(30)),
    )
    signals = resample(log, 1.0)
    assert signals.start_ns == START + 2 * SEC
    assert len(signals) == 16


def test_a_channel_named_with_its_source_is_treated_as_its_quantity() -> None:
    log = log_of(channel("rudder", [0, 2, 4], [0, 2, 4], source="feedback"))
    by_name, by_source = resample(log, 1.0), resample(log, 1.0, ("rudder/feedback",))
    np.testing.assert_array_equal(by_source["rudder/feedback"], by_name["rudder"])
    np.testing.assert_array_equal(by_name["rudder"], np.arange(5))


def test_a_heading_is_unwrapped() -> None:
    seconds = np.arange(0, 100, 1.0)
    turned = 0.1 * seconds
    signals = resample(log_of(channel("heading", seconds, turned % (2 * pi))), 0.5)
    np.testing.assert_allclose(signals["heading"], 0.1 * signals.time_secs, atol=1e-9)


def test_positions_are_omitted_by_default_and_rejected_by_name() -> None:
    at = START + np.arange(3) * SEC
    position = Channel("position", "gnss", "m", at, at, np.zeros((3, 2)), ("north", "east"))
    log = log_of(channel("speed", [0, 1, 2], [1, 2, 3]), position)
    assert set(resample(log).values) == {"speed"}
    with pytest.raises(UsageError, match="'position' has components"):
        resample(log, channels=("position",))
    with pytest.raises(LogError, match="no channel to resample"):
        resample(log_of(position))


def test_a_channel_whose_values_are_all_impossible_has_a_wrong_unit() -> None:
    rpm = replace(channel("rpm", [0, 1, 2], [4800, 4810, 4790]), unit="rpm")
    log = log_of(channel("speed", [0, 1], [1, 2]), rpm)
    stats = compute_log_stats(log, strict=True)
    with pytest.raises(LogError, match=r"'rpm' has no possible value.* up to 4810 rpm.*its unit"):
        choose_clock(log, stats, channels=("speed", "rpm"))


@pytest.mark.parametrize(
    ("seconds", "values", "error"),
    [
        ([0], [1], "has one sample"),
        ([0, 1], [1, nan], "has one sample"),
        ([0, 1], [nan, nan], "has no measured value"),
        ([], [], "has no measured value"),
        ([5, 5, 5], [1, 2, 3], "at one instant"),
    ],
)
def test_too_few_samples_are_an_error_that_names_the_channel(
    seconds: list[float], values: list[float], error: str
) -> None:
    log = log_of(channel("speed", [0, 1], [1, 2]), channel("sway", seconds, values))
    with pytest.raises(LogError, match=rf"'sway' .*{error}.*trial\.mcap"):
        resample(log)


def test_a_missing_channel_is_an_error() -> None:
    with pytest.raises(LogError, match="no channel 'rudder'"):
        resample(log_of(channel("speed", [0, 1], [1, 2])), channels=("rudder",))


def test_commands_with_no_time_in_common_are_an_error() -> None:
    log = log_of(channel("rudder", [0, 1], [0, 0]), channel("rpm", [5, 6], [80, 80]))
    with pytest.raises(LogError, match="rudder, rpm were never recorded at the same time"):
        resample(log)
    log = log_of(channel("rudder", [0, 1], [0, 0]), channel("speed", [5, 6], [5, 5]))
    with pytest.raises(LogError, match="never recorded at the same time"):
        resample(log)


@pytest.mark.parametrize("dt_secs", [0.1, 1e-9, 1e-300])
def test_times_years_apart_are_an_error_and_do_not_exhaust_memory(dt_secs: float) -> None:
    year = 365.25 * 86400
    log = log_of(channel("rudder", [0, 1, 9 * year], [0, 0, 0]))
    with pytest.raises(LogError, match=r"span 3287 days, too many steps of"):
        resample(log, dt_secs)


@pytest.mark.parametrize("dt_secs", [0.0, -0.1, nan, float("inf")])
def test_an_invalid_time_step_is_rejected(dt_secs: float) -> None:
    with pytest.raises(UsageError, match="time step must be positive"):
        resample(log_of(channel("rudder", [0, 1], [0, 0])), dt_secs)


@pytest.mark.parametrize("silent", ["yaw_rate", "rudder", "heading", "all"])
def test_a_long_gap_is_resampled_in_bounded_chunks_without_delay(
    silent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shiplog.resampling.grid.MAX_CHUNK_INSTANTS", 50)
    seconds = np.arange(3000.0)
    kept = (seconds < 300) | (seconds > 2500)
    names = ("yaw_rate", "rudder", "heading")
    channels = [
        channel(name, seconds[kept] if silent in (name, "all") else seconds, np.cos(seconds))
        if silent not in (name, "all")
        else channel(name, seconds[kept], np.cos(seconds[kept]))
        for name in names
    ]
    log = log_of(*channels)
    whole = resample(log, channels=names)
    clock = choose_clock(log, compute_log_stats(log), channels=names)
    given, most, done = 0, 0, 0
    parts = []
    for at in range(0, 3000, 100):
        chunk = tuple(
            c.part(*np.searchsorted(c.received_ns, [START + at * SEC, START + (at + 100) * SEC]))
            for c in log
        )
        parts.append(chunk)

    def watched() -> Iterator[tuple[Channel, ...]]:
        nonlocal given
        for chunk in parts:
            given += 100
            yield chunk

    for signals in resample_chunks(watched(), clock):
        most = max(most, len(signals))
        done = signals.first + len(signals)
        if silent != "all":
            assert given - done <= 250
    assert (most, done) == (50, len(whole))
    again = concatenate_signals(resample_chunks(parts, clock))
    for name in names:
        assert np.array_equal(again[name], whole[name], equal_nan=True)
    assert np.isnan(whole["yaw_rate"]).any() == (silent in ("yaw_rate", "all"))
