"""The loop that records: all samples kept, whatever ends it."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from extensions import run_python
from mcap.reader import make_reader
from places import PROJECT

from recorders.record import Recording, Rotation, record
from recorders.source import Recordable
from shiplog import Channel, ShiplogError, read
from shiplog.mcap.record_writer import McapRecordWriter
from shiplog.mcap.records import MAGIC
from shiplog.types import Event, RawPackets


class Sensor:
    """A source of three chunks that may be interrupted."""

    metadata = {"source": "test"}  # noqa: RUF012
    vessel_toml = None

    def __init__(self, interruption: BaseException | None = None) -> None:
        self.interruption = interruption

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        for k in range(3):
            if k == 2 and self.interruption:
                raise self.interruption
            at = np.arange(k * 10, (k + 1) * 10) * 10**8
            yield (Channel("yaw_rate", "gyro", "rad/s", at, at, np.sin(at * 1e-9)),)


def test_all_samples_of_a_source_are_written_and_counted(tmp_path: Path) -> None:
    counts: list[int] = []
    recording = record(Sensor(), tmp_path / "a.mcap", on_chunk=counts.append)
    assert recording == Recording(30, 1, interrupted=False, files=(tmp_path / "a.mcap",))
    assert counts == [10, 20, 30]
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 30
    assert log.metadata["source"] == "test"


def test_the_growing_file_can_be_read_before_its_first_sample(tmp_path: Path) -> None:
    logs = []

    class LateSensor(Sensor):
        def chunks(self) -> Iterator[tuple[Channel, ...]]:
            logs.append(read(tmp_path / "a.mcap.part"))
            yield from super().chunks()

    record(LateSensor(), tmp_path / "a.mcap")
    assert [(log.channels, log.metadata["source"]) for log in logs] == [((), "test")]


def test_ctrl_c_ends_the_recording_and_keeps_the_samples(tmp_path: Path) -> None:
    recording = record(Sensor(KeyboardInterrupt()), tmp_path / "a.mcap")
    assert recording == Recording(20, 1, interrupted=True, files=(tmp_path / "a.mcap",))
    log = read(tmp_path / "a.mcap")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


def test_a_failing_source_loses_no_sample_and_leaves_an_older_file_alone(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"older")
    with pytest.raises(ShiplogError, match=r"no signal; at least 20 samples .* in .*a\.mcap\.part"):
        record(Sensor(ShiplogError("no signal")), tmp_path / "a.mcap")
    assert (tmp_path / "a.mcap").read_bytes() == b"older"
    log = read(tmp_path / "a.mcap.part")
    assert len(log["yaw_rate"]) == 20
    assert not log.warnings


@pytest.mark.parametrize("place", ["", "no/such/folder/a.mcap"])
def test_an_unwritable_place_is_reported_and_leaves_no_file(tmp_path: Path, place: str) -> None:
    with pytest.raises(ShiplogError, match="cannot write"):
        record(Sensor(), tmp_path / place)
    assert list(tmp_path.iterdir()) == []


class Stream:
    """A source of packets whose metadata count those received so far."""

    vessel_toml = None

    def __init__(self, failure: ShiplogError | None = None) -> None:
        self.received = 0
        self.failure = failure

    @property
    def metadata(self) -> dict[str, str]:
        return {"source": "test", "rejected": str(self.received)}

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        for k in range(3):
            self.received += 1
            at = np.array([k * 10**8])
            yield RawPackets("gyro", "nmea0183", at, (b"?",)), Event(k * 10**8, "no sentence")
        if self.failure:
            raise self.failure


@pytest.mark.parametrize("failure", [None, ShiplogError("no signal")])
def test_packets_and_events_are_written_and_the_metadata_of_the_end(
    tmp_path: Path, failure: ShiplogError | None
) -> None:
    path = tmp_path / "a.mcap"
    if failure is None:
        assert record(Stream(), path) == Recording(0, 0, interrupted=False, files=(path,))
    else:
        with pytest.raises(ShiplogError, match=r"no signal"):
            record(Stream(failure), path)
        path = tmp_path / "a.mcap.part"
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == 6
    metadata = read(path).metadata
    assert (metadata["source"], metadata["rejected"]) == ("test", "3")


def test_a_rotated_recording_goes_on_in_numbered_files_that_hold_all_samples(
    tmp_path: Path,
) -> None:
    every_chunk = Rotation(megabytes=1e-6)
    recording = record(Sensor(), tmp_path / "a.mcap", rotation=every_chunk)
    assert [file.name for file in recording.files] == [f"a.00{n}.mcap" for n in (1, 2, 3)]
    logs = [read(file) for file in recording.files]
    assert [log["yaw_rate"].measured_ns[0] for log in logs] == [0, 10**9, 2 * 10**9]
    assert [len(log["yaw_rate"]) for log in logs] == [10, 10, 10]
    assert all(log.metadata["source"] == "test" and not log.warnings for log in logs)
    assert recording.samples == 30
    assert not (tmp_path / "a.mcap").exists()


def test_a_rotation_by_time_is_due_after_its_minutes() -> None:
    rotation = Rotation(minutes=2.0)
    assert not rotation.is_due(119.0, 10**9)
    assert rotation.is_due(120.0, 0)


def test_a_rotation_by_time_follows_the_times_of_what_is_received(tmp_path: Path) -> None:
    recording = record(Sensor(), tmp_path / "a.mcap", rotation=Rotation(minutes=1.5 / 60))
    assert [file.name for file in recording.files] == ["a.001.mcap", "a.002.mcap"]
    assert [len(read(file)["yaw_rate"]) for file in recording.files] == [20, 10]


def test_a_log_that_is_not_to_be_replaced_is_refused_before_anything_is_recorded(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.mcap").write_bytes(b"older")
    with pytest.raises(ShiplogError, match=r"a log of this name exists.*a\.mcap"):
        record(Sensor(), tmp_path / "a.mcap", overwrites=False)
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == {"a.mcap": b"older"}


def test_a_log_that_appears_while_recording_is_not_replaced(tmp_path: Path) -> None:
    final = tmp_path / "a.mcap"
    with pytest.raises(ShiplogError, match=r"has appeared; the recording is complete in .*\.part"):
        record(Sensor(), final, overwrites=False, on_chunk=lambda _: final.touch())
    assert len(read(tmp_path / "a.mcap.part")["yaw_rate"]) == 30


@pytest.mark.parametrize("rotation", [None, Rotation(minutes=1.0)])
def test_an_unfinished_recording_is_refused_and_not_touched(
    tmp_path: Path, rotation: Rotation | None
) -> None:
    part = tmp_path / ("a.mcap.part" if rotation is None else "a.007.mcap.part")
    part.write_bytes(b"samples")
    with pytest.raises(ShiplogError, match="unfinished recording lies there"):
        record(Sensor(), tmp_path / "a.mcap", rotation=rotation)
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == {part.name: b"samples"}


def test_files_of_an_older_rotated_recording_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.002.mcap").write_bytes(b"older")
    rotation = Rotation(megabytes=1e-6)
    with pytest.raises(ShiplogError, match=r"a log of this name exists.*a\.002\.mcap"):
        record(Sensor(), tmp_path / "a.mcap", rotation=rotation, overwrites=False)
    assert [f.name for f in tmp_path.iterdir()] == ["a.002.mcap"]


def test_a_file_that_is_deleted_while_it_grows_is_noticed_at_the_next_chunk(
    tmp_path: Path,
) -> None:
    counts: list[int] = []

    def delete(samples: int) -> None:
        counts.append(samples)
        (tmp_path / "a.mcap.part").unlink(missing_ok=True)

    with pytest.raises(ShiplogError, match="cannot write: No such file"):
        record(Sensor(), tmp_path / "a.mcap", on_chunk=delete)
    assert counts == [10]


FULL_DISK = """
import resource, sys
from pathlib import Path
import numpy as np
from recorders.record import record
from shiplog import Channel, ShiplogError

class Noise:
    metadata, vessel_toml = {}, None

    def chunks(self):
        rng = np.random.default_rng(1)
        for k in range(1000):
            at = np.arange(k * 100, (k + 1) * 100) * 10**7
            yield (Channel("yaw_rate", "gyro", "rad/s", at, at, rng.normal(size=100)),)

resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    record(Noise(), "a.mcap")
except ShiplogError as error:
    print(error)
"""


def test_a_full_disk_is_one_line_and_what_was_written_can_be_read(tmp_path: Path) -> None:
    done = run_python(os.environ | {"PYTHONPATH": os.fspath(PROJECT)}, tmp_path, "-c", FULL_DISK)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("cannot write: File too large; at least ")
    assert done.stdout.endswith("samples until then are in a.mcap.part\n")
    assert done.stdout.count("\n") == 1
    assert not (tmp_path / "a.mcap").exists()
    log = read(tmp_path / "a.mcap.part")
    stated = int(done.stdout.split("at least ")[1].split()[0])
    assert len(log["yaw_rate"]) >= stated > 2000


def test_the_source_is_closed_when_the_writing_fails(tmp_path: Path) -> None:
    closed: list[bool] = []

    class Closing(Sensor):
        def chunks(self) -> Iterator[tuple[Channel, ...]]:
            try:
                yield from super().chunks()
            finally:
                closed.append(True)

    def fail(_: int) -> None:
        assert not closed
        raise RuntimeError("in the display")

    with pytest.raises(RuntimeError):
        record(Closing(), tmp_path / "a.mcap", on_chunk=fail)
    assert closed == [True]


@pytest.mark.parametrize("instant", ["first chunk", "end"])
def test_ctrl_c_in_the_middle_of_a_write_damages_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, instant: str
) -> None:
    counts = list[int]()

    def interrupted(self: McapRecordWriter, data: bytes) -> None:
        counts.append(len(data))
        self._stream.write(data)
        if (len(counts) == 6) if instant == "first chunk" else (self._size > 0 and data == MAGIC):
            signal.raise_signal(signal.SIGINT)
        self._size += len(data)

    monkeypatch.setattr(McapRecordWriter, "_write", interrupted)
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        recording = record(Sensor(), tmp_path / "a.mcap")
    finally:
        signal.signal(signal.SIGINT, previous)
    assert recording.interrupted
    log = read(tmp_path / "a.mcap")
    assert not log.warnings
    assert len(log["yaw_rate"]) == recording.samples >= 10
    with (tmp_path / "a.mcap").open("rb") as stream:
        assert len(list(make_reader(stream, validate_crcs=True).iter_messages())) >= 10
