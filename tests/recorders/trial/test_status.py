"""Tests of recorders.trial.status: rates, last values, and alarms of silent channels."""

import numpy as np
import pytest

from recorders.trial.status import TrialStatus
from shiplog.types import Channel, Event

SECOND = 10**9


def _samples(name: str, start_secs: float, count: int, rate_hz: float = 10.0) -> Channel:
    times = np.round((start_secs + np.arange(count) / rate_hz) * SECOND).astype(np.int64)
    return Channel(name, "TI", "rad/s", times, times, np.arange(count, dtype=float))


def test_a_channel_has_its_rate_last_value_and_count() -> None:
    status = TrialStatus(0)
    status.add([_samples("yaw_rate", 0.0, 30), _samples("yaw_rate", 3.0, 30)])
    (channel,) = status.channels
    assert channel.samples == 60
    assert channel.rate_hz == pytest.approx(10.0)
    assert channel.last_value == (29.0,)
    assert channel.topic == "/yaw_rate/TI"
    assert status.missing == ["speed", "rudder", "rpm"]


def test_a_channel_that_goes_silent_and_comes_back_is_reported_once_each() -> None:
    status = TrialStatus(0)
    status.add([_samples("yaw_rate", 0.0, 30)])
    assert status.alarms(4 * SECOND) == []
    texts = [event.text for event in status.alarms(7 * SECOND)]
    assert texts == ["/yaw_rate/TI has been silent for 4.1 s"]
    assert status.alarms(8 * SECOND) == []
    status.add([_samples("yaw_rate", 9.0, 5)])
    assert [event.text for event in status.alarms(9 * SECOND + SECOND // 2)] == [
        "/yaw_rate/TI is heard again"
    ]


def test_a_slow_channel_is_not_silent_between_its_samples() -> None:
    status = TrialStatus(0)
    status.add([_samples("speed", 0.0, 10, rate_hz=0.5)])
    assert [e.text for e in status.alarms(30 * SECOND) if "silent" in e.text] == []
    assert [e.text for e in status.alarms(40 * SECOND) if "silent" in e.text] == [
        "/speed/TI has been silent for 22.0 s"
    ]


def test_needed_channels_that_were_never_heard_are_reported_once_after_ten_seconds() -> None:
    status = TrialStatus(0)
    status.add([_samples("yaw_rate", 0.0, 105)])
    assert status.alarms(9 * SECOND) == []
    assert [event.text for event in status.alarms(10 * SECOND + 1)] == [
        "nothing heard of speed in 10 s",
        "nothing heard of rudder in 10 s",
        "nothing heard of rpm in 10 s",
    ]
    assert status.alarms(11 * SECOND) == []


def test_events_are_counted() -> None:
    status = TrialStatus(0)
    status.add([Event(0, "execute")])
    assert status.events == 1


def test_a_channel_of_few_samples_that_goes_silent_is_reported_after_a_minute() -> None:
    status = TrialStatus(0)
    status.add([_samples("rudder", 0.0, 1)])
    assert [e.text for e in status.alarms(59 * SECOND) if "silent" in e.text] == []
    assert [e.text for e in status.alarms(61 * SECOND) if "silent" in e.text] == [
        "/rudder/TI has been silent for 61.0 s"
    ]


def test_a_needed_channel_that_has_only_invalid_values_is_missing() -> None:
    status = TrialStatus(0)
    times = np.arange(3) * SECOND
    status.add([Channel("rudder", "TI", "rad", times, times, np.full(3, np.nan))])
    assert "rudder" in status.missing
    status.add([Channel("rudder", "TI", "rad", times, times, np.zeros(3))])
    assert "rudder" not in status.missing


def test_the_last_mark_is_that_of_a_person() -> None:
    status = TrialStatus(0)
    status.add([Event(0, "execute"), Event(1, "gap", "gyro")])
    assert status.last_mark == Event(0, "execute")
