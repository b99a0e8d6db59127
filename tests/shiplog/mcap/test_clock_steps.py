"""Tests of the detection of steps of a clock: simulated clocks with known steps."""

import numpy as np
import pytest

from shiplog.mcap.clock_steps import (
    ChannelTimes,
    backward_rows,
    common_steps,
    continued_times,
    earlier_rows,
    steps_back,
)
from shiplog.mcap.forward_steps import pause_rows

SECOND = 1_000_000_000
INTERVALS = {"yaw_rate": 0.1, "rudder": 0.25, "position": 1.0}


def steady_channels(seed: int, duration: float = 300.0) -> list[ChannelTimes]:
    """Return channels of steady rates with jitter and dropouts, in the order of reception."""
    rng = np.random.default_rng(seed)
    times = []
    for interval in INTERVALS.values():
        clock = np.arange(rng.random() * interval, duration, interval)
        clock += rng.uniform(0, 0.1 * interval, len(clock))
        first = rng.integers(len(clock) // 4, len(clock) // 2)
        times.append(np.delete(clock, slice(first, first + rng.integers(0, 30))))
    owner = np.repeat(np.arange(len(times)), [len(t) for t in times])
    ordered = np.argsort(np.concatenate(times), kind="stable")
    place = np.argsort(ordered)
    return [
        ChannelTimes(name, place[owner == i], (times[i] * SECOND).astype(np.int64))
        for i, name in enumerate(INTERVALS)
    ]


def with_step(channel: ChannelTimes, at_secs: float, size_secs: float) -> ChannelTimes:
    """Return a channel whose clock changes by a size from a true time on."""
    change = np.where(channel.times_ns >= at_secs * SECOND, round(size_secs * SECOND), 0)
    return ChannelTimes(channel.name, channel.positions, channel.times_ns + change)


@pytest.mark.parametrize("seed", range(50))
def test_undisturbed_clocks_have_no_steps(seed: int) -> None:
    channels = steady_channels(seed)
    assert steps_back(channels) == []
    pauses = common_steps(channels, [pause_rows(c.times_ns) for c in channels])
    assert all(len(pause.names) < len(channels) for pause in pauses)


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("size", [-3.3, -5.25, -47.0, -180.0, -280.0, -400.0, -3600.0, -1e8])
def test_a_clock_set_back_in_all_channels_is_repaired(seed: int, size: float) -> None:
    channels = steady_channels(seed)
    at = np.random.default_rng(seed).uniform(200, 250)
    disturbed = [with_step(c, at, size) for c in channels]
    steps = steps_back(disturbed)
    assert len(steps) == 1
    assert steps[0].size_ns / SECOND == pytest.approx(size, abs=0.1)
    assert steps[0].steady_names == ()
    for channel, original in zip(disturbed, channels, strict=True):
        repaired = continued_times(channel, steps)
        assert np.abs(repaired - original.times_ns).max() < 0.1 * SECOND


def test_two_steps_are_repaired() -> None:
    channels = steady_channels(1)
    disturbed = [with_step(with_step(c, 200, -7.2), 250, -4.4) for c in channels]
    steps = steps_back(disturbed)
    assert [step.size_ns / SECOND for step in steps] == pytest.approx([-7.2, -4.4], abs=0.1)


def test_a_step_of_one_channel_names_those_that_go_on() -> None:
    channels = steady_channels(2)
    disturbed = [with_step(channels[0], 220, -6.0), *channels[1:]]
    (step,) = steps_back(disturbed)
    assert step.names == ("yaw_rate",)
    assert step.steady_names == ("rudder", "position")


def test_late_messages_are_no_steps() -> None:
    (times,) = (steady_channels(3)[0].times_ns,)
    rng = np.random.default_rng(3)
    for row in rng.choice(len(times) - 10, 40, replace=False):
        times[row : row + 3] = np.roll(times[row : row + 3], 1)
    assert backward_rows(times) == []


@pytest.mark.parametrize("seed", range(10))
def test_data_in_another_order_are_no_steps(seed: int) -> None:
    times = steady_channels(seed)[0].times_ns
    parts = np.array_split(times, 12)
    order = np.random.default_rng(seed).permutation(12)
    disordered = np.concatenate([parts[i] for i in order])
    assert backward_rows(disordered) == []
    assert earlier_rows(disordered) == []


def test_parallel_writers_of_alternate_samples_are_no_steps() -> None:
    times = np.arange(1000) * SECOND // 10
    parts = [part for block in np.split(times, 10) for part in (block[::2], block[1::2])]
    assert backward_rows(np.concatenate(parts)) == []


def test_a_short_log_set_back_near_its_end_is_repaired() -> None:
    times = np.concatenate([np.arange(20), np.arange(20, 24) - 7]) * SECOND
    assert backward_rows(times) == [20]


def test_a_late_last_message_is_no_step() -> None:
    times = np.arange(40) * SECOND
    times[-1] -= 5 * SECOND // 2
    assert backward_rows(times) == []


@pytest.mark.parametrize("seed", range(10))
def test_parts_of_all_channels_in_another_order_with_lost_samples_are_no_steps(seed: int) -> None:
    channels = steady_channels(seed)
    half = max(int(c.positions.max()) for c in channels) // 2
    swapped = []
    for channel in channels:
        late = channel.positions > half
        order = np.concatenate([np.flatnonzero(late), np.flatnonzero(~late)])
        positions = np.where(late, channel.positions - half - 1, channel.positions + half + 2)
        swapped.append(ChannelTimes(channel.name, positions[order], channel.times_ns[order]))
    lost = swapped[0].times_ns[-1] - 20 * SECOND
    kept = swapped[0].times_ns > swapped[0].times_ns[0] - SECOND
    kept |= swapped[0].times_ns < lost
    swapped[0] = ChannelTimes("yaw_rate", swapped[0].positions[kept], swapped[0].times_ns[kept])
    assert steps_back(swapped) == []
