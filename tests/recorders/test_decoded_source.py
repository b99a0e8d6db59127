"""Logs decoded again from their raw packets: new samples where there are packets, all else kept."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from extensions import declare
from number_format import NUMBERS, NumberDecoder

from recorders.decoded_source import open_raw
from recorders.record import record
from recorders.streams.format import GROUP
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.stream_options import parse_options
from recorders.trial.open_source import StreamRequest, open_streams
from shiplog import Channel, LogError, LogWriter, ShiplogError, TrialLog, read
from shiplog.errors import UsageError
from shiplog.mcap.stream import LogFile
from shiplog.types import Event, RawPackets


@pytest.fixture(autouse=True)
def _numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declare(tmp_path / "site", "numbers", GROUP, numbers="number_format:NUMBERS")
    monkeypatch.syspath_prepend(tmp_path / "site")


def _recorded(folder: Path, *names: str, raw: bool = True) -> Path:
    """Record files of 3000 numbers each, of which one line is wrong."""
    requests = []
    for k, name in enumerate(names):
        file = folder / f"{name}.txt"
        lines = [f"heading {n + k}" if n != 7 else "nonsense" for n in range(3000)]
        file.write_text("\n".join(lines), encoding="utf-8")
        options = parse_options(NUMBERS, {"start": k / 100}, name)
        requests.append(StreamRequest(name, NUMBERS, str(file), options, raw, f"{name}."))
    log = folder / "old.mcap"
    record(open_streams(requests, ReceptionClock(), metadata={"ship": "Neva"}), log)
    return log


def _decoded(log: Path) -> TrialLog:
    new = log.with_name("new.mcap")
    record(open_raw(log), new)
    return read(new)


def test_decoding_again_gives_the_same_samples_topics_and_metadata(tmp_path: Path) -> None:
    old = _recorded(tmp_path, "gyro", "compass")
    before, after = read(old), _decoded(old)
    assert {c.topic for c in after} == {c.topic for c in before}
    for channel in before:
        again = after[f"{channel.name}/{channel.source}"]
        assert np.array_equal(again.values, channel.values)
        assert np.array_equal(again.received_ns, channel.received_ns)
    assert after.metadata["ship"] == "Neva"
    assert after.metadata["gyro.rejected.not a number"] == "1"
    assert after.metadata["decoded_from"] == "old.mcap"
    assert len(after.warnings) == len(before.warnings) == 0


def test_a_corrected_decoder_gives_other_samples_of_the_same_packets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = _recorded(tmp_path, "gyro")

    class Halved(NumberDecoder):
        def decode(self, batch, samples):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202 - as the base
            halves = [p._replace(data=p.data.replace(b"1", b"0")) for p in batch]
            super().decode(halves, samples)

    monkeypatch.setattr("number_format.NUMBERS", replace(NUMBERS, make_decoder=lambda _: Halved()))
    assert _decoded(old)["heading"].values[1] == 0.0
    assert read(old)["heading"].values[1] == 1.0


def test_channels_without_packets_and_events_are_kept(tmp_path: Path) -> None:
    times = np.arange(10) * 10**9
    raw = RawPackets("gyro", "numbers", times, tuple(b"heading %d" % n for n in range(10)))
    speed = Channel("speed", "log", "m/s", times, times, np.arange(10.0))
    stale = Channel("rpm", "N", "rpm", times, times, np.arange(10.0), (), {"stream": "gyro"})
    with LogWriter(tmp_path / "old.mcap") as writer:
        writer.write(speed, stale, raw, Event(4 * 10**9, "execute"))
    after = _decoded(tmp_path / "old.mcap")
    assert {c.topic for c in after} == {"/speed/log", "/heading/N"}
    assert after["speed"].values.tolist() == list(range(10))
    assert [event.text for event in after.events] == ["execute"]


def test_a_log_without_packets_is_refused_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no raw packets; record them with --raw"):
        open_raw(_recorded(tmp_path, "gyro", raw=False))


def test_packets_of_a_format_that_is_not_installed_are_refused(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "old.mcap") as writer:
        writer.write(RawPackets("gyro", "runes", np.array([0]), (b"x",)))
    with pytest.raises(ShiplogError, match="no format 'runes'"):
        open_raw(tmp_path / "old.mcap")


def test_a_log_longer_than_memory_is_decoded_in_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    times = np.arange(6000) * 10**7
    with LogWriter(tmp_path / "old.mcap") as writer:
        for first in range(0, 6000, 100):
            part = times[first : first + 100]
            packets = tuple(b"heading %d" % n for n in range(first, first + 100))
            speed = Channel("speed", "log", "m/s", part, part, part * 1e-9)
            stale = Channel("heading", "N", "rad", part, part, part * 0.0, (), {"stream": "gyro"})
            writer.write(speed, stale, RawPackets("gyro", "numbers", part, packets))
            writer.write(Event(int(part[50]), f"mark {first}"))
    in_memory = _decoded(tmp_path / "old.mcap")
    monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 1000)
    monkeypatch.setattr("shiplog.mcap.stream.FILE_CHUNK_SAMPLES", 500)
    assert isinstance(open_raw(tmp_path / "old.mcap").log, LogFile)
    in_file = _decoded(tmp_path / "old.mcap")
    assert in_memory["speed"].values.tolist() == (times * 1e-9).tolist()
    for channel in in_memory:
        again = in_file[f"{channel.name}/{channel.source}"]
        assert again.values.tobytes() == channel.values.tobytes()
        assert again.received_ns.tolist() == channel.received_ns.tolist()
    assert in_file.events == in_memory.events
    assert len(in_file.events) == 60


def test_a_log_is_decoded_again_with_other_options(tmp_path: Path) -> None:
    old = _recorded(tmp_path, "gyro", "compass")
    record(open_raw(old, {"compass.step": "2"}), tmp_path / "new.mcap")
    log = read(tmp_path / "new.mcap")
    assert "gyro.options" not in log.metadata
    assert log.metadata["compass.options"] == "--start=0.01 --step=2.0"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("gyro.stride", "unrecognized arguments: --stride=2"),
        ("log.step", "log.step is no STREAM.OPTION of the log's streams: gyro"),
        ("gyro", "gyro is no STREAM.OPTION"),
    ],
)
def test_a_change_of_no_stream_or_option_is_refused(
    tmp_path: Path, change: str, message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        open_raw(_recorded(tmp_path, "gyro"), {change: "2"})
