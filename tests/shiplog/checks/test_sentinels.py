"""Values that stand for "not available" are found, and no measured value is taken for one."""

import numpy as np
import pytest
from trial_logs import as_log

from recorders.simulated.simulate import simulate
from shiplog import Vessel
from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.log_stats import compute_log_stats
from shiplog.checks.sentinels import sentinel_values
from shiplog.types import Channel, TrialLog

COUNT = 600
TIME = np.arange(COUNT) * 0.5


def heading(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.radians(40.0 + 20.0 * np.sin(0.05 * TIME) + 0.1 * rng.standard_normal(COUNT))


def yaw_rate(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.radians(np.sin(0.05 * TIME) + 0.02 * rng.standard_normal(COUNT))


@pytest.mark.parametrize("rows", [slice(0, None, 3), slice(80), slice(300, 301), slice(-40, None)])
@pytest.mark.parametrize("code", [511.0, 999.0, 655.35, -999.0])
def test_a_known_code_is_found_wherever_it_occurs(rows: slice, code: float) -> None:
    values = heading()
    values[rows] = np.radians(code)
    assert sentinel_values(values, "rad") == (np.radians(code),)


@pytest.mark.parametrize("code", [-128.0, 127.0, 731.4])
def test_the_rate_of_turn_of_ais_that_is_not_available_is_found(code: float) -> None:
    values = yaw_rate()
    values[100:130] = np.radians(code / 60)
    assert sentinel_values(values, "rad/s") == (np.radians(code / 60),)


@pytest.mark.parametrize("value", [0.0, 17.3, -4.2])
def test_a_repeated_excursion_to_one_unlisted_value_is_found(value: float) -> None:
    speed = 7.0 + 0.5 * np.sin(0.02 * TIME) + 0.01 * np.random.default_rng(2).standard_normal(COUNT)
    speed[50::97] = value
    assert sentinel_values(speed, "m/s") == (value,)


def test_zeros_between_other_values_are_found_where_a_gyro_drops_out() -> None:
    values = yaw_rate() + np.radians(0.5)  # passes through zero, too
    lost = np.arange(30, COUNT, 40)
    values[lost] = 0.0
    around = np.abs(values[lost - 1])
    assert (sentinel_values(values, "rad/s") == (0.0,)) == (np.median(around) > np.radians(0.3))


def test_two_codes_are_found_together() -> None:
    values = heading()
    values[::5], values[1::7] = np.radians(511.0), np.radians(-999.0)
    assert set(sentinel_values(values, "rad")) == set(np.radians([511.0, -999.0]))


def quantised(values: np.ndarray, digit: float) -> np.ndarray:
    return np.round(values / digit) * digit


@pytest.mark.parametrize(
    "values",
    [
        quantised(heading(), np.radians(1.0)),
        quantised(yaw_rate(), np.radians(0.1)),
        np.unwrap(np.linspace(0.0, 12.0, COUNT)),
        (np.linspace(0.0, 14.0, COUNT)) % (2 * np.pi),
        np.radians(20.0) * np.sign(np.sin(0.05 * TIME)),  # orders of a zig-zag
        np.clip(np.radians(60.0) * np.sin(0.05 * TIME), -0.61, 0.61),  # the rudder at its stop
        np.where(TIME < 150.0, 0.0, 0.05 * (TIME - 150.0)),  # under way from rest
        np.where(TIME % 60.0 < 10.0, 5.0, 0.0),
        np.full(COUNT, 100.0),
    ],
)
def test_measured_values_are_no_sentinels(values: np.ndarray) -> None:
    assert sentinel_values(values, "rad") == ()


@pytest.mark.parametrize("period", [100, 240, 400])
@pytest.mark.parametrize("hold", [30, 50])
def test_orders_after_a_noisy_approach_are_no_sentinels(period: int, hold: int) -> None:
    order = np.radians(np.random.default_rng(3).normal(0.0, 0.3, 2400))
    for k in range(600, 2400, period):
        order[k : k + hold] = np.radians(10.0)
    assert sentinel_values(order, "rad") == ()


@pytest.mark.parametrize("manoeuvre", ["zigzag-10-10", "turning-circle-35", "pseudo-random"])
def test_no_simulated_channel_has_a_sentinel(vessel: Vessel, manoeuvre: str) -> None:
    for seed in range(5):
        trial = simulate(vessel, manoeuvre, duration_secs=300.0, seed=seed)
        stats = compute_log_stats(as_log(trial), strict=True)
        assert [channel.topic for channel in stats if channel.sentinels] == []


def test_sentinels_are_counted_and_not_used_however_the_log_is_cut() -> None:
    values = heading()
    values[::3] = np.radians(511.0)
    stamps = (TIME * 1e9).astype(np.int64)
    channel = Channel("heading", "gyro", "rad", stamps, stamps, values)
    (stats,) = compute_log_stats(TrialLog("x", (channel,)), strict=True)
    assert stats.sentinels == ((np.radians(511.0), 200),)
    assert (stats.valid, stats.missing) == (400, 0)
    assert np.isnan(stats.screened(channel).values[::3]).all()
    assert stats.value_range[1] < 2 * np.pi


def heading_stats(values: np.ndarray) -> ChannelStats:
    stamps = (np.arange(len(values)) * 1e9).astype(np.int64)
    channel = Channel("heading", "gyro", "rad", stamps, stamps, values)
    return compute_log_stats(TrialLog("x", (channel,)), strict=True).channels[0]


def test_a_heading_that_counts_its_turns_is_used_and_one_that_jumps_beyond_two_is_not() -> None:
    circles = np.linspace(0.0, -20.0, COUNT)
    assert heading_stats(circles).valid == COUNT
    assert heading_stats(heading() + 14.0).valid == COUNT
    with_gap = np.concatenate((np.linspace(0.0, 12.0, 200), np.linspace(16.0, 25.0, 400)))
    assert heading_stats(with_gap).valid == COUNT
    wild = heading()
    wild[100:400:50] = [13.0, -40.0, 700.0, 200.0, -300.0, 88.0]
    assert heading_stats(wild).valid == COUNT - 6
    assert heading_stats(wild).impossible.count == 6


def test_zeros_that_interrupt_steady_revolutions_are_no_measurement() -> None:
    revolutions = np.full(300, 80.0)
    revolutions[::3] = 0.0
    assert sentinel_values(revolutions, "rpm") == (0.0,)


def test_a_propeller_that_is_stopped_for_a_while_is_measured() -> None:
    revolutions = np.full(300, 80.0)
    revolutions[50:80] = revolutions[150:180] = revolutions[200:240] = 0.0
    assert sentinel_values(revolutions, "rpm") == ()


def test_revolutions_written_when_they_change_are_measured() -> None:
    assert sentinel_values(np.array([80.0, 0.0] * 50), "rpm") == ()
