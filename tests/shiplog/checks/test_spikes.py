"""Spikes: what is a single wrong sample, and what is the motion of a ship."""

from math import radians

import numpy as np
import pytest
from channels import channel

from shiplog import Channel, TrialLog
from shiplog.checks.data_quality import data_warnings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.checks.spikes import MAX_SPIKES, SpikeSearch, SpikeStats
from shiplog.types import FloatArray

SECS = np.arange(0.0, 600.0, 0.1)
NOISE = np.random.default_rng(0).standard_normal(len(SECS))


def spikes_of(
    values: FloatArray, chunks: int = 1, interval: float = 0.1, **options: bool
) -> SpikeStats | None:
    """Return the spikes in samples at a constant interval, which come in chunks."""
    search = SpikeSearch(circular=options.pop("circular", False))
    times = np.round(np.arange(len(values)) * interval * 1e9).astype(np.int64)
    parts = np.array_split(np.arange(len(values)), chunks)
    for part in parts:
        search.add(times[part], values[part])
    return search.result(interval, **options)


def indices(spikes: SpikeStats | None, interval: float = 0.1) -> list[int]:
    return (
        [] if spikes is None else np.round(spikes.times_ns * 1e-9 / interval).astype(int).tolist()
    )


def zigzag(rate: float = 2.5, interval: float = 0.1) -> FloatArray:
    """Return a rudder, deg, that is turned from side to side every 60 s."""
    at = np.arange(0.0, 600.0, interval)
    order = np.where(at // 60 % 2 == 0, 20.0, -20.0)
    angle = np.empty(len(at))
    last = 0.0
    for k, wanted in enumerate(order):
        last += np.clip(wanted - last, -rate * interval, rate * interval)
        angle[k] = last
    return angle


def test_spikes_are_found_in_noise_and_in_manoeuvres_at_their_instants() -> None:
    at = [3, 700, 2000, 3333, 5996]
    for signal, size in ((np.sin(SECS / 20) + 0.01 * NOISE, 0.5), (zigzag() + 0.1 * NOISE, 10.0)):
        values = signal.copy()
        values[at] += size * np.array([1, -1, 1, -1, 1])
        found = spikes_of(values)
        assert indices(found) == at
        assert found is not None
        assert found.largest == pytest.approx(size, rel=0.2)
        assert np.array_equal(found.values, values[at])


def test_two_wrong_samples_in_a_row_are_spikes_and_three_are_not() -> None:
    values = np.sin(SECS / 20) + 0.01 * NOISE
    values[1000:1002] += 1.0
    values[2000:2003] += 1.0
    assert indices(spikes_of(values)) == [1000, 1001]


MANOEUVRES = {
    "a rudder at its full rate": zigzag(),
    "a rudder that reverses at once": np.abs(SECS % 10 - 5),
    "a step": np.where(SECS > 300, 5.0, 0.0),
    "a step in noise": np.where(SECS > 300, 5.0, 0.0) + 0.1 * NOISE,
    "a jump that decays": np.where(SECS > 300, np.exp(-np.abs(SECS - 300) / 0.2), 0.0),
    "waves near the sampling rate": np.sin(2 * np.pi * SECS / 0.23),
    "white noise": NOISE,
    "noise that rises at times": NOISE * np.where(SECS % 60 < 3, 1.0, 0.1),
    "noise with long tails": np.random.default_rng(1).laplace(size=len(SECS)),
    "coarse digits": np.round(np.sin(SECS / 20) + 0.1 * NOISE, 1),
    "a last digit that flickers": np.round(0.2 * NOISE),
    "a constant": np.full(len(SECS), 80.0),
    "a constant with a flicker": 80.0 + (np.arange(len(SECS)) % 500 == 250),
    "a flicker about zero": 0.1 * (np.arange(len(SECS)) % 500 == 250),
    "a pulse of half a second": 5.0 * ((SECS > 300) & (SECS < 300.5)),
}


@pytest.mark.parametrize("name", MANOEUVRES)
def test_nothing_is_removed_from(name: str) -> None:
    assert spikes_of(MANOEUVRES[name]) is None


@pytest.mark.parametrize("seed", range(10))
def test_clean_noise_on_a_manoeuvre_has_no_spike(seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal(100_000)
    assert spikes_of(np.sin(np.arange(100_000) / 300) + 0.02 * noise) is None


def test_a_dropout_to_zero_of_constant_revolutions_is_a_spike() -> None:
    values = np.full(1000, 80.0)
    values[500] = 0.0
    assert indices(spikes_of(values)) == [500]


def test_a_short_pulse_of_a_rudder_sampled_every_second_is_no_spike() -> None:
    """A steering gear of 2.5 deg/s goes out and back within two samples."""
    noise = radians(0.05) * np.random.default_rng(2).standard_normal(600)
    values = noise.copy()
    values[300] += radians(2.5)
    assert spikes_of(values, interval=1.0, rudder=True) is None
    values[300] += radians(10.0)
    assert indices(spikes_of(values, interval=1.0, rudder=True), 1.0) == [300]


def test_what_is_sampled_seldom_is_not_judged() -> None:
    values = 0.01 * NOISE
    values[300] += 1.0
    assert spikes_of(values, interval=1.9) is not None
    assert spikes_of(values, interval=2.1) is None


def test_a_sample_beside_a_gap_is_not_judged() -> None:
    values, times = 0.01 * NOISE, np.round(SECS * 1e9).astype(np.int64)
    values[300] += 1.0
    times[301:] += 60 * 10**9
    search = SpikeSearch()
    search.add(times, values)
    assert search.result(0.1) is None


def test_a_heading_that_passes_north_has_no_spike_and_one_beside_north_is_found() -> None:
    heading = radians(1.0) * np.sin(SECS) + radians(0.1) * NOISE
    wrapped = heading % (2 * np.pi)
    assert spikes_of(wrapped, circular=True) is None
    wrapped[1000] = radians(20.0)
    assert indices(spikes_of(wrapped, circular=True)) == [1000]


def test_where_the_chunks_are_cut_changes_nothing() -> None:
    values = np.sin(SECS / 20) + 0.01 * NOISE
    values[::777] += 1.0
    whole = spikes_of(values)
    assert whole is not None
    for chunks in (2, 7, 600, 6000):
        cut = spikes_of(values, chunks)
        assert cut is not None
        assert np.array_equal(cut.times_ns, whole.times_ns)
        assert np.array_equal(cut.values, whole.values)
        assert cut.largest == whole.largest


def test_too_few_samples_show_no_noise_and_no_spike() -> None:
    assert spikes_of(np.zeros(0)) is None
    assert spikes_of(np.array([0.0, 5.0, 0.0])) is None
    assert spikes_of(np.where(np.arange(90) == 50, 5.0, 0.1 * NOISE[:90])) is None


def test_many_outliers_are_the_noise_of_the_channel() -> None:
    values = 0.01 * NOISE
    values[np.random.default_rng(3).random(len(values)) < 0.2] += 1.0
    assert spikes_of(values) is None
    assert MAX_SPIKES > 0.001 * 864_000 * 7  # a week at 10 Hz


def test_of_two_samples_at_one_instant_only_the_spike_is_marked() -> None:
    part = channel(np.array([5.0, 99.0, 5.0]), np.array([1.0, 1.0, 2.0]))
    spikes = SpikeStats(np.array([part.measured_ns[0]]), np.array([99.0]), 94.0)
    assert spikes.among(part).tolist() == [False, True, False]


def rudder_log(source: str, values: FloatArray, **metadata: str) -> TrialLog:
    times = np.round(SECS * 1e9).astype(np.int64)
    rudder = Channel("rudder", source, "rad", times, times, values, metadata=metadata)
    return TrialLog("log.mcap", (rudder,), {}, None)


def test_spikes_count_as_not_measured_and_are_reported() -> None:
    values = np.radians(zigzag() + 0.1 * NOISE)
    values[[1000, 2000]] += radians(10.0)
    log = rudder_log("feedback", values)
    stats = compute_log_stats(log, strict=True)
    rudder = stats["rudder"]
    assert rudder.spikes is not None
    assert (len(rudder.spikes), rudder.valid, rudder.missing) == (2, 5998, 0)
    assert rudder.value_range[1] < radians(21.0)
    assert np.flatnonzero(np.isnan(rudder.screened(log["rudder"]).values)).tolist() == [1000, 2000]
    (text,) = data_warnings(stats, ("rudder",))
    assert text.startswith("/rudder/feedback: 2 spikes (0.033 %), up to ")
    assert "the first 100.0 s after its start: not used" in text
    assert compute_log_stats(log)["rudder"].spikes is None


def test_orders_and_held_channels_are_not_judged() -> None:
    values = np.radians(zigzag())
    values[1000] += radians(10.0)
    for log in (rudder_log("order", values), rudder_log("feedback", values, interpolation="hold")):
        assert compute_log_stats(log, strict=True)["rudder"].spikes is None


def test_a_sentinel_is_no_spike_and_hides_none() -> None:
    values = np.radians(zigzag() + 0.1 * NOISE)
    values[[500, 1500, 2500, 3500]] = radians(45.0)
    values[4000] -= radians(10.0)
    rudder = compute_log_stats(rudder_log("feedback", values), strict=True)["rudder"]
    assert rudder.sentinels == ((radians(45.0), 4),)
    assert rudder.spikes is not None
    assert indices(rudder.spikes) == [4000]
    assert rudder.valid == 5995
