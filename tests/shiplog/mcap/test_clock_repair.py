"""Tests of the repair of messages' times, on files written message by message."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from mcap_files import scalar

import shiplog.mcap.stream
from shiplog import LogError, TrialLog
from shiplog.checks.info import read_log_info
from shiplog.mcap.messages import descriptor_set
from shiplog.mcap.reader import read
from shiplog.mcap.schema import schema_for
from shiplog.mcap.stream import LogFile, open_log
from shiplog.mcap.writer import write
from shiplog.types import concatenate_channels

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
NAMES = ("yaw_rate", "rudder")
Clock = Callable[[str, int], int]


def unchanged(_name: str, time_ns: int) -> int:
    return time_ns


def record(
    path: Path,
    received: Clock = unchanged,
    measured: Clock = unchanged,
    restart_secs: float = 100.0,
) -> Path:
    """Write 100 s of two channels at 2 Hz whose values are the true times, in s.

    From the restart on, the channels have other ids.
    """
    schema = schema_for(())
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2000)
        writer.start()
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        unit = {"yaw_rate": "rad/s", "rudder": "rad"}
        ids = [
            {
                name: writer.register_channel(
                    f"/{name}/test", "protobuf", schema_id, {"unit": unit[name]}
                )
                for name in NAMES
            }
            for _ in range(2)
        ]
        for row in range(200):
            time = row * SECOND // 2
            for name in NAMES:
                data = scalar(time / SECOND)
                times = START + received(name, time), START + measured(name, time)
                part = int(time >= restart_secs * SECOND)
                writer.add_message(ids[part][name], times[0] % 2**64, data, times[1] % 2**64)
        writer.finish()
    return path


def set_back(_name: str, time_ns: int) -> int:
    return time_ns - (time_ns >= 50 * SECOND) * 5_250_000_000


def test_an_undisturbed_file_gives_no_warning(tmp_path: Path) -> None:
    assert read(record(tmp_path / "log.mcap")).warnings == ()


def test_a_clock_set_back_is_repaired_and_reported(tmp_path: Path) -> None:
    log = read(record(tmp_path / "log.mcap", set_back, set_back))
    (warning,) = log.warnings
    assert "set back by 5.250 s" in warning
    assert "49.5 s after the start" in warning
    for channel in log:
        np.testing.assert_allclose((channel.measured_ns - START) / SECOND, channel.values)
        np.testing.assert_array_equal(channel.measured_ns, channel.received_ns)


def test_a_clock_of_reception_set_back_keeps_the_measured_times(tmp_path: Path) -> None:
    log = read(record(tmp_path / "log.mcap", received=set_back))
    assert len(log.warnings) == 1
    for channel in log:
        np.testing.assert_allclose((channel.measured_ns - START) / SECOND, channel.values)
        np.testing.assert_array_equal(channel.measured_ns, channel.received_ns)


def test_the_clock_of_one_sensor_set_back_is_repaired_from_reception(tmp_path: Path) -> None:
    def one_sensor(name: str, time_ns: int) -> int:
        return set_back(name, time_ns) if name == "rudder" else time_ns

    log = read(record(tmp_path / "log.mcap", measured=one_sensor))
    (warning,) = log.warnings
    assert warning.startswith("/rudder/test: the clock of the sensor was set back by 5.250 s")
    np.testing.assert_array_equal(log["rudder"].measured_ns, log["rudder"].received_ns)


def test_a_step_of_one_channel_in_both_clocks_is_refused(tmp_path: Path) -> None:
    def one_channel(name: str, time_ns: int) -> int:
        return set_back(name, time_ns) if name == "rudder" else time_ns

    path = record(tmp_path / "log.mcap", one_channel, one_channel)
    with pytest.raises(LogError, match=r"/rudder/test run back by 5.25 s .* /yaw_rate/test do not"):
        read(path)


def test_a_part_beside_a_refused_step_is_read(tmp_path: Path) -> None:
    def one_channel(name: str, time_ns: int) -> int:
        return set_back(name, time_ns) if name == "rudder" else time_ns

    path = record(tmp_path / "log.mcap", one_channel, one_channel)
    with pytest.raises(LogError) as caught:
        open_log(path)
    remedy = re.search(r"--to (\S+) or --from (\S+):", str(caught.value))
    assert remedy
    before, after = open_log(path, end=remedy[1]), open_log(path, start=remedy[2])
    for part in (before, after):
        assert isinstance(part, TrialLog)
        assert {len(channel) > 60 for channel in part} == {True}
        times = (part["yaw_rate"].measured_ns - START) / SECOND
        np.testing.assert_allclose(times, part["yaw_rate"].values)
    times = (before["rudder"].measured_ns - START) / SECOND
    np.testing.assert_allclose(times, before["rudder"].values)
    times = (after["rudder"].measured_ns - START) / SECOND
    np.testing.assert_allclose(times, after["rudder"].values - 5.25)
    assert any("run back by 5.25 s" in warning for warning in read_log_info(path).warnings)
    assert read_log_info(path, end=remedy[1]).warnings == ()
    start_ns = int(after["yaw_rate"].received_ns[0])
    assert len(read(path, start_ns=start_ns)["yaw_rate"]) == len(after["yaw_rate"])


@pytest.mark.parametrize("size_secs", [5, 20, 70, 3600])
def test_a_clock_set_back_in_all_channels_by_any_size_is_repaired(
    tmp_path: Path, size_secs: int
) -> None:
    def clock(_name: str, time_ns: int) -> int:
        return time_ns - (time_ns >= 50 * SECOND) * size_secs * SECOND

    log = read(record(tmp_path / "log.mcap", clock, clock))
    assert len(log.warnings) == 1
    for channel in log:
        np.testing.assert_allclose((channel.measured_ns - START) / SECOND, channel.values)


@pytest.mark.parametrize("size_secs", [5, 20, 70, 3600])
def test_a_clock_set_back_at_a_restart_is_refused(tmp_path: Path, size_secs: int) -> None:
    def clock(_name: str, time_ns: int) -> int:
        return time_ns - (time_ns >= 50 * SECOND) * size_secs * SECOND

    path = record(tmp_path / "log.mcap", clock, clock, restart_secs=50.0)
    with pytest.raises(LogError, match=f"restarted 49.5 s .* run back by {size_secs} s") as caught:
        read(path)
    remedy = re.search(r"--to (\S+) or --from (\S+):", str(caught.value))
    assert remedy
    for bounds in ({"end": remedy[1]}, {"start": remedy[2]}):
        for channel in open_log(path, **bounds):
            assert np.all(np.diff(channel.values) > 0)


def test_a_restart_without_a_step_is_read(tmp_path: Path) -> None:
    assert read(record(tmp_path / "log.mcap", restart_secs=50.0)).warnings == ()


def test_a_gap_in_all_channels_is_reported_with_both_causes(tmp_path: Path) -> None:
    def set_forward(_name: str, time_ns: int) -> int:
        return time_ns + (time_ns >= 50 * SECOND) * 30 * SECOND

    log = read(record(tmp_path / "log.mcap", set_forward, set_forward))
    (warning,) = log.warnings
    assert "no samples for 30.0 s" in warning
    assert "paused, or its clock was set forward" in warning


@pytest.mark.parametrize("time", [2**64 - 5 * 10**9, -5 * SECOND, 0, 7_258_118_400 * SECOND])
@pytest.mark.parametrize("clocks", ["both", "measured"])
def test_single_impossible_times_are_dropped_everywhere(
    tmp_path: Path, time: int, clocks: str
) -> None:
    def disturbed(_name: str, time_ns: int) -> int:
        return time - START if time_ns == 50 * SECOND else time_ns

    received = disturbed if clocks == "both" else unchanged
    path = record(tmp_path / "log.mcap", received, disturbed)
    log = read(path)
    assert [len(channel) for channel in log] == [199, 199]
    assert all("1 of 200 samples" in warning for warning in log.warnings)
    info = read_log_info(path)
    assert (info.end_ns - info.start_ns) / SECOND == 99.5
    write(log, tmp_path / "copy.mcap")
    assert read(tmp_path / "copy.mcap").warnings == ()


def test_a_channel_of_another_epoch_is_kept_and_reported(tmp_path: Path) -> None:
    def rolled_over(name: str, time_ns: int) -> int:
        return time_ns - (name == "rudder") * 1024 * 7 * 86_400 * SECOND

    log = read(record(tmp_path / "log.mcap", measured=rolled_over))
    (warning,) = log.warnings
    assert warning.startswith("/rudder/test: 200 of 200 samples have times from 2004-")
    assert "1024 weeks" in warning


@pytest.mark.parametrize("size_secs", [-3600, -20, 20, 3600])
def test_a_clock_that_is_set_and_returned_is_repaired_and_reported(
    tmp_path: Path, size_secs: int
) -> None:
    def clock(_name: str, time_ns: int) -> int:
        return time_ns + (30 * SECOND <= time_ns < 60 * SECOND) * size_secs * SECOND

    log = read(record(tmp_path / "log.mcap", clock, clock))
    (warning,) = log.warnings
    assert f"set {'forward' if size_secs > 0 else 'back'} by {abs(size_secs)}.000 s" in warning
    assert "29.5 s after the start" in warning
    assert "by the same 29.5 s later" in warning
    for channel in log:
        np.testing.assert_array_equal(channel.measured_ns - START, channel.values * SECOND)
        np.testing.assert_array_equal(channel.measured_ns, channel.received_ns)


def test_two_steps_back_are_repaired(tmp_path: Path) -> None:
    def clock(_name: str, time_ns: int) -> int:
        return time_ns - (5 * (time_ns >= 30 * SECOND) + 7 * (time_ns >= 60 * SECOND)) * SECOND

    log = read(record(tmp_path / "log.mcap", clock, clock))
    assert [" 5.000 s" in w or " 7.000 s" in w for w in log.warnings] == [True, True]
    for channel in log:
        np.testing.assert_allclose((channel.measured_ns - START) / SECOND, channel.values)


def test_the_clocks_of_all_sensors_set_forward_are_repaired_from_reception(tmp_path: Path) -> None:
    def set_forward(_name: str, time_ns: int) -> int:
        return time_ns + (time_ns >= 50 * SECOND) * 3600 * SECOND

    log = read(record(tmp_path / "log.mcap", measured=set_forward))
    assert len(log.warnings) == 2
    assert all("sensor was set forward by 3600.000 s" in warning for warning in log.warnings)
    for channel in log:
        np.testing.assert_array_equal(channel.measured_ns, channel.received_ns)


def test_a_recorder_clock_set_forward_alone_leaves_the_measured_times(tmp_path: Path) -> None:
    def set_forward(_name: str, time_ns: int) -> int:
        return time_ns + (time_ns >= 50 * SECOND) * 3600 * SECOND

    log = read(record(tmp_path / "log.mcap", received=set_forward))
    assert log.warnings == ()
    for channel in log:
        np.testing.assert_array_equal(channel.measured_ns - START, channel.values * SECOND)


def _stepped(steps: str) -> tuple[Clock, Clock]:
    """Return the clocks of reception and measurement of one kind of step."""
    both = {
        "set back": set_back,
        "ahead for a while": lambda _, t: t + (30 * SECOND <= t < 60 * SECOND) * 20 * SECOND,
        "set forward": lambda _, t: t + (t >= 50 * SECOND) * 30 * SECOND,
    }
    if steps in both:
        return both[steps], both[steps]
    return unchanged, lambda name, t: t - (t >= 50 * SECOND and name == "rudder") * 40 * SECOND


@pytest.mark.parametrize(
    "steps", ["set back", "ahead for a while", "set forward", "one sensor set back"]
)
@pytest.mark.parametrize("keys", [None, ("rudder",)])
def test_a_part_read_alone_is_that_part_of_the_log(
    tmp_path: Path, steps: str, keys: tuple[str, ...] | None
) -> None:
    path = record(tmp_path / "log.mcap", *_stepped(steps))
    log = read(path)
    received = log["rudder"].received_ns
    for first, last in ((0, 40), (40, 90), (95, 120), (150, 190), (130, 199)):
        start, end = int(received[first]), int(received[last])
        part = read(path, channels=keys, start_ns=start, end_ns=end)
        assert [channel.name for channel in part] == list(keys or NAMES)
        for channel in part:
            whole = log[channel.name]
            rows = slice(*np.searchsorted(whole.received_ns, [start, end]))
            np.testing.assert_array_equal(channel.measured_ns, whole.measured_ns[rows])
            np.testing.assert_array_equal(channel.values, whole.values[rows])
        if steps != "set forward":
            assert part.warnings == log.warnings


@pytest.mark.parametrize("chunk_samples", [7, 50, 110, 1000])
@pytest.mark.parametrize(
    "steps", ["set back", "ahead for a while", "set forward", "one sensor set back"]
)
def test_a_log_longer_than_memory_has_the_times_of_one_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, steps: str, chunk_samples: int
) -> None:
    monkeypatch.setattr(shiplog.mcap.stream, "MAX_SAMPLES_IN_MEMORY", 10)
    monkeypatch.setattr(shiplog.mcap.stream, "FILE_CHUNK_SAMPLES", chunk_samples)
    path = record(tmp_path / "log.mcap", *_stepped(steps))
    expected, log = read(path), open_log(path)
    assert isinstance(log, LogFile) == (steps == "set forward")
    for _ in range(2):
        chunks = list(log.chunks())
        for number, whole in enumerate(expected):
            channel = concatenate_channels([chunk[number] for chunk in chunks])
            assert channel.measured_ns.tobytes() == whole.measured_ns.tobytes()
            assert channel.received_ns.tobytes() == whole.received_ns.tobytes()
            assert channel.values.tobytes() == whole.values.tobytes()
        assert log.warnings == expected.warnings
