"""The summary is the one that the mcap library reads, or none."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from mcap_files import (
    channel,
    file_records,
    flip_bit,
    mcap_chunk_ranges,
    position,
    write_by_mcap,
    write_flushed,
)

from shiplog import TrialLog, write
from shiplog.mcap.summary import McapSummary, read_summary


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


def summary_of(path: Path) -> McapSummary | None:
    with path.open("rb") as stream:
        return read_summary(stream)


@pytest.mark.parametrize("by_shiplog", [True, False])
def test_a_summary_is_the_one_that_the_mcap_library_reads(path: Path, *, by_shiplog: bool) -> None:
    original = (
        channel("yaw_rate", 60_000, 1),
        channel("speed", 700, 2),
        position(9, ("north", "east")),
    )
    if by_shiplog:
        write(TrialLog("t", original, {"place": "Neva"}, "T1 = 1\n"), path)
    else:
        write_by_mcap(path, *original)
    summary = summary_of(path)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        by_mcap = reader.get_summary()
        metadata = [m for record in reader.iter_metadata() for m in record.metadata.items()]
        vessels = [attachment.data.decode() for attachment in reader.iter_attachments()]
    assert summary is not None
    assert by_mcap is not None
    assert (summary.schemas, summary.channels) == (by_mcap.schemas, by_mcap.channels)
    assert summary.statistics == by_mcap.statistics
    assert summary.metadata == {k: text for k, text in metadata if k != "crc32"}
    assert summary.vessel_toml == (vessels[0] if vessels else None)
    locations = summary.mcap_chunk_locations()
    assert locations is not None
    assert len(locations) > 1
    assert [(p.offset, p.first_ns, p.last_ns, p.channel_ids) for p in locations] == [
        (i.chunk_start_offset, i.message_start_time, i.message_end_time,
         frozenset(i.message_index_offsets))
        for i in by_mcap.chunk_indexes
    ]  # fmt: skip
    assert [p.offset for p in locations] == [
        start for start, _ in mcap_chunk_ranges(path.read_bytes())
    ]


@pytest.mark.parametrize(
    "options", [{"repeat_channels": False}, {"repeat_schemas": False}, {"use_statistics": False}]
)
def test_an_incomplete_summary_is_none(path: Path, options: dict[str, Any]) -> None:
    write_by_mcap(path, channel("speed", 100), **options)
    assert summary_of(path) is None


@pytest.mark.parametrize("options", [{"index_types": IndexType.NONE}, {"use_chunking": False}])
def test_messages_outside_of_indexed_mcap_chunks_leave_no_locations(
    path: Path, options: dict[str, Any]
) -> None:
    write_by_mcap(path, channel("speed", 100), **options)
    summary = summary_of(path)
    assert summary is not None
    assert summary.mcap_chunk_locations() is None


def test_a_summary_with_a_flipped_bit_is_none(path: Path) -> None:
    _, data = write_flushed(path)
    start = next(end for opcode, _, end in file_records(data) if opcode == Opcode.DATA_END)
    rng = np.random.default_rng(0)
    for bit in rng.integers(8 * start, 8 * len(data), 300).tolist():
        path.write_bytes(flip_bit(data, bit))
        summary = summary_of(path)
        in_footers_length = len(data) - 36 <= bit // 8 < len(data) - 28
        assert summary is None or in_footers_length


def test_an_unfinished_file_has_no_summary(path: Path) -> None:
    _, data = write_flushed(path)
    for length in [*range(8, len(data), 97), len(data) - 1]:
        path.write_bytes(data[:length])
        assert summary_of(path) is None


def test_an_index_that_points_to_another_record_makes_the_summary_none(path: Path) -> None:
    """There is no checksum that shows the damage."""
    with path.open("wb") as stream:
        writer = Writer(stream, enable_crcs=False)
        writer.start()
        writer.add_metadata("shiplog", {"place": "Neva"})
        writer.finish()
    assert summary_of(path) is not None
    data = bytearray(path.read_bytes())
    (index,) = (start for opcode, start, _ in file_records(bytes(data)) if opcode == 0x0D)
    data[index + 9 : index + 17] = struct.pack("<Q", 8)  # the header
    path.write_bytes(data)
    assert summary_of(path) is None
