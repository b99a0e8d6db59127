"""What is wrong with data must be said; what is right must be passed over in silence."""

import numpy as np
import pytest
from channels import START, Values, channel

from shiplog.checks.data_quality import examine
from shiplog.errors import LogError
from shiplog.types import Channel, TrialLog

RNG = np.random.default_rng(20)


def noise(count: int = 600, std: float = 0.01) -> Values:
    return RNG.normal(0, std, count)


def said(*channels: Channel) -> list[str]:
    log = TrialLog("trial.mcap", channels)
    return examine(log, tuple(c.name for c in channels))


def error(its: Channel) -> str:
    with pytest.raises(LogError) as caught:
        said(its)
    message = str(caught.value)
    assert "\n" not in message
    assert message.endswith(": trial.mcap")
    return message


def test_good_channels_are_passed_over() -> None:
    steady = np.full(600, 0.3)
    assert said(channel(noise()), channel(steady, name="rudder"), channel(steady, name="rpm")) == []


def test_only_what_is_asked_for_is_examined() -> None:
    bad = channel(noise(), name="speed", lag=-1.0)
    log = TrialLog("trial.mcap", (channel(noise()), bad))
    assert examine(log, ("yaw_rate",)) == []
    assert len(examine(log, ("speed/a",))) == 1


def test_a_missing_channel_is_an_error() -> None:
    with pytest.raises(LogError, match="no channel 'speed'"):
        examine(TrialLog("trial.mcap", (channel(noise()),)), ("speed",))


def test_gaps_are_counted_and_the_longest_is_placed() -> None:
    times = 0.1 * np.arange(600)
    times[200:] += 3
    times[400:] += 12
    assert said(channel(noise(), times)) == [
        "/yaw_rate/a: 2 gaps, the longest 12.1 s, 42.9 s after its start"
    ]


def test_equal_times_are_counted() -> None:
    times = 0.1 * np.arange(600)
    times[[10, 11]] = times[9]
    assert "/yaw_rate/a: 2 samples with the time of the one before" in said(channel(noise(), times))


def test_samples_not_measured_are_counted() -> None:
    values = noise()
    values[30:36] = np.nan
    assert said(channel(values)) == ["/yaw_rate/a: 6 samples (1.0 %) not measured (NaN)"]


def test_a_channel_without_samples_is_said_so() -> None:
    assert said(channel(np.zeros(0))) == ["/yaw_rate/a: no samples"]


def test_a_channel_of_nan_alone_is_no_stuck_one() -> None:
    assert said(channel(np.full(600, np.nan))) == [
        "/yaw_rate/a: 600 samples (100.0 %) not measured (NaN)"
    ]


def test_a_value_that_stands_still_is_stuck() -> None:
    values = noise()
    values[100:300] = np.radians(0.5)
    assert said(channel(values)) == [
        "/yaw_rate/a: stuck once, longest at 0.5 deg/s for 19.9 s, 10.0 s after its start"
    ]


def test_a_commanded_channel_may_stand_still() -> None:
    values = noise()
    values[100:300] = 0.2
    assert said(channel(values, name="rudder"), channel(values, name="rpm")) == []


def test_a_short_standstill_or_a_channel_that_never_varies_is_not_called_stuck() -> None:
    values = noise()
    values[100:140] = 0.0
    assert said(channel(values), channel(np.zeros(600), name="speed")) == []


@pytest.mark.parametrize("digit", [0.001, 0.01, 0.05])
def test_a_coarse_print_at_the_crest_of_a_slow_wave_is_not_stuck(digit: float) -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / digit) * digit
    assert said(channel(values)) == []


def test_a_sensor_that_prints_coarsely_and_freezes_is_stuck() -> None:
    times = np.arange(0, 900, 0.1)
    values = np.round(0.3 * np.sin(times / 30) / 0.001) * 0.001
    values[4000:6000] = values[4000]
    assert "stuck once" in said(channel(values))[0]


def test_a_position_that_stands_still_is_stuck() -> None:
    stamps = START + 10**8 * np.arange(600)
    places = np.cumsum(RNG.normal(0.5, 0.1, (600, 2)), axis=0)
    places[100:300] = places[100]
    gps = Channel("position", "gps", "m", stamps, stamps, places, ("north", "east"))
    (fault,) = examine(TrialLog("trial.mcap", (gps,)), ("position",))
    assert fault.startswith("/position/gps: stuck once")


def test_impossible_values_are_told_in_the_unit_of_the_bridge() -> None:
    values = noise()
    values[5], values[6] = 2.0, -3.0
    assert said(channel(values)) == [
        (
            "/yaw_rate/a: 2 impossible values, such as -171.9 deg/s; "
            "between -57.3 deg/s and 57.3 deg/s is possible"
        )
    ]


def test_a_latitude_beyond_the_pole_is_impossible() -> None:
    stamps = START + 10**8 * np.arange(3)
    fixes = np.array([[59.0, 24, np.nan], [95, 24, np.nan], [59, 190, 1]])
    fields = ("latitude", "longitude", "altitude")
    gps = Channel("position", "gps", "deg", stamps, stamps, fixes, fields)
    assert examine(TrialLog("t", (gps,)), ("position",)) == [
        "/position/gps: 2 impossible positions, beyond 90 or 180 deg"
    ]


def test_an_irregular_rate_is_told_and_jitter_is_not() -> None:
    irregular = np.cumsum(np.where(np.arange(600) % 3, 0.1, 0.4))
    (fault,) = said(channel(noise(), irregular))
    assert fault.startswith("/yaw_rate/a: irregular: 33 % of its intervals")
    jitter = 0.1 * np.arange(600) + RNG.uniform(-0.02, 0.02, 600)
    assert said(channel(noise(), jitter)) == []


def test_what_was_received_before_it_was_measured_is_told() -> None:
    (fault,) = said(channel(noise(), lag=-0.25))
    assert "600 samples received before measured, by up to 0.25 s" in fault
    assert said(channel(noise(), lag=0.25)) == []


def test_an_infinite_value_is_an_error_with_place_and_remedy() -> None:
    values = noise()
    values[[50, 70]] = np.inf, -np.inf
    message = error(channel(values))
    assert "/yaw_rate/a has 2 infinite values, the first 5.000 s after its start" in message
    assert "make it nan" in message


def test_times_that_run_backwards_are_an_error_with_the_remedy() -> None:
    times = 0.1 * np.arange(600)
    times[[100, 200]] -= 0.35
    message = error(channel(noise(), times))
    assert "/yaw_rate/a run backwards 2 times, first by 0.250 s, 9.900 s after" in message
    assert "`shiplog convert IN.mcap OUT.mcap` sorts them" in message
