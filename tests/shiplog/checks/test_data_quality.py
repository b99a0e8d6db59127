"""Defects of channels give a warning or an error; good data give none."""

import numpy as np
import pytest
from channels import START, Values, channel

from shiplog.checks.data_quality import data_warnings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.errors import LogError
from shiplog.types import Channel, TrialLog

RNG = np.random.default_rng(20)


def noise(count: int = 600, std: float = 0.01) -> Values:
    return RNG.normal(0, std, count)


def warnings_of(*channels: Channel, names: tuple[str, ...] = ()) -> list[str]:
    stats = compute_log_stats(TrialLog("trial.mcap", channels))
    return data_warnings(stats, names or tuple(c.name for c in channels))


def error_of(channel: Channel) -> str:
    with pytest.raises(LogError) as caught:
        warnings_of(channel)
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(": trial.mcap")
    return message


def test_good_channels_give_no_warning() -> None:
    steady = np.full(600, 0.3)
    assert (
        warnings_of(channel(noise()), channel(steady, name="rudder"), channel(steady, name="rpm"))
        == []
    )


def test_only_the_named_channels_are_checked() -> None:
    channels = channel(noise()), channel(noise(), name="speed", lag=-1.0)
    assert warnings_of(*channels, names=("yaw_rate",)) == []
    assert len(warnings_of(*channels, names=("speed/a",))) == 1


def test_a_missing_channel_is_an_error() -> None:
    with pytest.raises(LogError, match="no channel 'speed'"):
        warnings_of(channel(noise()), names=("speed",))


def test_gaps_are_counted_and_the_longest_is_located() -> None:
    times = 0.1 * np.arange(600)
    times[200:] += 3
    times[400:] += 12
    assert warnings_of(channel(noise(), times)) == [
        (
            "/yaw_rate/a: 2 gaps, the longest 12.1 s, 42.9 s after its start; samples were lost: "
            "check the sensor and its connection"
        )
    ]


def test_equal_times_are_counted() -> None:
    times = 0.1 * np.arange(600)
    times[[10, 11]] = times[9]
    (warning,) = warnings_of(channel(noise(), times))
    assert warning.startswith("/yaw_rate/a: 2 samples with the same time as the one before; ")


def test_missing_samples_are_counted() -> None:
    values = noise()
    values[30:36] = np.nan
    assert warnings_of(channel(values)) == [
        (
            "/yaw_rate/a: 6 samples (1.0 %) not measured (NaN); "
            "the sensor gave no value: check it if that is unexpected"
        )
    ]


def test_a_channel_without_samples_gives_a_warning() -> None:
    assert warnings_of(channel(np.zeros(0))) == [
        "/yaw_rate/a: no samples; check that the sensor was connected and switched on"
    ]


def test_a_channel_of_nan_only_is_not_stuck() -> None:
    (warning,) = warnings_of(channel(np.full(600, np.nan)))
    assert warning.startswith("/yaw_rate/a: 600 samples (100.0 %) not measured (NaN); ")


def test_a_value_that_does_not_change_is_stuck() -> None:
    values = noise()
    values[100:300] = np.radians(0.5)
    assert warnings_of(channel(values)) == [
        (
            "/yaw_rate/a: stuck once, longest at 0.5 deg/s for 19.9 s, 10.0 s after its start; the "
            "sensor froze: check it, and set these values to nan in a CSV of the log"
        )
    ]


def test_a_commanded_channel_may_be_constant() -> None:
    values = noise()
    values[100:300] = 0.2
    assert warnings_of(channel(values, name="rudder"), channel(values, name="rpm")) == []


@pytest.mark.parametrize(("secs", "reported"), [(1, False), (4, False), (10, True)])
def test_a_rudder_with_unknown_movements_between_its_samples_is_reported(
    secs: int, reported: bool
) -> None:
    stamps = START + 10**9 * secs * np.arange(100)
    angles = np.radians(20.0) * np.sin(np.arange(100.0))
    rudder = Channel("rudder", "a", "rad", stamps, stamps, angles)
    expected = [f"/rudder/a: sampled every {secs} s"] if reported else []
    assert [text.split(",")[0] for text in warnings_of(rudder)] == expected


def test_a_short_run_and_a_constant_channel_are_not_stuck() -> None:
    values = noise()
    values[100:140] = 0.0
    assert warnings_of(channel(values), channel(np.zeros(600), name="speed")) == []


@pytest.mark.parametrize("digit", [0.001, 0.01, 0.05])
def test_values_of_few_digits_at_the_crest_of_a_slow_wave_are_not_stuck(digit: float) -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / digit) * digit
    assert warnings_of(channel(values)) == []


def test_a_sensor_of_few_digits_that_freezes_is_stuck() -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / 0.001) * 0.001
    values[4000:6000] = values[4000]
    assert "stuck once" in warnings_of(channel(values))[0]


def test_a_position_that_does_not_change_is_stuck() -> None:
    stamps = START + 10**8 * np.arange(600)
    places = np.cumsum(RNG.normal(0.5, 0.1, (600, 2)), axis=0)
    places[100:300] = places[100]
    gps = Channel("position", "gps", "m", stamps, stamps, places, ("north", "east"))
    (warning,) = warnings_of(gps)
    assert warning.startswith("/position/gps: stuck once")


def test_impossible_values_are_reported_in_display_units() -> None:
    values = noise()
    values[5], values[6] = 2.0, -3.0
    assert warnings_of(channel(values)) == [
        (
            "/yaw_rate/a: 2 impossible values, the worst -171.9 deg/s; possible are -57.3 deg/s to "
            "57.3 deg/s: not used; check the unit in the layout and the sensor"
        )
    ]


def test_a_latitude_beyond_the_pole_is_impossible() -> None:
    stamps = START + 10**8 * np.arange(3)
    fixes = np.array([[59.0, 24, np.nan], [95, 24, np.nan], [59, 24.0001, 1]])
    fields = ("latitude", "longitude", "altitude")
    gps = Channel("position", "gps", "deg", stamps, stamps, fixes, fields)
    (warning,) = warnings_of(gps)
    assert warning.startswith(
        "/position/gps: 1 fix at an impossible position (1 at latitude 95, longitude 24), "
        "the first 0.1 s after its start"
    )


def test_values_that_are_not_available_do_not_make_a_channel_irregular() -> None:
    values = noise()
    values[::5] = np.radians(511.0)
    heading = channel(values, name="heading")
    cleaned = compute_log_stats(TrialLog("trial.mcap", (heading,)), strict=True)
    warnings = data_warnings(cleaned, ("heading",))
    assert any("511" in warning for warning in warnings), warnings
    assert not any("irregular" in warning for warning in warnings), warnings


def test_irregular_sampling_gives_a_warning_and_jitter_does_not() -> None:
    irregular = np.cumsum(np.where(np.arange(600) % 3, 0.1, 0.4))
    (warning,) = warnings_of(channel(noise(), irregular))
    assert warning.startswith("/yaw_rate/a: irregular sampling: 33 % of the intervals differ by")
    assert "(percentiles 1 and 99: 0.1 and 0.4 s)" in warning
    jitter = 0.1 * np.arange(600) + RNG.uniform(-0.02, 0.02, 600)
    assert warnings_of(channel(noise(), jitter)) == []


def test_samples_received_before_being_measured_give_a_warning() -> None:
    (warning,) = warnings_of(channel(noise(), lag=-0.25))
    assert "600 samples received before being measured, by up to 0.25 s" in warning
    assert warnings_of(channel(noise(), lag=0.25)) == []


def test_an_infinite_value_is_an_error_with_location_and_remedy() -> None:
    values = noise()
    values[[50, 70]] = np.inf, -np.inf
    message = error_of(channel(values))
    assert "/yaw_rate/a has 2 infinite values, the first 5.000 s after its start" in message
    assert "replace them by nan" in message


def test_times_that_run_backwards_are_an_error_with_the_remedy() -> None:
    times = 0.1 * np.arange(600)
    times[[100, 200]] -= 0.35
    message = error_of(channel(noise(), times))
    assert (
        "/yaw_rate/a has measured times that run backwards 2 times, first by 0.250 s, 9.900 s after"
        in message
    )
    assert "`shiplog convert IN.mcap OUT.mcap` sorts them" in message


def test_a_defect_that_channels_share_is_one_warning() -> None:
    times = np.repeat(np.arange(60.0), 5)
    rng = np.random.default_rng(1)
    channels = [
        channel(0.01 * rng.standard_normal(300), times, name=name) for name in ("yaw_rate", "speed")
    ]
    (warning,) = data_warnings(
        compute_log_stats(TrialLog("trial.mcap", tuple(channels))), ("yaw_rate", "speed")
    )
    assert warning.startswith("/yaw_rate/a, /speed/a: 240 samples with the same time")
