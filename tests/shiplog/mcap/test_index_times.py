"""Tests of the times of reception in message indexes, against those of the messages."""

from pathlib import Path

import numpy as np
import pytest
from mcap.writer import IndexType, Writer
from mcap_files import scalar

from shiplog.mcap.index_times import received_in_order
from shiplog.mcap.messages import descriptor_set
from shiplog.mcap.schema import schema_for
from shiplog.mcap.summary import read_summary

SECOND = 1_000_000_000


def in_order(path: Path, times: np.ndarray, *, foreign: bool = False, ids: int = 1) -> bool:
    """Write messages at times of reception, in s, and check their order by the indexes."""
    schema = schema_for(())
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1000, index_types=IndexType.ALL)
        writer.start()
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        encoding = "json" if foreign else "protobuf"
        channels = [
            writer.register_channel("/speed/log", encoding, schema_id, {"id": str(k)})
            for k in range(ids)
        ]
        for k, time in enumerate(times.tolist()):
            writer.add_message(channels[k % ids], int(time * SECOND), scalar(1.0), 0)
        writer.finish()
    with path.open("rb") as stream:
        summary = read_summary(stream)
        assert summary is not None
        return received_in_order(stream, summary)


@pytest.mark.parametrize("ids", [1, 2])
@pytest.mark.parametrize("row", [5, 100, 199])
def test_a_message_received_earlier_than_one_before_is_found(
    tmp_path: Path, row: int, ids: int
) -> None:
    times = 1000.0 + np.arange(200)
    assert in_order(tmp_path / "log.mcap", times, ids=ids)
    times[row] -= 1.5
    assert not in_order(tmp_path / "log.mcap", times, ids=ids)


def test_topics_of_other_programs_may_be_in_any_order(tmp_path: Path) -> None:
    assert in_order(tmp_path / "log.mcap", 1000.0 - np.arange(200), foreign=True)


def test_a_damaged_index_proves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    assert in_order(path, 1000.0 + np.arange(200))
    with path.open("rb") as stream:
        summary = read_summary(stream)
        assert summary is not None
        located = summary.mcap_chunk_locations()
    assert located
    data = bytearray(path.read_bytes())
    data[located[1].offset - 20] ^= 0xFF  # the last entry of the first message index
    path.write_bytes(data)
    with path.open("rb") as stream:
        assert not received_in_order(stream, summary)
