"""A channel on a clock: interpolated where it is known, in whatever chunks its samples come."""

from dataclasses import replace

import numpy as np
import pytest

from shiplog import Channel, TrialLog
from shiplog.checks.channel_on_clock import ChannelOnClock, Frames, Unwrapped
from shiplog.checks.log_stats import compute_log_stats
from shiplog.checks.on_change import INTERPOLATION_KEY

SEC = 10**9


def on_clock(samples: Channel, at: np.ndarray, *cuts: int, **options: object) -> np.ndarray:
    """Return the values of a channel at instants in s since its first sample."""
    (stats,) = compute_log_stats(TrialLog("x", (samples,)))
    start_ns = int(samples.measured_ns.min())
    gathered = ChannelOnClock(stats, at, start_ns, **options)  # type: ignore[arg-type]
    for start, end in zip((0, *cuts), (*cuts, len(samples)), strict=True):
        gathered.add((samples.part(start, end),))
    return gathered.result()


def a_channel(values: np.ndarray, secs: np.ndarray, fields: tuple[str, ...] = ()) -> Channel:
    times = (1_000 * SEC + secs * SEC).astype(np.int64)
    return Channel("sway", "a", "m/s", times, times, values, fields)


def test_the_values_are_interpolated_and_nan_beyond_the_ends() -> None:
    secs = np.arange(0.0, 30.0, 0.5)
    values = on_clock(a_channel(np.sin(secs), secs), np.array([-1.0, 0.25, 7.7, 29.5, 31.0]))
    expected = np.interp([0.25, 7.7, 29.5], secs, np.sin(secs))
    assert values[1:4, 0] == pytest.approx(expected)
    assert np.isnan(values[[0, 4], 0]).all()


def test_a_value_inside_a_gap_is_nan() -> None:
    secs = np.concatenate((np.arange(0.0, 20.0, 0.5), np.arange(60.0, 80.0, 0.5)))
    values = on_clock(a_channel(np.cos(secs), secs), np.array([10.0, 40.0, 70.0]))[:, 0]
    assert np.isfinite(values).tolist() == [True, False, True]


def test_a_held_channel_has_no_gaps_and_no_end() -> None:
    secs = np.array([0.0, 100.0, 250.0])
    held = replace(a_channel(np.array([1.0, 2.0, 3.0]), secs), metadata={INTERPOLATION_KEY: "hold"})
    assert on_clock(held, np.array([50.0, 200.0, 900.0]))[:, 0].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("cuts", [(1,), (7, 8, 30), (20,)])
def test_where_the_samples_are_cut_changes_nothing(cuts: tuple[int, ...]) -> None:
    secs = np.arange(0.0, 30.0, 0.7)
    heading = a_channel((0.4 * secs) % (2 * np.pi), secs)
    at = np.linspace(0.0, 29.0, 59)
    whole = on_clock(heading, at, transform=Unwrapped())
    np.testing.assert_array_equal(on_clock(heading, at, *cuts, transform=Unwrapped()), whole)


def test_an_unwrapped_angle_is_that_of_numpy() -> None:
    angles = np.random.default_rng(3).uniform(-np.pi, np.pi, (500, 1))
    unwrapped = Unwrapped()
    ours = np.concatenate([unwrapped(np.zeros(len(x)), x) for x in np.split(angles, [1, 200])])
    assert ours == pytest.approx(np.unwrap(angles, axis=0), abs=1e-9)


def test_positions_that_share_frames_have_one_datum() -> None:
    secs = np.arange(0.0, 30.0)
    north_east = np.column_stack((3.0 * secs, 0.0 * secs))
    frames: Frames = {}
    first, second = (
        a_channel(values, secs, ("north", "east"))
        for values in (north_east, north_east + np.array([100.0, 0.0]))
    )
    at = np.array([10.0])
    assert on_clock(first, at, frames=frames).tolist() == [[30.0, 0.0]]
    assert on_clock(second, at, frames=frames).tolist() == [[130.0, 0.0]]
    assert on_clock(second, at).tolist() == [[30.0, 0.0]]
