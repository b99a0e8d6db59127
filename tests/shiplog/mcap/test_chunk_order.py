"""MCAP chunks that were exchanged after the recording are put in order by sequence numbers."""

from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap_files import file_records, mcap_chunk_ranges, samples, write_flushed

from shiplog import read


@pytest.mark.parametrize("order", [(1, 0, 2, 3, 4), (4, 3, 2, 1, 0), (2, 3, 4, 0, 1)])
def test_exchanged_mcap_chunks_keep_their_times(tmp_path: Path, order: tuple[int, ...]) -> None:
    path = tmp_path / "trial.mcap"
    original, data = write_flushed(path)
    starts = [start for start, _ in mcap_chunk_ranges(data)]
    end = next(start for opcode, start, _ in file_records(data) if opcode == Opcode.DATA_END)
    groups = [data[a:b] for a, b in zip(starts, [*starts[1:], end], strict=True)]
    middle = b"".join(groups[number] for number in order)
    path.write_bytes(data[: starts[0]] + middle + data[end:])
    log = read(path)
    assert samples(log) == samples(original)
    assert any("not in the order in which they were written" in text for text in log.warnings)
    assert not log.data_lost


@pytest.mark.parametrize("cut", [False, True])
def test_a_repeated_mcap_chunk_is_read_once(tmp_path: Path, *, cut: bool) -> None:
    path = tmp_path / "trial.mcap"
    original, data = write_flushed(path)
    start, end = mcap_chunk_ranges(data)[1]
    last = next(start for opcode, start, _ in file_records(data) if opcode == Opcode.DATA_END)
    path.write_bytes(data[:last] + data[start:end] + (b"" if cut else data[last:]))
    log = read(path)
    assert samples(log) == samples(original)
    assert any(f"the MCAP chunk at byte {start} is there again" in text for text in log.warnings)
