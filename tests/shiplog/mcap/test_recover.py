"""What is recovered of a file is all that is intact in it, as the mcap library reads it."""

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_files import (
    START,
    channel,
    file_records,
    mcap_chunk_ranges,
    samples,
    spoil,
    write_flushed,
)

from shiplog import LogError, LogWriter, TrialLog, read
from shiplog.mcap import record_walk
from shiplog.mcap.recover import recover


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "damaged.mcap"


@pytest.fixture
def good(tmp_path: Path) -> Path:
    return tmp_path / "good.mcap"


def write_foreign(path: Path, compression: CompressionType = CompressionType.ZSTD) -> bytes:
    """Write messages of another program in several MCAP chunks, an attachment and metadata."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=400, compression=compression)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        topics = [
            writer.register_channel("/chatter", "cdr", schema),
            writer.register_channel("/plain", "json", 0),
        ]
        writer.add_attachment(START, START, "notes.txt", "text/plain", b"calm sea")
        writer.add_metadata("crew", {"master": "A. B."})
        for number in range(60):
            at = START + number
            writer.add_message(topics[number % 2], at, b"message %d" % number, at, number)
        writer.finish()
    return path.read_bytes()


def content(data: bytes) -> list[object]:
    reader = make_reader(BytesIO(data), validate_crcs=True)
    messages = [
        (c.topic, s and s.name, m.log_time, m.publish_time, m.sequence, m.data)
        for s, c, m in reader.iter_messages()
    ]
    header = reader.get_header().profile
    return [header, *messages, *reader.iter_attachments(), *reader.iter_metadata()]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_whole_file_of_another_program_is_kept_as_it_is(
    path: Path, good: Path, compression: CompressionType
) -> None:
    data = write_foreign(path, compression)
    recovery = recover(path, good)
    assert content(good.read_bytes()) == content(data)
    assert recovery.damage == ()
    assert not recovery.is_lost
    assert recovery.lost_messages == {}


def test_a_damaged_mcap_chunk_alone_is_lost_and_its_messages_are_counted(
    path: Path, good: Path
) -> None:
    data = write_foreign(path)
    start, end = mcap_chunk_ranges(data)[1]
    path.write_bytes(spoil(data, end - 5))
    recovery = recover(path, good)
    assert recovery.is_lost
    (damage,) = recovery.damage
    assert (damage.start, damage.end) == (start, end)
    assert recovery.lost_messages is not None
    assert set(recovery.lost_messages) == set(damage.topics) == {"/chatter", "/plain"}
    assert sum(recovery.messages.values()) + sum(recovery.lost_messages.values()) == 60
    whole = content(data)
    kept = content(good.read_bytes())
    assert len(whole) - len(kept) == sum(recovery.lost_messages.values())
    assert [each for each in whole if each in kept] == kept


def test_what_is_before_the_cut_of_a_file_is_kept(path: Path, good: Path) -> None:
    whole = channel("yaw_rate", 1000)
    with LogWriter(path, metadata={"place": "Neva"}) as writer:
        for at in range(0, 1000, 100):
            writer.write(whole.part(at, at + 100))
            writer.flush()  # into one MCAP chunk, which stays open
    data = path.read_bytes()
    start, end = max(mcap_chunk_ranges(data), key=lambda places: places[1] - places[0])
    path.write_bytes(data[: (start + end) // 2])
    recovery = recover(path, good)
    assert recovery.is_cut
    assert recovery.is_lost
    log = read(good)
    assert log.warnings == ()
    assert 300 <= len(log["yaw_rate"]) < 700
    assert (
        samples(log)["/yaw_rate/test"]
        == samples(TrialLog("t", (whole,)))["/yaw_rate/test"][: len(log["yaw_rate"])]
    )
    assert log.metadata["place"] == "Neva"


def test_an_unfinished_file_that_lacks_no_message_loses_nothing(path: Path, good: Path) -> None:
    original, data = write_flushed(path)
    end = next(start for opcode, start, _ in file_records(data) if opcode == 0x0F)
    path.write_bytes(data[:end])
    recovery = recover(path, good)
    assert not recovery.is_finished
    assert not recovery.is_lost
    assert samples(read(good)) == samples(original)


def test_damaged_heads_of_records_are_passed(path: Path, good: Path) -> None:
    """Of every record before the summary, in turn, opcode and length are overwritten."""
    original, data = write_flushed(path, chunks=3, count=20)
    chunks = mcap_chunk_ranges(data)
    for _, start, _ in file_records(data)[:8]:
        path.write_bytes(data[:start] + b"\xff" * 9 + data[start + 9 :])
        recovery = recover(path, good)
        lost = any(start == first for first, _ in chunks)
        assert sum(map(len, read(good))) == sum(map(len, original)) - 40 * lost
        assert recovery.is_lost == (lost or recovery.metadata_records < 1)
        assert recovery.damage


def test_what_is_no_mcap_file_is_refused_and_nothing_is_written(path: Path, good: Path) -> None:
    path.write_bytes(b"time,rudder\n0,1\n")
    with pytest.raises(LogError, match="not an MCAP file"):
        recover(path, good)
    assert not good.exists()


@pytest.mark.parametrize("is_damaged", [False, True])
def test_an_attachment_that_is_too_long_to_be_read_at_once_is_copied_or_lost(
    path: Path, good: Path, monkeypatch: pytest.MonkeyPatch, *, is_damaged: bool
) -> None:
    monkeypatch.setattr(record_walk, "MAX_RECORD_BYTES", 10_000)
    notes = np.random.default_rng(0).bytes(3 << 20)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        topic = writer.register_channel("/plain", "json", 0)
        writer.add_message(topic, START, b"{}", START)
        writer.add_attachment(START, START + 1, "notes.bin", "application/octet-stream", notes)
        writer.finish()
    data = path.read_bytes()
    at = data.index(notes) + 1000
    if is_damaged:
        path.write_bytes(data[:at] + bytes(50) + data[at + 50 :])
    recovery = recover(path, good)
    assert recovery.attachments == (not is_damaged)
    assert recovery.is_lost == is_damaged
    expected = content(data)[:2] if is_damaged else content(data)
    assert content(good.read_bytes()) == expected
    warnings = read(path).warnings
    assert any(str(len(notes))[:4] in text and "attachment" in text for text in warnings)
