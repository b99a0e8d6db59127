"""Tests of steps forward of a clock: simulated clocks that are set and set back."""

import numpy as np
import pytest

from shiplog.mcap.clock_steps import ChannelTimes, ClockStep, continued_times
from shiplog.mcap.forward_steps import returned_steps

SECOND = 1_000_000_000
INTERVALS = {"yaw_rate": 0.1, "rudder": 0.25, "position": 1.0}


def channels_with(*steps: tuple[float, float], seed: int = 0) -> tuple[list[ChannelTimes], ...]:
    """Return channels of steady rates, without and with steps (time, size in s) of their clock."""
    rng = np.random.default_rng(seed)
    clocks = []
    for interval in INTERVALS.values():
        clock = np.arange(rng.random() * interval, 300.0, interval)
        clocks.append(clock + rng.uniform(0, 0.1 * interval, len(clock)))
    owner = np.repeat(np.arange(len(clocks)), [len(c) for c in clocks])
    place = np.argsort(np.argsort(np.concatenate(clocks), kind="stable"))
    true, stepped = [], []
    for number, name in enumerate(INTERVALS):
        times = (clocks[number] * SECOND).astype(np.int64)
        change = sum(np.where(times >= at * SECOND, round(size * SECOND), 0) for at, size in steps)
        true.append(ChannelTimes(name, place[owner == number], times))
        stepped.append(ChannelTimes(name, place[owner == number], times + change))
    return true, stepped


def repaired(channels: list[ChannelTimes]) -> list[np.ndarray]:
    pairs = returned_steps(channels)
    steps: list[ClockStep] = [step for pair in pairs for step in pair]
    return [continued_times(channel, steps) for channel in channels]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [12.0, 40.0, 90.0, 3600.0, 86_400.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_clock_that_is_set_and_returned_has_its_true_times(
    seed: int, size: float, sign: int
) -> None:
    true, stepped = channels_with((120.0, sign * size), (180.0, -sign * size), seed=seed)
    for times, channel in zip(repaired(stepped), true, strict=True):
        assert np.abs(times - channel.times_ns).max() < 0.1 * SECOND
        np.testing.assert_array_equal(times[-100:], channel.times_ns[-100:])


def test_two_excursions_are_two_pairs() -> None:
    true, stepped = channels_with((60.0, 20.0), (100.0, -20.0), (150.0, 3600.0), (220.0, -3600.0))
    pairs = returned_steps(stepped)
    assert [round(forward.size_ns / SECOND) for forward, _ in pairs] == [20, 3600]
    for times, channel in zip(repaired(stepped), true, strict=True):
        assert np.abs(times - channel.times_ns).max() < 0.1 * SECOND


@pytest.mark.parametrize("steps", [[(120.0, 40.0)], [(120.0, 40.0), (180.0, -25.0)]])
def test_a_step_forward_that_none_of_its_size_returns_is_no_pair(
    steps: list[tuple[float, float]],
) -> None:
    _, stepped = channels_with(*steps)
    assert returned_steps(stepped) == []


@pytest.mark.parametrize("seed", range(10))
def test_parts_of_a_file_in_another_order_are_no_pair(seed: int) -> None:
    true, _ = channels_with(seed=seed)
    bounds = np.sort(np.random.default_rng(seed).choice(np.arange(20, 280), 7, replace=False))
    order = np.random.default_rng(seed + 100).permutation(8)
    rank = np.argsort(order)
    moved = []
    for channel in true:
        part = rank[np.searchsorted(bounds * SECOND, channel.times_ns)]
        positions = channel.positions + part * 1_000_000
        by_place = np.argsort(positions)
        moved.append(ChannelTimes(channel.name, positions[by_place], channel.times_ns[by_place]))
    assert returned_steps(moved) == []
