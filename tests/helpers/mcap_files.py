"""MCAP files of other programs, damaged files, and their samples as the mcap library reads them."""

import struct
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.opcode import Opcode
from mcap.reader import McapReader, make_reader
from mcap.writer import Writer

from shiplog import Channel, LogWriter, TrialLog
from shiplog.mcap.messages import descriptor_set, encode_messages
from shiplog.mcap.schema import schema_for

START = 1_700_000_000_000_000_000
EXTREMES = [0.0, -0.0, 1.0, -1e308, 5e-324, float("inf"), float("-inf"), float("nan")]
UNIT = {"yaw_rate": "rad/s", "speed": "m/s", "rudder": "rad", "position": "m"}

# by topic: times of reception and measurement, bytes of the values
Samples = dict[str, list[tuple[int, int, bytes]]]


def channel(name: str, count: int, seed: int = 0, source: str = "test") -> Channel:
    """Return a channel of random times and values, with extreme values and NaN."""
    rng = np.random.default_rng(seed)
    measured = START + np.cumsum(rng.integers(1, 200_000_000, count))
    received = np.sort(measured + rng.integers(0, 50_000_000, count))
    values = np.where(rng.random(count) < 0.3, rng.choice(EXTREMES, count), rng.normal(size=count))
    return Channel(name, source, UNIT.get(name, "1"), measured, received, values)


def position(count: int, fields: tuple[str, ...]) -> Channel:
    """Return a position channel with random values, one sample a second."""
    at = START + np.arange(count) * 1_000_000_000
    values = np.random.default_rng(5).normal(size=(count, len(fields)))
    return Channel("position", "x".join(fields), "m", at, at + 7, values, fields)


def samples(log: TrialLog) -> Samples:
    """Return the samples of a log, comparable bit for bit."""
    return {
        c.topic: [
            (received, measured, value.tobytes())
            for received, measured, value in zip(
                c.received_ns.tolist(), c.measured_ns.tolist(), c.values, strict=True
            )
        ]
        for c in log
    }


def samples_by_mcap(path: Path, reader: Callable[..., McapReader] = make_reader) -> Samples:
    """Read the samples with the mcap library and the file's schemas, without shiplog."""
    result: Samples = defaultdict(list)
    types: dict[int, Any] = {}
    with path.open("rb") as stream:
        for schema, topic, message in reader(stream, validate_crcs=True).iter_messages():
            assert schema is not None
            if schema.id not in types:
                pool = descriptor_pool.DescriptorPool()
                for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(file)
                types[schema.id] = message_factory.GetMessageClass(
                    pool.FindMessageTypeByName(schema.name)
                )
            decoded = types[schema.id].FromString(message.data)
            doubles = [
                getattr(decoded, f.name)
                for f in decoded.DESCRIPTOR.fields
                if f.type == f.TYPE_DOUBLE and not f.is_repeated
            ]
            result[topic.topic].append(
                (message.log_time, message.publish_time, struct.pack(f"<{len(doubles)}d", *doubles))
            )
    return dict(result)


def write_by_mcap(path: Path, *channels: Channel, **options: Any) -> Path:  # noqa: ANN401 - mcap's own
    """Write channels with the mcap library, with its options for the layout of the file."""
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start()
        messages = []
        for c in channels:
            schema = schema_for(c.fields)
            schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
            channel_id = writer.register_channel(
                c.topic, "protobuf", schema_id, {"unit": c.unit, **c.metadata}
            )
            times = zip(
                c.received_ns.tolist(), c.measured_ns.tolist(), encode_messages(c), strict=True
            )
            messages += [(received, channel_id, *rest) for received, *rest in times]
        for received, channel_id, measured, data in sorted(messages, key=lambda m: m[0]):
            writer.add_message(channel_id, received, data, measured)
        writer.finish()
    return path


def write_messages(
    path: Path, messages: list[bytes], *, unit: str | None = "rad/s", topic: str = "/yaw_rate/imu"
) -> Path:
    """Write scalar messages of the given bytes with the mcap library, one a second."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        metadata = {} if unit is None else {"unit": unit}
        channel_id = writer.register_channel(topic, "protobuf", schema_id, metadata)
        for second, data in enumerate(messages):
            at = START + second * 1_000_000_000
            writer.add_message(channel_id, at, data, at)
        writer.finish()
    return path


def scalar(value: float, tag: int = 0x09) -> bytes:
    """Return a serialised scalar message."""
    return bytes([tag]) + struct.pack("<d", value)


def file_records(data: bytes) -> list[tuple[int, int, int]]:
    """Return the opcode, the start and the end of each record of a file."""
    result, at = [], 8
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        result.append((opcode, at, at + 9 + length))
        at += 9 + length
    return result


def mcap_chunk_ranges(data: bytes) -> list[tuple[int, int]]:
    """Return the start and the end of each MCAP chunk of a file."""
    return [(start, end) for opcode, start, end in file_records(data) if opcode == Opcode.CHUNK]


def end_mcap_chunk(writer: LogWriter) -> None:
    """Let the MCAP chunk in the file end here, which a flush leaves open for more."""
    writer.flush()
    writer._file.close_mcap_chunk()
    writer.flush()


def write_flushed(path: Path, chunks: int = 5, count: int = 100) -> tuple[TrialLog, bytes]:
    """Write a log in many MCAP chunks; return it and the bytes of its file."""
    whole = [channel("yaw_rate", chunks * count, 1), channel("speed", chunks * count, 2)]
    with LogWriter(path, metadata={"place": "Neva"}) as writer:
        for at in range(0, chunks * count, count):
            writer.write(*(c.part(at, at + count) for c in whole))
            end_mcap_chunk(writer)
    return TrialLog("trial.mcap", tuple(whole)), path.read_bytes()


def is_subset_of(log: TrialLog, original: TrialLog) -> bool:
    """Whether all samples of a log are in the original, as often and in the same order."""
    originals = samples(original)
    for topic, rows in samples(log).items():
        rest = iter(originals.get(topic, []))
        if not all(sample in rest for sample in rows):
            return False
    return True


def offset_between(fraction: float, low: int, high: int) -> int:
    """Return the integer at a fraction, less than one, of the range."""
    return low + int(fraction * (high - low))


def spoil(data: bytes, at: int) -> bytes:
    """Return the data with all bits of a byte inverted, which no checksum can correct."""
    changed = bytearray(data)
    changed[at] ^= 0xFF
    return bytes(changed)


def flip_bit(data: bytes, bit: int) -> bytes:
    """Return the data with one bit inverted."""
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)
