from dataclasses import replace
from math import radians

import numpy as np
import pytest

from recorders.simulated.sensors import Sensor, corrupt, delays, sample_times, suite
from shiplog import UsageError

N = 200_000


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def test_a_perfect_sensor_measures_the_true_values_at_its_rate() -> None:
    times = sample_times(Sensor(rate_hz=4.0), 10.0, rng())
    assert times == pytest.approx(np.arange(41) / 4)
    truth = np.sin(times)
    assert np.array_equal(corrupt(Sensor(), times, truth, rng()), truth)


def test_jitter_moves_the_instants_by_its_standard_deviation() -> None:
    times = sample_times(Sensor(rate_hz=10.0, jitter_secs=0.005), N / 10, rng())
    assert np.all(np.diff(times) > 0)
    moved = times - np.round(times * 10) / 10
    assert np.std(moved[1:-1]) == pytest.approx(0.005, rel=0.02)


@pytest.mark.parametrize(("fraction", "length"), [(0.05, 0.0), (0.2, 3.0), (0.08, 20.0)])
def test_dropouts_lose_the_given_fraction_in_gaps_of_the_given_length(
    fraction: float, length: float
) -> None:
    times = sample_times(Sensor(dropout=fraction, dropout_secs=length), N / 10, rng())
    assert 1 - len(times) / (N + 1) == pytest.approx(fraction, rel=0.1)
    holes = np.diff(times)
    assert holes[holes > 0.15].min() >= max(length, 0.1)


def test_white_noise_is_gaussian_of_its_standard_deviation_and_bias_of_its_size() -> None:
    sensor = Sensor(white=0.1, bias=0.5)
    noise = corrupt(sensor, np.arange(N) / 10.0, np.zeros(N), rng())
    assert np.mean(noise) == pytest.approx(0.5, abs=1e-3)
    assert np.std(noise) == pytest.approx(0.1, rel=0.01)
    assert np.mean(((noise - 0.5) / 0.1) ** 4) == pytest.approx(3.0, rel=0.03)


def test_the_papers_noise_follows_its_formulas() -> None:
    sensors = suite("paper", angle_unit="rad")
    times, truth = np.arange(N) / 10.0, np.full(N, 0.01)
    yaw = corrupt(sensors["yaw_rate"], times, truth, rng()) - 5e-5 * np.sin(times / 10)
    assert np.max(np.abs(yaw / truth - 1)) == pytest.approx(0.02, rel=1e-3)
    assert np.std(yaw / truth - 1) == pytest.approx(0.02 / np.sqrt(3), rel=0.01)
    speed = corrupt(sensors["speed"], times, np.full(N, 8.0), rng()) - 0.05 * np.sin(times / 10)
    assert np.max(np.abs(speed - 8)) == pytest.approx(0.2, rel=1e-3)
    assert np.std(speed) == pytest.approx(0.2 / np.sqrt(3), rel=0.01)


def test_the_papers_slow_error_is_in_the_angle_unit_of_its_table() -> None:
    assert suite("paper", angle_unit="rad")["yaw_rate"].wave == 5e-5
    assert suite("paper", angle_unit="deg")["yaw_rate"].wave == pytest.approx(radians(5e-5))


def test_samples_arrive_after_they_were_measured() -> None:
    late = delays(Sensor(delay_secs=0.02), N, rng())
    assert late.min() >= 0.2 * 0.02 - 1e-6
    assert late.max() <= 0.02


def test_a_position_has_noise_in_both_components() -> None:
    noise = corrupt(Sensor(white=1.0), np.arange(N) / 10.0, np.zeros((N, 2)), rng())
    assert np.std(noise, axis=0) == pytest.approx([1, 1], rel=0.02)
    assert abs(np.corrcoef(noise.T)[0, 1]) < 0.01


@pytest.mark.parametrize("fraction", [0.001, 0.05, 1.0])
def test_spikes_have_the_given_fraction_and_size_and_both_signs(fraction: float) -> None:
    sensor = Sensor(spikes=fraction, spike_size=0.05)
    noise = corrupt(sensor, np.arange(N) / 10.0, np.zeros(N), rng())
    hit = noise[noise != 0]
    assert len(hit) / N == pytest.approx(fraction, rel=4 / np.sqrt(fraction * N))
    assert set(hit) == {-0.05, 0.05}
    assert np.mean(hit > 0) == pytest.approx(0.5, abs=2 / np.sqrt(len(hit)))


def test_spikes_are_independent_of_each_other() -> None:
    sensor = Sensor(spikes=0.05, spike_size=1.0)
    hit = corrupt(sensor, np.arange(N) / 10.0, np.zeros(N), rng()) != 0
    assert abs(np.corrcoef(hit[1:], hit[:-1])[0, 1]) < 4 / np.sqrt(N)


@pytest.mark.parametrize("shape", [(N,), (N, 2)])
def test_spikes_leave_the_other_noise_unchanged(shape: tuple[int, ...]) -> None:
    plain = Sensor(white=0.1, uniform=0.2)
    spiky = replace(plain, spikes=0.01, spike_size=3.0)
    times, truth, one, other = np.arange(N) / 10.0, np.zeros(shape), rng(), rng()
    away = corrupt(spiky, times, truth, one) - corrupt(plain, times, truth, other)
    assert sorted(set(np.round(away, 9).ravel())) == [-3, 0, 3]
    assert np.array_equal(delays(spiky, N, one), delays(plain, N, other))


def test_a_spike_size_without_a_fraction_changes_nothing() -> None:
    times, truth = np.arange(N) / 10.0, np.zeros(N)
    sized = suite("white", {"yaw_rate.spikes": 0.0, "yaw_rate.spike_size": 0.05})["yaw_rate"]
    plain = suite("white")["yaw_rate"]
    assert np.array_equal(corrupt(sized, times, truth, rng()), corrupt(plain, times, truth, rng()))


def test_a_spike_of_a_position_has_all_components() -> None:
    sensor = Sensor(spikes=0.02, spike_size=30.0)
    noise = corrupt(sensor, np.arange(N) / 10.0, np.zeros((N, 2)), rng())
    hit = noise != 0
    assert np.array_equal(hit[:, 0], hit[:, 1])
    assert np.mean(hit[:, 0]) == pytest.approx(0.02, rel=0.07)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"yawrate.bias": 1.0}, "no sensor 'yawrate'; did you mean 'yaw_rate'"),
        ({"yaw_rate.bais": 1.0}, "no 'bais'; did you mean 'bias'"),
        ({"yaw_rate.rate_hz": 0.0}, "must be positive"),
        ({"yaw_rate.white": -1.0}, "not negative"),
        ({"yaw_rate.bias": float("nan")}, "must be finite"),
        ({"yaw_rate.dropout": 1.0}, "a fraction, below 1"),
        ({"yaw_rate.spikes": 1.01, "yaw_rate.spike_size": 1.0}, "a fraction, at most 1"),
        ({"yaw_rate.spikes": -0.1, "yaw_rate.spike_size": 1.0}, "not negative"),
        ({"yaw_rate.spikes": 0.1, "yaw_rate.spike_size": -1.0}, "not negative"),
        ({"yaw_rate.spikes": 0.1, "yaw_rate.spike_size": float("inf")}, "must be finite"),
        ({"yaw_rate.spikes": 0.1}, "no size; give yaw_rate.spike_size"),
    ],
)
def test_an_invalid_setting_is_refused(settings: dict[str, float], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        suite("paper", settings)


def test_sway_is_measured_where_a_setting_names_it() -> None:
    assert "sway" not in suite("paper")
    assert suite("paper", {"sway.white": 0.05, "sway.rate_hz": 2.0})["sway"] == Sensor(
        rate_hz=2.0, white=0.05
    )
    with pytest.raises(UsageError, match="a sensor has no 'noise'"):
        suite("paper", {"sway.noise": 1.0})


def test_an_unknown_suite_is_refused() -> None:
    with pytest.raises(UsageError, match="did you mean 'paper'"):
        suite("papers")
