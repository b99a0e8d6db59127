"""Memory is bounded by the size of a file, whatever the file claims."""

import json
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Schema

from shiplog.mcap.records import MAGIC, MCAP_CHUNK_HEAD, RECORD_HEAD

MAX_BYTES = 500 << 20
_CHILD = """
import json, resource, sys
from pathlib import Path
from shiplog import ShiplogError
from shiplog.checks.info import read_log_info
results = []
for path in sys.argv[1:]:
    try:
        info = read_log_info(path)
        results.append([*info.warnings] if info.data_lost else [])
    except ShiplogError as error:
        results.append([str(error)])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
status = Path("/proc/self/status")
if status.exists():  # on Linux the former has the peak of the process that started this one, too
    (peak,) = (int(e.split()[1]) for e in status.read_text().splitlines() if e[:6] == "VmHWM:")
print(json.dumps([peak, results]))
"""


def described() -> bytes:
    """Return the descriptions of a channel of scalars."""
    builder = RecordBuilder()
    Schema(1, data=b"", encoding="protobuf", name="shiplog.Scalar").write(builder)
    Channel(1, "/speed/log", "protobuf", {"unit": "m/s"}, 1).write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def record(opcode: int, content: bytes) -> bytes:
    return RECORD_HEAD.pack(opcode, len(content)) + content


def mcap_chunk(body: bytes, size: int, crc: int = 0) -> bytes:
    head = MCAP_CHUNK_HEAD.pack(0, 1, size, crc, 4) + b"zstd" + struct.pack("<Q", len(body))
    return record(Opcode.CHUNK, head + body)


def zeros(blocks: int) -> bytes:
    """Return a zstd frame of many MiB of zeros, which does not state its size."""
    compressor = zstandard.ZstdCompressor().compressobj()
    data, block = BytesIO(), bytes(1 << 20)
    for _ in range(blocks):
        data.write(compressor.compress(block))
    data.write(compressor.flush())
    return data.getvalue()


def messages() -> bytes:
    """Return an MCAP chunk of a million equal samples, in a few kB."""
    one = record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, 0, 10**18, 10**18) + b"\x09" + bytes(8))
    data = described() + one * 1_000_000
    return mcap_chunk(zstandard.ZstdCompressor().compress(data), len(data), zlib.crc32(data))


def foreign_messages() -> bytes:
    """Return an MCAP chunk of a million equal messages of another program, in a few kB."""
    one = record(Opcode.MESSAGE, struct.pack("<HIQQ", 2, 0, 10**18, 10**18) + b"{}")
    head = struct.pack("<HH", 2, 0) + text(b"/a") + text(b"json") + text(b"")
    return packed(record(Opcode.CHANNEL, head) + one * 1_000_000)


def metadata(keys: int = 100_000, first: int = 0) -> bytes:
    """Return a metadata record of many different keys."""
    names = range(first * keys, (first + 1) * keys)
    pairs = b"".join(struct.pack("<I4sI", 4, n.to_bytes(4, "little"), 0) for n in names)
    return record(Opcode.METADATA, struct.pack("<I7sI", 7, b"shiplog", len(pairs)) + pairs)


def text(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def schema(number: int, size: int) -> bytes:
    head = struct.pack("<H", number) + text(b"a.B") + text(b"jsonschema")
    return record(Opcode.SCHEMA, head + text(bytes(size)))


def channel(number: int, metadata: bytes = b"") -> bytes:
    head = struct.pack("<HH", number, 1) + text(b"/rpm/%d" % number) + text(b"protobuf")
    return record(Opcode.CHANNEL, head + text(text(b"unit") + text(b"rpm") + metadata))


def packed(data: bytes) -> bytes:
    return mcap_chunk(zstandard.ZstdCompressor().compress(data), len(data))


def long_messages(channel_id: int) -> bytes:
    """Return MCAP chunks with a long message each, of zeros, in a few kB."""
    data = record(Opcode.MESSAGE, struct.pack("<HIQQ", channel_id, 0, 1, 1) + bytes(50 << 20))
    return described() + packed(data) * 10


HOSTILE: dict[str, Callable[[], bytes]] = {
    "a chunk that claims 1000 bytes and unpacks to 500 MB": lambda: mcap_chunk(zeros(500), 1000),
    "a chunk that claims 3 GB": lambda: mcap_chunk(zeros(1), 3000 << 20),
    "a chunk that claims 8 EB": lambda: mcap_chunk(zeros(1), 1 << 63),
    "a chunk that is cut off and unpacks to 500 MB": lambda: mcap_chunk(zeros(500), 0)[:-20],
    "20 million equal samples in 100 kB": lambda: messages() * 20,
    "a million equal messages of another program in 5 kB": foreign_messages,
    "metadata of 100,000 keys": metadata,
    "metadata of 10,000 keys, ten times": lambda: b"".join(metadata(10_000, k) for k in range(10)),
    "5,000 channels": lambda: b"".join(map(channel, range(2, 5002))),
    "5,000 schemas": lambda: b"".join(schema(n, 0) for n in range(2, 5002)),
    "schemas of 135 MB in a few kB": lambda: b"".join(
        packed(b"".join(schema(n + k, 15 << 20) for k in range(3))) for n in (2, 5, 8)
    ),
    "channels with 200,000 keys": lambda: b"".join(
        channel(n, b"".join(text(b"%d" % k) + text(b"") for k in range(16_000)))
        for n in range(2, 15)
    ),
    "500 MB of one channel in a few kB": lambda: long_messages(1),
    "500 MB of a channel that is described nowhere": lambda: long_messages(2),
    "a record that claims 8 EB": lambda: RECORD_HEAD.pack(Opcode.ATTACHMENT, 1 << 62) + bytes(50),
}


@pytest.mark.skipif(sys.platform == "win32", reason="no resource limits are measured there")
def test_hostile_files_are_refused_before_memory_is_taken(tmp_path: Path) -> None:
    builder = RecordBuilder()
    Header(profile="", library="").write(builder)
    start = MAGIC + bytes(builder.end())  # type: ignore[no-untyped-call]
    paths = []
    for number, make in enumerate(HOSTILE.values()):
        paths.append(tmp_path / f"{number}.mcap")
        paths[-1].write_bytes(start + make())
    done = subprocess.run(
        [sys.executable, "-c", _CHILD, *paths], capture_output=True, text=True, check=True
    )
    peak, results = json.loads(done.stdout)
    assert peak * (1 if sys.platform == "darwin" else 1024) < MAX_BYTES
    for name, result in zip(HOSTILE, results, strict=True):
        assert result, name
        assert all("\n" not in text for text in result), name
