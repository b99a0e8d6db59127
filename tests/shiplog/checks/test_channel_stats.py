"""Statistics of raw channels, whatever the chunks of the log."""

from dataclasses import fields

import numpy as np
import pytest
from faults import dropout, freeze, spike
from trial_logs import InChunks

from shiplog import Channel, TrialLog
from shiplog.checks.channel_stats import ChannelStats, possible_range, without_unusable
from shiplog.checks.log_stats import compute_log_stats

START = 1_700_000_000 * 10**9


def channel(name: str, seconds: list[float], values: list[float] | np.ndarray) -> Channel:
    at = START + np.round(np.array(seconds) * 1e9).astype(np.int64)
    return Channel(name, "a", "1", at, at, np.array(values, float))


def stats_of(channel: Channel, *, strict: bool = False) -> ChannelStats:
    return compute_log_stats(TrialLog("x", (channel,)), strict=strict)[channel.name]


def digits(stats: ChannelStats) -> dict[str, str]:
    """All statistics of a channel, to the last digit."""
    texts = {field.name: repr(getattr(stats, field.name)) for field in fields(stats)}
    return texts | {"stuck": repr(stats.stuck and vars(stats.stuck))}


def test_gaps_have_a_start_and_a_length() -> None:
    sparse = channel("speed", [0, 1, 2, 10, 11, 12, 30], np.zeros(7))
    assert stats_of(sparse).gaps == ((2.0, 8.0), (12.0, 18.0))
    assert stats_of(channel("speed", [0, 1, 2], np.zeros(3))).gaps == ()
    assert stats_of(channel("speed", [], [])).gaps == ()


def test_a_channel_without_samples_has_statistics() -> None:
    empty = stats_of(channel("speed", [], []))
    assert (empty.samples, empty.valid, empty.interval_secs, empty.span_ns) == (0, 0, 0.0, (0, 0))


def test_only_possible_values_are_valid_if_strict() -> None:
    wild = channel("speed", [0, 1, 2, 3], [5, 1e9, 6, np.nan])
    assert stats_of(wild).valid == 3
    assert stats_of(wild, strict=True).valid == 2
    assert stats_of(wild, strict=True).value_range == (5.0, 6.0)
    assert stats_of(wild).impossible.count == 1
    np.testing.assert_array_equal(
        without_unusable(wild, possible_range(wild.name)).values, [5, np.nan, 6, np.nan]
    )


def test_the_interval_between_valid_samples_leaves_out_the_others() -> None:
    values = np.full(100, np.nan)
    values[::10] = 1.0
    stats = stats_of(channel("speed", list(0.1 * np.arange(100)), values))
    assert stats.row_interval_secs == pytest.approx(0.1)
    assert stats.interval_secs == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(3))
def test_the_chunks_do_not_matter(zigzag_log: TrialLog, seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = dropout("yaw_rate", 100.0, 20.0)(
        freeze("speed", 50.0, 60.0)(
            spike("speed", 300.0, 1e9)(spike("yaw_rate", 10.0, np.nan)(zigzag_log))
        )
    )
    cuts = np.sort(rng.uniform(0, 500, 40)).tolist()
    whole, parted = compute_log_stats(log), compute_log_stats(InChunks(log, cuts))
    for one, other in zip(whole, parted, strict=True):
        assert digits(one) == digits(other)
    assert whole["speed"].stuck is not None
    assert whole["yaw_rate"].gaps
