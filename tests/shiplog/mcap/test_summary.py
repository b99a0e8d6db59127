"""The summary as we read it is the one that mcap reads, or none."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from mcap_files import channel, flipped, flushed, mcap_chunks, position, top_level, written

from shiplog import TrialLog, write
from shiplog.mcap.summary import McapSummary, read_summary


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


def summary_of(path: Path) -> McapSummary | None:
    with path.open("rb") as stream:
        return read_summary(stream)


@pytest.mark.parametrize("by_us", [True, False])
def test_it_says_what_mcaps_own_reader_finds(path: Path, *, by_us: bool) -> None:
    held = channel("yaw_rate", 60_000, 1), channel("speed", 700, 2), position(9, ("north", "east"))
    if by_us:
        write(TrialLog("t", held, {"place": "Neva"}, "T1 = 1\n"), path)
    else:
        written(path, *held)
    found = summary_of(path)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        theirs = reader.get_summary()
        metadata = [m for record in reader.iter_metadata() for m in record.metadata.items()]
        vessels = [attachment.data.decode() for attachment in reader.iter_attachments()]
    assert found is not None
    assert theirs is not None
    assert (found.schemas, found.channels) == (theirs.schemas, theirs.channels)
    assert found.statistics == theirs.statistics
    assert found.metadata == dict(metadata)
    assert found.vessel_toml == (vessels[0] if vessels else None)
    places = found.mcap_chunk_locations()
    assert places is not None
    assert len(places) > 1
    assert [(p.offset, p.first_ns, p.last_ns, p.channel_ids) for p in places] == [
        (i.chunk_start_offset, i.message_start_time, i.message_end_time,
         frozenset(i.message_index_offsets))
        for i in theirs.chunk_indexes
    ]  # fmt: skip
    assert [p.offset for p in places] == [start for start, _ in mcap_chunks(path.read_bytes())]


@pytest.mark.parametrize(
    "options", [{"repeat_channels": False}, {"repeat_schemas": False}, {"use_statistics": False}]
)
def test_one_that_does_not_tell_what_the_file_holds_is_none(
    path: Path, options: dict[str, Any]
) -> None:
    written(path, channel("speed", 100), **options)
    assert summary_of(path) is None


@pytest.mark.parametrize("options", [{"index_types": IndexType.NONE}, {"use_chunking": False}])
def test_where_messages_stand_in_no_indexed_chunk_the_chunks_are_not_told(
    path: Path, options: dict[str, Any]
) -> None:
    written(path, channel("speed", 100), **options)
    found = summary_of(path)
    assert found is not None
    assert found.mcap_chunk_locations() is None


def test_a_bit_flipped_anywhere_in_it_makes_it_none(path: Path) -> None:
    _, data = flushed(path)
    start = next(end for opcode, _, end in top_level(data) if opcode == Opcode.DATA_END)
    rng = np.random.default_rng(0)
    for bit in rng.integers(8 * start, 8 * len(data), 300).tolist():
        path.write_bytes(flipped(data, bit))
        found = summary_of(path)
        in_footers_length = len(data) - 36 <= bit // 8 < len(data) - 28
        assert found is None or in_footers_length


def test_an_unfinished_file_has_none(path: Path) -> None:
    _, data = flushed(path)
    for length in [*range(8, len(data), 97), len(data) - 1]:
        path.write_bytes(data[:length])
        assert summary_of(path) is None


def test_metadata_that_is_not_where_it_should_be_makes_it_none(path: Path) -> None:
    """With no checksum to tell."""
    with path.open("wb") as stream:
        writer = Writer(stream, enable_crcs=False)
        writer.start()
        writer.add_metadata("shiplog", {"place": "Neva"})
        writer.finish()
    assert summary_of(path) is not None
    data = bytearray(path.read_bytes())
    (index,) = (start for opcode, start, _ in top_level(bytes(data)) if opcode == 0x0D)
    data[index + 9 : index + 17] = struct.pack("<Q", 8)  # the header
    path.write_bytes(data)
    assert summary_of(path) is None
