import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shiplog import Channel, LogError, Signals, TrialLog, write
from shiplog.checks.log_stats import compute_log_stats
from shiplog.mcap.stream import LogFile, open_log
from shiplog.types import ReadOnlyMapping, concatenate_signals, read_only


def by_pickle(original: object) -> object:
    return pickle.loads(pickle.dumps(original))  # noqa: S301 - our own bytes


COPIES = pytest.mark.parametrize("copied", [by_pickle, copy.deepcopy, copy.copy])
Copy = Callable[[Any], Any]


def channel(name: str = "yaw_rate", source: str = "gyro", count: int = 3) -> Channel:
    times = np.arange(count) * 1_000_000_000
    values = np.linspace(0.0, 1.0, count)
    return Channel(name, source, "rad/s", times, times + 5, values, metadata={"model": "A"})


def assert_same(copied: Channel, original: Channel) -> None:
    for name in ("name", "source", "unit", "fields"):
        assert getattr(copied, name) == getattr(original, name)
    assert dict(copied.metadata) == dict(original.metadata)
    for name in ("measured_ns", "received_ns", "values"):
        array = getattr(copied, name)
        np.testing.assert_array_equal(array, getattr(original, name))
        assert not array.flags.writeable
        assert array.dtype == getattr(original, name).dtype
    with pytest.raises(TypeError):
        copied.metadata["model"] = "B"  # type: ignore[index]


# -- copies


@COPIES
def test_a_copied_channel_is_equal_and_read_only(copied: Copy) -> None:
    assert_same(copied(channel()), channel())


@COPIES
def test_a_copied_channel_of_a_part_is_equal_and_read_only(copied: Copy) -> None:
    times = np.arange(9)
    fixes = Channel("position", "gnss", "m", times, times, np.ones((9, 2)), ("north", "east"))
    assert_same(copied(fixes.part(2, 5)), fixes.part(2, 5))


@COPIES
def test_a_copied_log_is_equal_and_read_only(copied: Copy) -> None:
    log = TrialLog("trial", (channel(), channel("speed")), {"place": "Neva"}, "T1 = 1", ("w",))
    again = copied(log)
    assert (again.name, again.vessel_toml, again.warnings) == ("trial", "T1 = 1", ("w",))
    assert again.metadata == {"place": "Neva"}
    with pytest.raises(TypeError):
        again.metadata["place"] = "Volga"
    for one, other in zip(again, log, strict=True):
        assert_same(one, other)


@COPIES
def test_copied_signals_are_equal_and_read_only(copied: Copy) -> None:
    signals = Signals(100, 0.5, {"speed": np.array([1.0, np.nan]), "rpm": np.zeros(2)}, 7)
    again = copied(signals)
    assert (again.start_ns, again.dt_secs, again.first) == (100, 0.5, 7)
    assert list(again) == list(signals)
    for name in signals:
        np.testing.assert_array_equal(again[name], signals[name])
        assert not again[name].flags.writeable
    with pytest.raises(TypeError):
        again.values["speed"] = np.zeros(2)


@COPIES
def test_a_copied_log_file_yields_the_same_samples(
    copied: Copy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(TrialLog("t", (channel(count=50),), {"place": "Neva"}), tmp_path / "trial.mcap")
    monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 10)
    log = open_log(tmp_path / "trial.mcap")
    assert isinstance(log, LogFile)
    again = copied(log)
    assert again.metadata == log.metadata
    for ours, theirs in zip(again.chunks(), log.chunks(), strict=True):
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)


# -- read-only data


def test_a_channel_is_read_only_and_leaves_the_callers_arrays_writeable() -> None:
    times, values = np.arange(3), np.zeros(3)
    held = Channel("speed", "log", "m/s", times, times, values)
    for array in (held.values, held.measured_ns, held.received_ns):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    values[0] = times[0] = 7
    assert held.values[0] == 7


def test_read_only_returns_a_view_and_not_a_copy() -> None:
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


def test_a_read_only_mapping_behaves_as_the_dict_it_was_made_of() -> None:
    mapping = ReadOnlyMapping({"a": 1, "b": 2})
    assert mapping == {"a": 1, "b": 2}
    assert (list(mapping), len(mapping), "b" in mapping, mapping.get("c")) == (
        ["a", "b"],
        2,
        True,
        None,
    )
    assert repr(mapping) == "{'a': 1, 'b': 2}"


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
def test_shapes_that_do_not_agree_are_rejected_with_the_topic(
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


def test_the_repr_of_a_channel_is_short() -> None:
    assert repr(channel()) == "Channel(/yaw_rate/gyro [rad/s], 3 samples)"


# -- logs as collections of channels


def test_a_log_returns_the_first_source_or_the_one_requested() -> None:
    first, second = channel(source="gyro"), channel(source="imu")
    log = TrialLog("trial", (first, second))
    assert log["yaw_rate"] is first
    assert log["yaw_rate/imu"] is second
    assert log["/yaw_rate/imu"] is second
    assert "yaw_rate/imu" in log
    assert "yaw_rate/compass" not in log
    assert log.get("speed") is None
    assert list(log) == [first, second]


def test_iteration_length_and_membership_of_a_log_agree() -> None:
    log = TrialLog("trial", (channel(), channel("speed"), channel("yaw_rate", "imu")))
    for collection in (log, compute_log_stats(log)):
        assert len(collection) == len(list(collection)) == 3
        for each in collection:
            assert each in collection
            assert each.name in collection
            assert f"{each.name}/{each.source}" in collection
    assert channel() not in log
    assert "rudder" not in log
    assert None not in log
    assert len(TrialLog("empty", ())) == 0


def test_a_missing_channel_is_reported_with_those_present_and_the_nearest() -> None:
    with pytest.raises(LogError) as caught:
        TrialLog("zigzag.mcap", (channel(), channel("rudder")))["yawrate"]
    assert str(caught.value) == (
        "no channel 'yawrate' in zigzag.mcap; it has rudder, yaw_rate; did you mean 'yaw_rate'?"
    )
    with pytest.raises(LogError, match="it has none"):
        TrialLog("empty.mcap", ())["speed"]


def test_the_span_covers_all_times_of_measurement() -> None:
    late = Channel("speed", "log", "m/s", [9_000_000_000, 4], [0, 0], [1.0, 2.0])  # type: ignore[arg-type]
    log = TrialLog("trial", (channel(), late, channel("rudder", count=0)))
    assert log.span_ns == (0, 9_000_000_000)
    assert log.duration_secs == pytest.approx(9)
    assert TrialLog("trial", ()).span_ns == (0, 0)
    assert TrialLog("trial", ()).duration_secs == 0


# -- signals


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


def test_signals_count_samples_and_iterate_over_channel_names_as_a_data_frame_does() -> None:
    signals = Signals(0, 0.5, {"speed": np.zeros(4), "rpm": np.ones(4)})
    assert len(signals) == 4
    assert list(signals) == ["speed", "rpm"]
    assert all(name in signals for name in signals)
    assert len(Signals(0, 0.5, {})) == 0


def test_parts_of_signals_joined_again_are_the_signals() -> None:
    signals = Signals(100, 0.5, {"speed": np.arange(9.0)}, 3)
    again = concatenate_signals([signals.part(0, 4), signals.part(4, 5), signals.part(5, 9)])
    assert (again.start_ns, again.first) == (100, 3)
    np.testing.assert_array_equal(again["speed"], signals["speed"])
