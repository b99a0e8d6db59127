"""Raw packets and events in a file are what other readers of MCAP and protobuf find there."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from shiplog import Channel, LogWriter, UsageError
from shiplog.types import Event, EventLevel, RawPackets

START = 1_700_000_000_000_000_000


def decoded(path: Path) -> list[tuple[str, int, int, Any]]:
    """Topic, times of reception and measurement, and message, by the descriptors in the file."""
    result, types = [], {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            assert schema is not None
            if schema.id not in types:
                pool = descriptor_pool.DescriptorPool()
                for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(file)
                found = pool.FindMessageTypeByName(schema.name)
                types[schema.id] = message_factory.GetMessageClass(found)
            content = types[schema.id].FromString(message.data)
            result.append((channel.topic, message.log_time, message.publish_time, content))
    return result


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


@pytest.mark.parametrize("length", [0, 1, 127, 128, 16_383, 16_384, 70_000])
def test_packets_of_any_length_are_read_by_the_protobuf_library(path: Path, length: int) -> None:
    data = (bytes(range(256)) * 300)[:length]
    times = START + np.arange(2)
    with LogWriter(path) as writer:
        writer.write(RawPackets("gyro", "nmea0183", times, (data, b"next")))
    messages = decoded(path)
    assert [m.data for *_, m in messages] == [data, b"next"]
    assert [times for _, *times, _ in messages] == [[START, START], [START + 1, START + 1]]


def test_the_channel_of_raw_packets_states_their_format_and_source(path: Path) -> None:
    with LogWriter(path) as writer:
        writer.write(RawPackets("bridge/gyro", "nmea0183", np.array([START]), (b"$",)))
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    (channel,) = summary.channels.values()
    assert channel.topic == "/raw/bridge/gyro"
    assert channel.metadata == {"source": "bridge/gyro", "format": "nmea0183"}
    assert summary.schemas[channel.schema_id].name == "shiplog.Raw"


def test_events_are_log_messages_of_foxglove(path: Path) -> None:
    with LogWriter(path) as writer:
        writer.write(Event(START + 1_500_000_000, "execute, 20 starboard"))
        writer.write(Event(START + 2, "no data", "udp://127.0.0.1:10110", EventLevel.WARNING))
    messages = decoded(path)
    assert [topic for topic, *_ in messages] == ["/events", "/events"]
    later = messages[1][3]
    assert (later.message, later.name) == ("execute, 20 starboard", "operator")
    assert later.DESCRIPTOR.full_name == "foxglove.Log"
    assert later.Level.Name(later.level) == "INFO"
    assert later.timestamp.ToNanoseconds() == messages[1][2] == START + 1_500_000_000
    assert messages[0][3].level == messages[0][3].WARNING


def test_an_event_reported_late_keeps_its_time_and_the_file_its_order(path: Path) -> None:
    at = START + np.arange(10)
    with LogWriter(path) as writer:
        writer.write(Channel("speed", "log", "m/s", at, at, at * 0.0))
        writer.flush()
        writer.write(Event(START + 3, "the source went away"))
    messages = decoded(path)
    received = [time for _, time, *_ in messages]
    assert received == sorted(received)
    assert messages[-1][2] == START + 3


def test_samples_packets_and_events_are_interleaved_and_counted(path: Path) -> None:
    rng = np.random.default_rng(5)
    at = np.sort(rng.integers(START, START + 10**9, 500))
    packets = tuple(rng.bytes(int(n)) for n in rng.integers(0, 300, 500))
    with LogWriter(path) as writer:
        writer.write(
            Channel("speed", "log", "m/s", at + 1, at + 1, np.arange(500.0)),
            RawPackets("log", "nmea0183", at, packets),
            *(Event(int(t) + 2, f"{k}") for k, t in enumerate(at[::100])),
        )
        assert writer.samples == 500
    messages = decoded(path)
    received = [time for _, time, *_ in messages]
    assert received == sorted(received)
    assert tuple(m.data for topic, *_, m in messages if topic == "/raw/log") == packets
    assert [m.message for topic, *_, m in messages if topic == "/events"] == list("01234")
    values = [m.value for topic, *_, m in messages if topic == "/speed/log"]
    assert values == list(range(500))


def test_bytes_that_are_no_text_do_not_end_a_recording(path: Path) -> None:
    with LogWriter(path) as writer:
        writer.write(Event(START, b"bad \xff".decode(errors="surrogateescape")))
    assert decoded(path)[0][3].message == "bad ?"


def test_a_channel_cannot_have_the_topic_of_raw_packets(path: Path) -> None:
    at = np.array([START])
    with LogWriter(path) as writer, pytest.raises(UsageError, match="/raw/gyro"):
        writer.write(Channel("raw", "gyro", "1", at, at, np.zeros(1)))
