"""Which inputs are written only when they change, and which are sampled by a clock."""

from collections.abc import Sequence

import numpy as np
import pytest

from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.data_quality import data_warnings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Channel, FloatArray, TrialLog
from shiplog.units import CATALOGUE

START = 1_700_000_000_000_000_000
EXECUTES = np.array([10.0, 82.8, 257.6, 437.9])


def channel(
    secs: Sequence[float] | FloatArray,
    values: Sequence[float] | FloatArray,
    name: str = "rudder",
    source: str = "feedback",
    **metadata: str,
) -> Channel:
    at = START + np.round(np.asarray(secs) * 1e9).astype(np.int64)
    return Channel(
        name, source, CATALOGUE[name].unit, at, at, np.asarray(values, float), metadata=metadata
    )


def stats_of(*args: object, **kwargs: str) -> ChannelStats:
    return compute_log_stats(TrialLog("a.mcap", (channel(*args, **kwargs),))).channels[0]  # type: ignore[arg-type]


def feedback(secs: FloatArray) -> FloatArray:
    """Return the angle of a rudder that follows a zig-zag at 2.5 deg/s, deg."""
    angle = np.zeros_like(secs)
    for sign, start in zip((1, -2, 2, -2), EXECUTES, strict=True):
        angle += sign * np.clip(2.5 * (secs - start), 0.0, 20.0 * abs(sign)) / abs(sign)
    return angle


def with_deadband(
    secs: FloatArray, values: FloatArray, threshold: float
) -> tuple[FloatArray, FloatArray]:
    kept = [0]
    for i in range(1, len(values)):
        if abs(values[i] - values[kept[-1]]) >= threshold:
            kept.append(i)
    return secs[kept], values[kept]


def with_keep_alive(every: float) -> tuple[FloatArray, FloatArray]:
    """Return orders that are written when they change, and again after a time without a change."""
    secs, values, last = [0.0], [0.0], 0.0
    for start, value in zip([*EXECUTES, 600.0], [20.0, -20.0, 20.0, -20.0, None], strict=True):
        while last + every < start:
            last += every
            secs.append(last)
            values.append(values[-1])
        if value is not None:
            last = start
            secs.append(start)
            values.append(value)
    return np.array(secs), np.array(values)


def test_an_order_written_at_its_changes_is_held() -> None:
    stats = stats_of([0.0, *EXECUTES], [0, 20, -20, 20, -20])
    assert stats.hold is not None
    assert stats.hold.longest_secs == pytest.approx(180.3)
    assert stats.hold.largest_step == 40.0
    assert stats.gaps == ()


@pytest.mark.parametrize("secs", [[0.0], [0.0, 600.0], [3.0, 130.0, 600.0]])
def test_revolutions_written_a_few_times_are_held(secs: list[float]) -> None:
    assert stats_of(secs, np.full(len(secs), 80.0), name="rpm").hold is not None


def test_one_sample_of_a_rudder_is_not_held() -> None:
    assert stats_of([0.0], [0.1]).hold is None


@pytest.mark.parametrize("every", [10.0, 30.0, 60.0])
def test_an_order_with_keep_alive_messages_is_held(every: float) -> None:
    assert stats_of(*with_keep_alive(every)).hold is not None


@pytest.mark.parametrize("threshold", [0.5, 1.0])
def test_a_feedback_with_a_deadband_is_held(threshold: float) -> None:
    secs = np.arange(0.0, 600.0, 0.1)
    assert stats_of(*with_deadband(secs, feedback(secs), threshold)).hold is not None


def test_an_autopilot_that_writes_changes_of_any_size_is_held_by_its_source() -> None:
    rng = np.random.default_rng(1)
    secs = np.cumsum(rng.exponential(4.0, 150))
    assert stats_of(secs, rng.normal(0, 3, 150), source="autopilot_order").hold is not None


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("interval", [0.1, 1.0, 3.0])
def test_a_sampled_feedback_is_not_held(seed: int, interval: float) -> None:
    rng = np.random.default_rng(seed)
    secs = np.arange(0.0, 600.0, interval)
    ideal = feedback(secs)
    noisy = ideal + rng.normal(0, 0.2, len(secs))
    kept = rng.random(len(secs)) > 0.2
    outage = (secs < 100) | (secs > 140)
    jitter = secs + rng.uniform(0, 0.8 * interval, len(secs))
    for times, values in (
        (secs, ideal),
        (secs, noisy),
        (secs, np.round(noisy)),
        (secs[kept], noisy[kept]),
        (secs[kept], ideal[kept]),
        (secs[outage], ideal[outage]),
        (secs[outage], noisy[outage]),
        (jitter, noisy),
        (jitter, ideal),
        (secs, np.full(len(secs), 80.0)),
        (secs[: len(secs) // 2], ideal[: len(secs) // 2]),
    ):
        assert stats_of(times, values).hold is None


def test_a_measured_channel_is_held_only_where_its_metadata_states_it() -> None:
    few = [0.0, 10.0, 200.0, 600.0], [5.0, 6.0, 5.0, 6.0]
    assert stats_of(*few, name="speed").hold is None
    assert stats_of(*few, name="speed", interpolation="hold").hold is not None


def test_metadata_takes_precedence_over_detection() -> None:
    assert stats_of([0.0, *EXECUTES], [0, 20, -20, 20, -20], interpolation="linear").hold is None
    secs = np.arange(0.0, 600.0, 1.0)
    assert stats_of(secs, feedback(secs), interpolation="hold").hold is not None


def test_a_held_channel_is_reported_with_its_figures() -> None:
    rpm = channel([0.0, 130.0], [80.0, 60.0], "rpm")
    rudder = channel(np.arange(0.0, 600.5, 0.5), np.sin(np.arange(1201.0)))
    log = TrialLog("a.mcap", (rpm, rudder))
    (warning,) = data_warnings(compute_log_stats(log), ("rpm", "rudder"))
    assert warning.startswith("/rpm/feedback: held at its last value between its 2 samples")
    assert "longest interval 130.0 s and for the last 470.0 s" in warning


def test_an_order_of_the_rudder_is_reported() -> None:
    orders = np.array([0, 0.35, -0.35, 0.35, -0.35])
    log = TrialLog("a.mcap", (channel([0.0, *EXECUTES], orders),))
    held, order = data_warnings(compute_log_stats(log), ("rudder",))
    assert "held" in held
    assert "the order, not the angle" in order
    assert "40.11 deg" in order


def test_an_unknown_interpolation_is_reported() -> None:
    secs = np.arange(0.0, 60.0, 0.5)
    log = TrialLog("a.mcap", (channel(secs, np.sin(secs), interpolation="spline"),))
    (warning,) = data_warnings(compute_log_stats(log), ("rudder",))
    assert "unknown interpolation 'spline'" in warning
    assert "hold, linear" in warning


def test_coarse_time_stamps_are_reported_with_the_remedy() -> None:
    secs = np.floor(np.arange(0.0, 60.0, 0.2))
    log = TrialLog("a.mcap", (channel(secs, np.sin(secs)),))
    (warning,) = data_warnings(compute_log_stats(log), ("rudder",))
    assert "5 samples share each time stamp, 1 s apart" in warning
    assert 'rebuild = "uniform"' in warning


@pytest.mark.parametrize("name", ["rudder", "yaw_rate", "rpm", "speed"])
def test_empty_rows_change_nothing_but_their_own_count(name: str) -> None:
    rng = np.random.default_rng(3)
    secs = np.delete(np.arange(0.0, 300.0, 3.0), slice(40, 48))
    values = rng.normal(size=len(secs))
    rows = np.arange(0.0, 300.0, 0.5)
    column = np.full(len(rows), np.nan)
    column[np.round(secs / 0.5).astype(int)] = values
    alone, sparse = stats_of(secs, values, name=name), stats_of(rows, column, name=name)
    for key in ("interval_secs", "irregular_share", "interval_range_secs", "hold", "valid"):
        assert getattr(alone, key) == getattr(sparse, key)
    assert np.allclose(alone.gaps, sparse.gaps)
    warnings = [
        data_warnings(compute_log_stats(TrialLog("a.mcap", (each,))), (name,))
        for each in (channel(secs, values, name), channel(rows, column, name))
    ]
    assert warnings[0] == warnings[1]
