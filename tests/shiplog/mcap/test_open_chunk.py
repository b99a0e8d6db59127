"""Recordings that are flushed often have few MCAP chunks, and a crash loses nothing flushed."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader

from shiplog import Channel, LogWriter, read
from shiplog.mcap.writer import MAX_MCAP_CHUNK_BYTES
from shiplog.types import Event, RawPackets

START = 1_700_000_000_000_000_000


def samples(name: str, unit: str, k: int) -> Channel:
    """Five samples of the k-th quarter of a second."""
    at = START + k * 250_000_000 + np.arange(5) * 50_000_000
    return Channel(name, "x", unit, at, at, k + np.arange(5) / 5)


def packets(k: int) -> RawPackets:
    return RawPackets("x", "nmea0183", samples("speed", "m/s", k).received_ns, (b"$X",) * 5)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


def test_a_file_has_everything_flushed_at_any_time(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    with LogWriter(path, metadata={"place": "Neva"}) as writer:
        for k in range(400):
            writer.write(samples("speed", "m/s", k), packets(k))
            if k >= 7:  # described within the recording
                writer.write(samples("yaw_rate", "rad/s", k))
            if k % 50 == 20:
                writer.write(Event(START + k * 250_000_000, "execute"))
                writer.update_metadata({"k": str(k)})
            writer.flush()
            if k % 13 == 0:
                copy.write_bytes(path.read_bytes())
                log = read(copy)
                assert len(log["speed"]) == 5 * (k + 1)
                assert log["speed"].values[-1] == k + 0.8
                assert k < 7 or len(log["yaw_rate"]) == 5 * (k - 6)
                assert len(log.warnings) == 1
                assert "was not finished" in log.warnings[0]
                assert not log.data_lost
    log = read(path)
    assert not log.warnings
    np.testing.assert_array_equal(
        log["speed"].values, np.add.outer(np.arange(400.0), np.arange(5) / 5).ravel()
    )
    assert log.metadata["k"] == "370"


def test_a_finished_file_satisfies_the_mcap_library(path: Path) -> None:
    with LogWriter(path) as writer:
        for k in range(2000):
            writer.write(samples("speed", "m/s", k), packets(k))
            if k == 600:
                writer.write(samples("yaw_rate", "rad/s", k))
            writer.flush()
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 20_005
        messages = [(c.topic, m.log_time) for _, c, m in reader.iter_messages()]
        assert len(messages) == 20_005
        assert [m for m in messages if m[0] == "/speed/x"] == [
            ("/speed/x", t) for k in range(2000) for t in samples("speed", "m/s", k).received_ns
        ]
        stream.seek(0)
        whole = NonSeekingReader(stream, validate_crcs=True)  # verifies the data section too
        assert sum(1 for _ in whole.iter_messages(log_time_order=False)) == 20_005


def test_flushing_often_gives_few_mcap_chunks_of_bounded_size(path: Path) -> None:
    rng = np.random.default_rng(3)
    with LogWriter(path) as writer:
        for k in range(1200):  # 300 s; and packets of 3 MB in the last 20 s
            writer.write(samples("speed", "m/s", k))
            if k >= 1120:
                writer.write(RawPackets("x", "ais", packets(k).received_ns, (rng.bytes(8000),) * 5))
            writer.flush()
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) <= 10
    for index in summary.chunk_indexes:
        assert index.uncompressed_size < 1.1 * MAX_MCAP_CHUNK_BYTES
        assert index.message_end_time - index.message_start_time <= 61e9


def test_a_file_cut_within_an_open_mcap_chunk_keeps_what_precedes_the_cut(path: Path) -> None:
    ends = []
    writer = LogWriter(path)
    for k in range(40):
        writer.write(samples("speed", "m/s", k))
        writer.flush()
        ends.append(path.stat().st_size)
    whole = path.read_bytes()
    for cut in range(ends[0], len(whole), 37):
        path.write_bytes(whole[:cut])
        flushed = sum(end <= cut for end in ends)
        assert 5 * flushed <= len(read(path)["speed"]) < 5 * (flushed + 1)
    writer.close()


def test_a_pipe_receives_a_log_though_its_head_cannot_be_completed_later(path: Path) -> None:
    code = """
import numpy as np
from shiplog import Channel, LogWriter
with LogWriter("/dev/stdout") as writer:
    for start in range(0, 1000, 100):
        times = np.arange(start, start + 100)
        writer.write(Channel("yaw_rate", "gyro", "rad/s", times, times, times * 0.5))
        writer.flush()
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE)
    path.write_bytes(done.stdout)
    log = read(path)
    assert not log.warnings
    np.testing.assert_array_equal(log["yaw_rate"].values, np.arange(1000) * 0.5)
