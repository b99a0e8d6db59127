import numpy as np
import pytest

from shiplog import Channel, LogError, Signals, TrialLog
from shiplog.types import read_only


def channel(name: str = "yaw_rate", source: str = "gyro", count: int = 3) -> Channel:
    times = np.arange(count) * 1_000_000_000
    return Channel(name, source, "rad/s", times, times + 5, np.linspace(0.0, 1.0, count))


def test_a_channel_is_read_only_and_leaves_the_callers_arrays_writeable() -> None:
    times, values = np.arange(3), np.zeros(3)
    held = Channel("speed", "log", "m/s", times, times, values)
    for array in (held.values, held.measured_ns, held.received_ns):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    values[0] = times[0] = 7
    assert held.values[0] == 7


def test_frozen_views_and_does_not_copy() -> None:
    array = np.zeros(3)
    assert np.shares_memory(read_only(array, np.float64), array)
    assert read_only([1, 2], np.float64).dtype == np.float64


def test_a_channels_metadata_is_its_own_and_read_only() -> None:
    given = {"model": "A"}
    held = Channel("speed", "log", "m/s", [0], [0], [1.0], metadata=given)  # type: ignore[arg-type]
    given["model"] = "B"
    assert held.metadata["model"] == "A"
    with pytest.raises(TypeError):
        held.metadata["model"] = "C"  # type: ignore[index]


@pytest.mark.parametrize(
    ("measured", "received", "values", "fields"),
    [
        ([0, 1], [0, 1], [1.0], ()),
        ([0, 1], [0], [1.0, 2.0], ()),
        ([0, 1], [0, 1], [[1.0, 2.0], [3.0, 4.0]], ()),
        ([0, 1], [0, 1], [1.0, 2.0], ("north", "east")),
        ([0, 1], [0, 1], [[1.0], [2.0]], ("north", "east")),
    ],
)
def test_shapes_that_do_not_fit_are_refused_by_topic(
    measured: list[int], received: list[int], values: list[object], fields: tuple[str, ...]
) -> None:
    with pytest.raises(ValueError, match="/position/gnss: values"):
        Channel(
            "position",
            "gnss",
            "m",
            np.array(measured),
            np.array(received),
            np.array(values),
            fields,
        )


def test_a_channel_shows_what_it_is_and_not_all_it_holds() -> None:
    assert repr(channel()) == "Channel(/yaw_rate/gyro [rad/s], 3 samples)"


def test_a_log_finds_the_first_source_or_the_one_asked_for() -> None:
    first, second = channel(source="gyro"), channel(source="imu")
    log = TrialLog("trial", (first, second))
    assert log["yaw_rate"] is first
    assert log["yaw_rate/imu"] is second
    assert log["/yaw_rate/imu"] is second
    assert "yaw_rate/imu" in log
    assert "yaw_rate/compass" not in log
    assert log.get("speed") is None
    assert list(log) == [first, second]


def test_a_missing_channel_is_named_with_those_there_and_the_nearest() -> None:
    with pytest.raises(LogError) as caught:
        TrialLog("zigzag.mcap", (channel(), channel("rudder")))["yawrate"]
    assert str(caught.value) == (
        "no channel 'yawrate' in zigzag.mcap; it has rudder, yaw_rate; did you mean 'yaw_rate'?"
    )
    with pytest.raises(LogError, match="it has none"):
        TrialLog("empty.mcap", ())["speed"]


def test_the_span_is_over_all_that_was_measured() -> None:
    late = Channel("speed", "log", "m/s", [9_000_000_000, 4], [0, 0], [1.0, 2.0])  # type: ignore[arg-type]
    log = TrialLog("trial", (channel(), late, channel("rudder", count=0)))
    assert log.span_ns == (0, 9_000_000_000)
    assert log.duration_secs == pytest.approx(9)
    assert TrialLog("trial", ()).span_ns == (0, 0)
    assert TrialLog("trial", ()).duration_secs == 0


def test_signals_are_read_only_on_one_clock() -> None:
    values = np.zeros(4)
    signals = Signals(100, 0.5, {"speed": values})
    assert len(signals) == 4
    assert "speed" in signals
    assert "rudder" not in signals
    np.testing.assert_array_equal(signals.time_secs, [0, 0.5, 1, 1.5])
    np.testing.assert_array_equal(
        signals.timestamps_ns, [100, 500_000_100, 1_000_000_100, 1_500_000_100]
    )
    with pytest.raises(ValueError, match="read-only"):
        signals["speed"][0] = 1
    values[0] = 1
    assert signals["speed"][0] == 1
