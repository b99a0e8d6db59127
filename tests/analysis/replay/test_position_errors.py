"""Noise of positions that allows for their errors of some seconds, from errors of known size."""

from dataclasses import replace
from math import radians, sqrt
from pathlib import Path

import numpy as np
import pytest
from filter_runs import signals_of
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from tanker_logs import tanker_log

from analysis.replay.plan import plan_replay
from analysis.replay.position_errors import position_noise
from analysis.replay.replay import Replay
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import load_vessel
from shiplog.types import FloatArray

PROJECT = Path(__file__).resolve().parents[3]
CIRCLE = PROJECT.parent / "shared/data/kvlcc2/marin/MARIN_FREE_KVLCC2_tc_35_m.dat"
DT, COUNT, SPEED = 0.5, 4000, 7.0
WHITE_STD = 0.8


def stats_of(
    error: FloatArray, seed: int, *, rate_deg: float = 0.4, log_bias: float = 0.0
) -> SignalStats:
    """The statistics of a ship on a circle with a current; the error (COUNT,) is in the north."""
    rng, at = np.random.default_rng(1000 + seed), DT * np.arange(COUNT)
    rate = radians(rate_deg)
    outputs = np.column_stack((np.full(COUNT, rate), np.full(COUNT, SPEED + log_bias)))
    signals = signals_of(outputs, np.zeros(COUNT), np.full(COUNT, 100.0), DT)
    north = SPEED / rate * np.sin(rate * at) + 0.5 * at + error
    values = {"compass": rate * at, "north": north + WHITE_STD * rng.standard_normal(COUNT)}
    signals = replace(signals, values=dict(signals.values) | values)
    return signal_stats(signals, load_vessel("table1")[0].paper_coefficients)


def test_of_white_noise_the_noise_is_that_of_consecutive_fixes() -> None:
    found = [position_noise(stats_of(np.zeros(COUNT), s), "north", WHITE_STD) for s in range(20)]
    assert found.count(WHITE_STD) >= 19


@pytest.mark.parametrize("secs", [1.0, 3.0])
def test_of_lasting_errors_the_noise_is_that_of_their_means(secs: float) -> None:
    """The variance of the third difference of means of 10 s follows from the autocovariance."""
    std, a, mean = 2.0, np.exp(-DT / secs), round(10.0 / DT)
    found = []
    for seed in range(10):
        noise = np.random.default_rng(seed).standard_normal(COUNT) * std * sqrt(1 - a**2)
        found.append(position_noise(stats_of(lfilter([1], [1, -a], noise), seed), "north", 0.8))
    third = np.repeat([-1.0, 3.0, -3.0, 1.0], mean) / mean
    lags = np.arange(4 * mean)
    covariance = toeplitz(std**2 * a**lags) + WHITE_STD**2 * np.eye(4 * mean)
    expected = sqrt(mean * third @ covariance @ third / 20)
    assert expected > 1.5 * sqrt(std**2 + WHITE_STD**2)
    assert np.mean(found) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("rate_deg", [0.4, 5.0])
def test_neither_a_current_nor_an_error_of_the_speed_counts_as_noise(rate_deg: float) -> None:
    stats = stats_of(np.zeros(COUNT), 3, rate_deg=rate_deg, log_bias=0.5)
    assert position_noise(stats, "north", WHITE_STD) == WHITE_STD


def test_a_few_fixes_keep_their_noise() -> None:
    stats = stats_of(np.full(COUNT, np.nan), 0)
    north = np.full(COUNT, np.nan)
    north[::40] = np.arange(100) % 2 * 50.0  # one in twenty seconds: no means of several
    head = replace(stats.head, values=dict(stats.head.values) | {"north": north})
    assert position_noise(replace(stats, head=head), "north", 0.5) == 0.5


@pytest.mark.skipif(not CIRCLE.is_file(), reason="the SIMMAN data are not in ../shared/data/kvlcc2")
def test_the_gyro_bias_of_a_real_turning_circle_is_determined() -> None:
    """It is 0.0045 to 0.0058 deg/s in the free-running tests of the KVLCC2."""
    log = tanker_log(CIRCLE)
    settings = {"filter.kind": "extended", "filter.smooth": True, "filter.sensor_bias": "auto"}
    replay = Replay(log, plan_replay(log, settings=settings))
    for _ in replay.chunks():
        pass
    errors = {error.name: error for error in replay.findings.sensor_errors}
    gyro = errors["gyro"]
    assert gyro.determined
    assert errors["log"].determined
    half = 1.96 * np.degrees(gyro.std)
    assert half < 1e-3
    assert 0.0045 - half < np.degrees(gyro.value) < 0.0058 + half
