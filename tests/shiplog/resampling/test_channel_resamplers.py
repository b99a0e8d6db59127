"""Held channels, orders followed by a steering gear, coarse time stamps and empty rows."""

from collections.abc import Sequence

import numpy as np
import pytest

from shiplog import Channel, TrialLog, resample
from shiplog.checks.log_stats import compute_log_stats
from shiplog.resampling import choose_clock, resample_chunks, with_steering_gear
from shiplog.types import FloatArray, Signals, concatenate_signals
from tests.helpers.trial_logs import InChunks

START = 1_700_000_000_000_000_000
NAMES = ("yaw_rate", "rudder")


def channel(
    name: str, secs: Sequence[float] | FloatArray, values: Sequence[float] | FloatArray, **more: str
) -> Channel:
    at = START + np.round(np.asarray(secs) * 1e9).astype(np.int64)
    return Channel(name, "test", "1", at, at, np.asarray(values, float), metadata=more)


def log_of(*channels: Channel) -> TrialLog:
    return TrialLog("trial.mcap", channels)


def yaw_rate(dt: float, end: float) -> Channel:
    secs = np.arange(0.0, end + dt / 2, dt)
    return channel("yaw_rate", secs, np.sin(secs))


def test_the_integral_and_the_time_of_a_held_step_are_exact_wherever_the_step_is() -> None:
    for at in np.linspace(50.0, 52.0, 21):
        log = log_of(yaw_rate(1.0, 200.0), channel("rudder", [0.0, at, 150.0], [0.0, 0.3, 0.0]))
        signals = resample(log, channels=NAMES)
        assert np.trapezoid(signals["rudder"], dx=1.0) == pytest.approx(0.3 * (150.0 - at))
        step = np.diff(signals["rudder"][:100])
        assert np.sum(step * (signals.time_secs[:99] + 0.5)) / 0.3 == pytest.approx(at)


def test_a_held_channel_is_held_to_the_end_of_the_others() -> None:
    rpm = channel("rpm", [0.0, 20.0], [80.0, 60.0])
    signals = resample(log_of(yaw_rate(0.5, 100.0), rpm), channels=("yaw_rate", "rpm"))
    assert len(signals) == 201
    assert set(signals["rpm"][42:]) == {60.0}


def test_revolutions_written_once_hold_from_then_on() -> None:
    log = log_of(yaw_rate(0.5, 100.0), channel("rpm", [20.0], [80.0]))
    signals = resample(log, channels=("yaw_rate", "rpm"))
    assert (signals.start_ns - START) * 1e-9 == pytest.approx(20.0)
    assert set(signals["rpm"]) == {80.0}
    optional = resample(log, channels=("yaw_rate",), optional=("rpm",))
    assert np.isnan(optional["rpm"][:40]).all()
    assert set(optional["rpm"][40:]) == {80.0}


def test_an_order_is_followed_at_the_rate_of_the_steering_gear() -> None:
    orders = channel("rudder", [0.0, 10.25, 14.0, 80.0], [0.0, 0.4, -0.4, 0.0])
    signals = followed(log_of(yaw_rate(0.5, 100.0), orders))
    time, angle, target = np.arange(0.0, 100.005, 0.005), 0.0, 0.0
    expected = np.zeros_like(time)
    for i, now in enumerate(time):
        expected[i] = angle
        target = orders.values[np.searchsorted([0.0, 10.25, 14.0, 80.0], now + 1e-9) - 1]
        angle += np.clip(target - angle, -0.05 * 0.005, 0.05 * 0.005)
    assert np.allclose(signals["rudder"], expected[::100], atol=1e-3)


def followed(log: TrialLog | InChunks) -> Signals:
    clock = choose_clock(log, compute_log_stats(log), channels=NAMES)
    return concatenate_signals(resample_chunks(log.chunks(), with_steering_gear(clock, 0.05)))


def test_a_measured_angle_is_not_followed_by_the_steering_gear() -> None:
    secs = np.arange(0.0, 100.0, 0.5)
    clock_log = log_of(yaw_rate(0.5, 100.0), channel("rudder", secs, np.sin(secs)))
    clock = choose_clock(clock_log, compute_log_stats(clock_log), channels=NAMES)
    assert with_steering_gear(clock, 0.05) is clock


def coarse(dt: float, end: float) -> TrialLog:
    """Return a yaw rate and a rudder that are equal, with times cut to whole seconds."""
    secs = np.arange(0.0, end, dt)
    values = np.sin(0.1 * secs)
    return log_of(*(channel(name, np.floor(secs), values) for name in NAMES))


def test_samples_of_one_time_stamp_are_averaged_in_inputs_and_outputs_alike() -> None:
    signals = resample(coarse(0.2, 100.0))
    assert np.allclose(signals["rudder"], signals["yaw_rate"], rtol=1e-12)
    assert signals["rudder"][10] == pytest.approx(np.mean(np.sin(0.1 * (10 + 0.2 * np.arange(5)))))


@pytest.mark.parametrize("seed", range(5))
def test_where_chunks_are_cut_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    orders = channel("rudder", np.sort(rng.uniform(0, 90, 7)), rng.normal(size=7))
    for log in (coarse(0.2, 60.0), log_of(yaw_rate(0.5, 100.0), orders)):
        cuts = InChunks(log, np.sort(rng.uniform(0, 90, 12)).tolist())
        for resampled in (followed, lambda each: resample(each, channels=NAMES)):
            one, other = resampled(log), resampled(cuts)
            for name in NAMES:
                assert np.array_equal(one[name], other[name], equal_nan=True)


@pytest.mark.parametrize("every", [2, 3, 6])
def test_a_channel_in_every_nth_row_is_resampled_as_without_the_empty_rows(every: int) -> None:
    rng = np.random.default_rng(every)
    rows = np.arange(0.0, 300.0, 0.5)
    full = log_of(*(channel(name, rows, rng.normal(size=600)) for name in NAMES))
    kept = np.arange(600) % every == 0
    kept[200:260] = False
    sparse = log_of(*(channel(c.name, rows, np.where(kept, c.values, np.nan)) for c in full))
    dropped = log_of(*(c.take(np.flatnonzero(kept)) for c in full))
    one, other = resample(sparse), resample(dropped)
    assert (one.start_ns, one.dt_secs) == (other.start_ns, other.dt_secs)
    for name in NAMES:
        assert np.array_equal(one[name], other[name], equal_nan=True)
    assert np.isnan(one["rudder"]).any()
