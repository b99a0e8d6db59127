"""MCAP chunks encoded by columns have the messages that the mcap library writes."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

import shiplog.mcap.encode
from shiplog import Channel, LogWriter, TrialLog, write
from shiplog.mcap.encode import MessageBatch, encode_mcap_chunks
from shiplog.mcap.messages import descriptor_set, encode_messages
from shiplog.mcap.schema import schema_for
from shiplog.mcap.writer import MAX_MCAP_CHUNK_BYTES
from shiplog.units import GEOGRAPHIC


def trial(rng: np.random.Generator, count: int) -> TrialLog:
    """Channels of three message sizes, one of them variable, received out of order."""

    def times() -> np.ndarray:
        return np.sort(rng.integers(0, 10**12, count))

    def channel(name: str, fields: tuple[str, ...] = (), unit: str = "m/s") -> Channel:
        at = times()
        values = rng.normal(size=(count, len(fields)) if fields else count)
        return Channel(name, "a", unit, at, at + rng.integers(0, 10**9, count), values, fields)

    return TrialLog(
        "trial",
        (
            channel("speed"),
            channel("sway"),
            channel("position", ("north", "east"), "m"),
            channel("geo", GEOGRAPHIC, "deg"),
        ),
    )


@pytest.mark.parametrize("seed", range(3))
def test_messages_are_those_that_the_mcap_library_writes(seed: int) -> None:
    log = trial(np.random.default_rng(seed), 400)
    ours, by_mcap = io.BytesIO(), io.BytesIO()
    writer = Writer(by_mcap)
    writer.start()
    messages = []
    for number, c in enumerate(log, start=1):
        schema = schema_for(c.fields)
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        assert writer.register_channel(c.topic, "protobuf", schema_id) == number
        rows = zip(c.received_ns.tolist(), c.measured_ns.tolist(), encode_messages(c), strict=True)
        messages += [(got, number, k, was, data) for k, (got, was, data) in enumerate(rows)]
    for got, number, k, was, data in sorted(messages, key=lambda m: m[0]):
        writer.add_message(number, got, data, was, k)
    writer.finish()
    parts = [MessageBatch(number, 0, c) for number, c in enumerate(log, start=1)]
    for chunk in encode_mcap_chunks(parts, 8192):
        ours.write(chunk.data.tobytes())
    by_mcap.seek(0)
    expected = b"".join(
        struct.pack("<BQHIQQ", 5, 22 + len(m.data), m.channel_id, m.sequence, m.log_time,
                    m.publish_time) + m.data
        for _, _, m in make_reader(by_mcap).iter_messages()
    )  # fmt: skip
    assert sorted(_split(ours.getvalue())) == sorted(_split(expected))
    received = [struct.unpack_from("<Q", r, 15)[0] for r in _split(ours.getvalue())]
    assert received == sorted(received)


def test_encoding_in_portions_gives_the_same_messages_as_all_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng = np.random.default_rng(4)
    parts = []
    for number, (name, count) in enumerate(
        {"speed": 900, "sway": 350, "geo": 120, "heave": 0}.items()
    ):
        at = np.sort(rng.integers(0, 2000, count))  # many at one instant
        fields = GEOGRAPHIC if name == "geo" else ()
        values = rng.normal(size=(count, len(fields)) if fields else count)
        parts.append(MessageBatch(number, 7, Channel(name, "a", "1", at, at, values, fields)))
    at_once = b"".join(chunk.data.tobytes() for chunk in encode_mcap_chunks(parts, 4096))
    monkeypatch.setattr(shiplog.mcap.encode, "MESSAGES_AT_ONCE", 100)
    bits = list(encode_mcap_chunks(parts, 4096))
    assert b"".join(chunk.data.tobytes() for chunk in bits) == at_once
    assert len(bits) > len(at_once) / 4096 + 3
    for chunk in bits:
        data = chunk.data.tobytes()
        for channel_id, entries in chunk.index.items():
            for got, offset in entries.tolist():
                head = struct.unpack_from("<BQHIQ", data, offset)
                assert (head[0], head[2], head[4]) == (5, channel_id, got)


def _split(data: bytes) -> list[bytes]:
    result, at = [], 0
    while at < len(data):
        size = 9 + struct.unpack_from("<Q", data, at + 1)[0]
        result.append(data[at : at + size])
        at += size
    return result


@pytest.mark.parametrize("largest", [100, 1000, 1 << 20])
def test_the_index_has_the_offset_of_each_message(largest: int) -> None:
    log = trial(np.random.default_rng(9), 150)
    parts = [MessageBatch(number, 0, c) for number, c in enumerate(log, start=1)]
    seen = 0
    for chunk in encode_mcap_chunks(parts, largest):
        data = chunk.data.tobytes()
        assert len(data) <= largest + 200
        for channel_id, entries in chunk.index.items():
            for got, offset in entries.tolist():
                opcode, _, its_channel, _, received = struct.unpack_from("<BQHIQ", data, offset)
                assert (opcode, its_channel, received) == (5, channel_id, got)
                assert chunk.first_ns <= received <= chunk.last_ns
                seen += 1
    assert seen == 600


def test_small_writes_are_collected_into_large_mcap_chunks(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.mcap"
    with LogWriter(path) as writer:
        for k in range(3000):
            at = np.arange(k * 20, (k + 1) * 20)
            writer.write(Channel("speed", "log", "m/s", at, at, at * 1.0))
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    sizes = [index.uncompressed_size for index in summary.chunk_indexes]
    assert len(sizes) == 5
    assert max(sizes) <= MAX_MCAP_CHUNK_BYTES + 1000
    assert min(sizes) > MAX_MCAP_CHUNK_BYTES / 4
    write(TrialLog("x", ()), tmp_path / "empty.mcap")
