"""Reading, writing and `shiplog info`, against mcap's own reader and writer, message by message."""

import struct
import sys
from functools import partial
from pathlib import Path

import numpy as np
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer

from shiplog import LogWriter, TrialLog, read
from shiplog.mcap.messages import descriptor_set, encode_messages
from shiplog.mcap.schema import schema_for
from shiplog.mcap.writer import channel_metadata

from .bench import Bench
from .logs import require_disk_space, write_repeated
from .measure import Comparison, Limit, run, timed


def file_lines(bench: Bench) -> list[Comparison]:
    """Return the comparisons of reading and writing."""
    ours, theirs = bench.folder / "ours.mcap", bench.folder / "theirs.mcap"
    return [
        Comparison(
            "read to arrays, CRCs on",
            "mcap's reader, and decode",
            timed(partial(read, bench.path)),
            timed(partial(read_messages, bench.path)),
            Limit(at_least=80),
            verify=partial(_verify_read, bench),
        ),
        Comparison(
            "read to arrays, CRCs on",
            "zstd alone",
            timed(partial(read, bench.path)),
            timed(partial(decompress_chunks, bench.path)),
            Limit(at_most=2.5),
        ),
        Comparison(
            "write",
            "mcap's writer",
            timed(partial(write_columns, bench.log, ours)),
            timed(partial(write_messages, bench.log, theirs)),
            Limit(at_least=8),
            verify=partial(_verify_written, bench.log, ours, theirs),
        ),
    ]


def info_lines(bench: Bench) -> list[Comparison]:
    """Return the comparison of `shiplog info`: whole processes, the start of Python included."""
    days = f"{bench.info_hours / 24:.3g} days"
    path = bench.folder / "info.mcap"

    def write_log() -> None:
        require_disk_space(bench.folder, bench.info_hours)
        write_repeated(bench.log, bench.info_hours, path)

    return [
        Comparison(
            f"`shiplog info` of {days}",
            '`python -c "import numpy"`',
            lambda: run([sys.executable, "-m", "shiplog", "info", str(path)]).secs,
            lambda: run([sys.executable, "-c", "import numpy"]).secs,
            Limit(at_most=3),
            note="whole processes",
            verify=write_log,
        )
    ]


def read_messages(path: Path) -> dict[str, tuple[list[int], list[float]]]:
    """Read a log with mcap's reader; return the times and values of each topic."""
    columns: dict[str, tuple[list[int], list[float]]] = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            (value,) = struct.unpack_from("<d", message.data, 1)
            times, values = columns.setdefault(channel.topic, ([], []))
            times.append(message.publish_time)
            values.append(value)
    return columns


def decompress_chunks(path: Path) -> int:
    """Decompress all MCAP chunks with zstd and return their size; no reader can be faster."""
    decompressor, total, data = zstandard.ZstdDecompressor(), 0, memoryview(path.read_bytes())
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    for index in summary.chunk_indexes if summary else ():
        end = index.chunk_start_offset + index.chunk_length
        body = data[end - index.compressed_size : end]
        total += len(decompressor.decompress(body, index.uncompressed_size))
    return total


def write_columns(log: TrialLog, path: Path) -> None:
    """Write a log with our writer, by columns."""
    with LogWriter(path) as writer:
        writer.write(*log)


def write_messages(log: TrialLog, path: Path) -> None:
    """Write a log with mcap's writer, message by message in the order of reception."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        scalar = schema_for(())
        schema_id = writer.register_schema(scalar.name, "protobuf", descriptor_set(scalar))
        messages = []
        for channel in log:
            metadata = channel_metadata(channel)
            channel_id = writer.register_channel(channel.topic, "protobuf", schema_id, metadata)
            stamps = zip(channel.received_ns.tolist(), channel.measured_ns.tolist(), strict=True)
            messages += [
                (received, channel_id, measured, data)
                for (received, measured), data in zip(stamps, encode_messages(channel), strict=True)
            ]
        messages.sort(key=lambda message: message[0])
        for received, channel_id, measured, data in messages:
            writer.add_message(channel_id, received, data, measured)
        writer.finish()  # type: ignore[no-untyped-call]


def _verify_read(bench: Bench) -> None:
    theirs = read_messages(bench.path)
    for channel in read(bench.path):
        times, values = theirs[channel.topic]
        np.testing.assert_array_equal(channel.measured_ns, times)
        np.testing.assert_array_equal(channel.values, values)


def _verify_written(log: TrialLog, ours: Path, theirs: Path) -> None:
    write_columns(log, ours)
    write_messages(log, theirs)
    for one, other in zip(read(ours), read(theirs), strict=True):
        assert one.topic == other.topic  # noqa: S101 - this is what is verified
        np.testing.assert_array_equal(one.measured_ns, other.measured_ns)
        np.testing.assert_array_equal(one.received_ns, other.received_ns)
        np.testing.assert_array_equal(one.values, other.values)
