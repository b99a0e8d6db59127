import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_files import (
    START,
    UNIT,
    channel,
    end_mcap_chunk,
    file_records,
    flip_bit,
    is_subset_of,
    mcap_chunk_ranges,
    offset_between,
    position,
    samples,
    samples_by_mcap,
    scalar,
    spoil,
    write_by_mcap,
    write_flushed,
    write_messages,
)
from places import RECORDINGS

import shiplog.mcap.decode
import shiplog.mcap.decompress
from shiplog import Channel, LogError, LogWriter, TrialLog, UsageError, read, write
from shiplog.mcap.messages import descriptor_set
from shiplog.mcap.record_writer import McapRecordWriter, _records_bytes
from shiplog.mcap.schema import schema_for
from shiplog.units import GEOGRAPHIC

CONFORMANCE = RECORDINGS / "mcap_conformance"
ANYWHERE = st.floats(0, 1, exclude_max=True)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "trial.mcap"


# -- compared with the mcap library


def test_the_samples_are_those_that_the_mcap_library_reads_bit_for_bit(path: Path) -> None:
    original = (
        channel("yaw_rate", 30_000, 1),
        channel("yaw_rate", 3000, 2, "imu"),
        channel("winch_force", 500, 3),
        position(100, ("north", "east")),
        position(50, GEOGRAPHIC),
    )
    write(TrialLog("t", original), path)
    assert len(mcap_chunk_ranges(path.read_bytes())) > 1
    assert samples(read(path)) == samples_by_mcap(path) == samples(TrialLog("t", original))


@pytest.mark.parametrize(
    "options",
    [
        {"index_types": IndexType.NONE},
        {"use_chunking": False},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4},
        {"enable_crcs": False},
        {"enable_data_crcs": True},
        {"repeat_channels": False, "repeat_schemas": False},
        {"use_statistics": False, "use_summary_offsets": False},
        {"chunk_size": 100},
    ],
    ids=str,
)
def test_the_samples_are_those_of_the_mcap_library_in_every_file_layout(
    path: Path, options: dict[str, Any]
) -> None:
    original = channel("yaw_rate", 3000, 1), channel("speed", 700, 2), position(30, GEOGRAPHIC)
    write_by_mcap(path, *original, **{"chunk_size": 1 << 14, **options})
    log = read(path)
    by_mcap = samples_by_mcap(path, NonSeekingReader)
    assert samples(log) == by_mcap == samples(TrialLog("t", original))
    assert log.warnings == ()
    assert not log.data_lost


@given(st.lists(st.tuples(st.integers(0, 2), st.floats()), max_size=60), st.integers(1, 500))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_the_samples_are_those_of_the_mcap_library_in_mcap_chunks_of_any_size(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[int, float]], chunk_size: int
) -> None:
    original = []
    for source in range(3):
        at = np.array([k for k, (of, _) in enumerate(rows) if of == source], np.int64)
        values = np.array([value for of, value in rows if of == source])
        original.append(Channel("yaw_rate", str(source), "rad/s", at, at, values))
    path = write_by_mcap(tmp_path_factory.mktemp("any") / "t", *original, chunk_size=chunk_size)
    assert {t: s for t, s in samples(read(path)).items() if s} == samples_by_mcap(path)


def test_samples_are_in_the_order_of_reception(path: Path) -> None:
    received = START + np.array([5, 1, 3, 3, 2])
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        channel_id = writer.register_channel("/speed/log", "protobuf", schema_id, {"unit": "m/s"})
        for k, at in enumerate(received.tolist()):
            writer.add_message(channel_id, at, scalar(k), k)
        writer.finish()
    log = read(path)
    np.testing.assert_array_equal(log["speed"].values, [1, 4, 2, 3, 0])
    np.testing.assert_array_equal(log["speed"].measured_ns, [1, 4, 2, 3, 0])
    np.testing.assert_array_equal(log["speed"].received_ns, np.sort(received))


# -- a part of a file


LAYOUTS: list[dict[str, Any]] = [
    {},
    {"compression": CompressionType.NONE},
    {"index_types": IndexType.NONE},
    {"use_chunking": False},
    {"repeat_channels": False, "repeat_schemas": False},
]


def parts_by_mcap(
    path: Path, topics: list[str], start: int | None, end: int | None
) -> dict[str, list[tuple[int, int, bytes]]]:
    result: dict[str, list[tuple[int, int, bytes]]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream)
        for _, topic, message in reader.iter_messages(topics, starting_at=start, ending_before=end):
            result.setdefault(topic.topic, []).append(
                (message.log_time, message.publish_time, message.data[1:])
            )
    return result


@pytest.mark.parametrize("seed", range(12))
def test_a_part_is_what_the_mcap_library_reads_of_it(path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    original = channel("yaw_rate", 2000, 1), channel("speed", 700, 2), channel("winch_force", 90, 3)
    write_by_mcap(path, *original, chunk_size=int(rng.integers(100, 20_000)))
    topics = rng.choice([c.topic for c in original], rng.integers(1, 4), replace=False).tolist()
    instants = np.concatenate([c.received_ns for c in original])
    start, end = np.sort(rng.choice(instants, 2)).tolist()
    for of, to in ((None, None), (start, None), (None, end), (start, end), (start, start)):
        log = read(path, channels=topics, start_ns=of, end_ns=to)
        assert {c.topic for c in log} == set(topics)
        ours = {topic: rows for topic, rows in samples(log).items() if rows}
        assert ours == parts_by_mcap(path, topics, of, to)


@pytest.mark.parametrize("options", LAYOUTS, ids=str)
@pytest.mark.parametrize("unfinished", [False, True])
def test_a_part_is_the_same_part_of_the_whole_log(
    path: Path, options: dict[str, Any], *, unfinished: bool
) -> None:
    original = (
        channel("speed", 700, 2),
        channel("yaw_rate", 2000, 1),
        channel("yaw_rate", 500, 4, "imu"),
        position(30, GEOGRAPHIC),
    )
    write_by_mcap(path, *original, **{"chunk_size": 1 << 12, **options})
    if unfinished:
        path.write_bytes(path.read_bytes()[:-10])
    log = read(path)
    start, end = (int(t) for t in log["speed"].received_ns[[100, 400]])
    for keys in (None, ("yaw_rate",), ("yaw_rate/imu", "speed", "/speed/test"), ("position",), ()):
        kept = log.channels if keys is None else [log[key] for key in keys]
        part = read(path, channels=keys, start_ns=start, end_ns=end)
        expected = []
        for c in log:
            within_it = (c.received_ns >= start) & (c.received_ns < end)
            if any(c is one for one in kept):
                expected.append((c.topic, c.received_ns[within_it], c.values[within_it]))
        assert [c.topic for c in part] == [topic for topic, *_ in expected]
        for c, (_, received, values) in zip(part, expected, strict=True):
            np.testing.assert_array_equal(c.received_ns, received)
            np.testing.assert_array_equal(c.values, values)
        assert part.metadata == log.metadata
        assert part.warnings == log.warnings


def test_only_the_mcap_chunks_of_the_part_and_those_at_the_ends_are_decompressed(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("yaw_rate", "speed") * 5
    with LogWriter(path) as writer:
        for number, name in enumerate(names):
            at = START + 1000 * number + np.arange(100)
            writer.write(Channel(name, "test", UNIT[name], at, at, np.full(100, float(number))))
            end_mcap_chunk(writer)
    inflated: list[int] = []
    inflate = shiplog.mcap.decompress._decompress
    monkeypatch.setattr(
        shiplog.mcap.decompress, "_decompress", lambda *of: inflated.append(of[2]) or inflate(*of)
    )
    speed = read(path, channels=["speed"])["speed"]
    assert len(inflated) == 5 + 1
    assert np.unique(speed.values).tolist() == [1, 3, 5, 7, 9]
    inflated.clear()
    later = read(path, channels=["speed"], start_ns=START + 3099, end_ns=START + 7000)["speed"]
    assert len(inflated) == 2 + 2
    assert later.values.tolist() == [3, *[5] * 100]
    inflated.clear()
    assert len(read(path, start_ns=START + 2000, end_ns=START + 4000)["yaw_rate"]) == 100
    assert len(inflated) == 2 + 2


def test_the_index_of_a_skipped_mcap_chunk_is_not_used_for_another(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with LogWriter(path) as writer:
        for number in range(6):
            at = START + 1000 * number + np.arange(100)
            here = [Channel("speed", "test", "m/s", at, at, np.ones(100))]
            if number % 2 == 0:  # two sizes of messages: located by the index
                values = np.ones((100, 2))
                here.append(Channel("position", "x", "m", at, at, values, ("north", "east")))
            writer.write(*here)
            end_mcap_chunk(writer)
    monkeypatch.delattr(shiplog.mcap.decode, "_locate_by_walk")
    assert len(read(path, channels=["position"])["position"]) == 300


def test_damage_is_reported_in_the_mcap_chunks_of_the_part_only(path: Path) -> None:
    names = ("yaw_rate", "speed") * 3
    with LogWriter(path) as writer:
        for number, name in enumerate(names):
            at = START + 1000 * number + np.arange(100)
            writer.write(Channel(name, "test", UNIT[name], at, at, np.ones(100)))
            end_mcap_chunk(writer)
    data = path.read_bytes()
    start, end = mcap_chunk_ranges(data)[2]
    path.write_bytes(spoil(data, (start + end) // 2))
    assert read(path, channels=["speed"]).warnings == ()
    assert len(read(path, channels=["speed"])["speed"]) == 300
    part = read(path, channels=["yaw_rate"])
    assert len(part["yaw_rate"]) == 200
    assert f"damaged at bytes {start} to {end}: lost 100 messages of /yaw_rate" in part.warnings[0]
    assert part.data_lost


@pytest.mark.parametrize("cut", [0, 10])
def test_a_part_with_a_missing_channel_is_rejected(path: Path, cut: int) -> None:
    write_by_mcap(path, channel("speed", 100))
    path.write_bytes(path.read_bytes()[: path.stat().st_size - cut])
    with pytest.raises(LogError, match=r"no channel 'yaw_rate' in trial\.mcap; it has speed"):
        read(path, channels=["speed", "yaw_rate"])


# -- files of other programs

conformance = pytest.mark.skipif(
    not CONFORMANCE.is_dir(), reason="the MCAP conformance files are not here"
)


def conforming() -> list[Path]:
    return sorted(CONFORMANCE.glob("*.mcap"))


@conformance
@pytest.mark.parametrize("step", [1, 7])
def test_a_conformance_file_cut_anywhere_is_read_as_unfinished(tmp_path: Path, step: int) -> None:
    cut = tmp_path / "cut.mcap"
    for file in conforming()[::40] if step == 1 else conforming()[::7]:
        data = file.read_bytes()
        for length in range(8, len(data) - 8, step):
            cut.write_bytes(data[:length])
            assert any("was not finished" in warning for warning in read(cut).warnings)


@conformance
def test_a_conformance_file_with_any_byte_changed_is_read_or_rejected(tmp_path: Path) -> None:
    changed = tmp_path / "changed.mcap"
    for file in conforming()[::20]:
        for at in range(8, file.stat().st_size, 3):
            data = bytearray(file.read_bytes())
            data[at] ^= 0xFF
            changed.write_bytes(data)
            _read_or_rejected(changed)


def _read_or_rejected(path: Path) -> TrialLog | None:
    try:
        return read(path)
    except LogError:
        return None


def test_topics_of_other_programs_are_ignored_with_a_warning(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        json_schema = writer.register_schema("Imu", "jsonschema", b"{}")
        image = writer.register_schema("foxglove.Image", "protobuf", b"")
        ids = [
            writer.register_channel("/imu", "json", json_schema),
            writer.register_channel("/camera", "protobuf", image),
            writer.register_channel("/raw", "", 0),
        ]
        for channel_id in ids:
            writer.add_message(channel_id, START, b'{"x": 1}', START)
        writer.finish()
    log = read(path)
    assert log.channels == ()
    assert log.warnings == ("ignored 3 topics of other programs: /imu, /camera, /raw",)


def test_a_channel_in_another_unit_is_converted(path: Path) -> None:
    write_messages(path, [scalar(180.0), scalar(-90.0)], unit="deg/s")
    yaw_rate = read(path)["yaw_rate"]
    assert yaw_rate.unit == "rad/s"
    np.testing.assert_allclose(yaw_rate.values, [np.pi, -np.pi / 2], rtol=1e-15)


def test_a_channel_that_is_not_in_the_catalogue_keeps_its_unit(path: Path) -> None:
    write_messages(path, [scalar(3.0)], unit="kN", topic="/winch_force/shaft")
    winch_force = read(path)["winch_force"]
    assert (winch_force.unit, winch_force.source, winch_force.values[0]) == ("kN", "shaft", 3.0)


@pytest.mark.parametrize("unit", ["deg/sec", "m", None])
def test_an_unknown_unit_is_an_error_that_names_channel_and_file(
    path: Path, unit: str | None
) -> None:
    write_messages(path, [scalar(1.0)], unit=unit)
    with pytest.raises(LogError) as caught:
        read(path)
    message = str(caught.value)
    assert message.startswith("channel 'yaw_rate' should be in rad/s: ")
    assert repr(unit or "1") in message
    assert message.endswith(str(path))
    assert unit != "deg/sec" or "did you mean 'deg/s'?" in message


def test_a_message_without_its_value_is_nan(path: Path) -> None:
    write_messages(path, [scalar(1.0), b"", scalar(2.0)])
    np.testing.assert_array_equal(read(path)["yaw_rate"].values, [1.0, np.nan, 2.0])


def test_a_message_of_the_same_length_with_another_field_is_nan(path: Path) -> None:
    write_messages(path, [scalar(1.0), scalar(9.0, tag=0x11)])
    np.testing.assert_array_equal(read(path)["yaw_rate"].values, [1.0, np.nan])


def test_malformed_messages_are_dropped_and_counted(path: Path) -> None:
    write_messages(path, [scalar(1.0), b"\x09\x00", scalar(2.0), b"\xff"])
    for log in (read(path), read(path, channels=["yaw_rate"])):
        np.testing.assert_array_equal(log["yaw_rate"].values, [1.0, 2.0])
        assert log.data_lost
        assert "2 messages are not shiplog.Scalar and were dropped" in " ".join(log.warnings)


def test_a_file_of_a_later_format_asks_for_a_newer_shiplog(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.add_metadata("shiplog", {"format_version": "2"})
        writer.finish()
    with pytest.raises(LogError, match="format 2, this shiplog reads format 1; install a newer"):
        read(path)


def test_messages_beyond_the_signed_range_of_times_are_dropped_and_counted(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = schema_for(())
        schema_id = writer.register_schema(schema.name, "protobuf", descriptor_set(schema))
        for topic, data in (("/a/b", scalar(1.0)), ("/c/d", b"")):
            channel_id = writer.register_channel(topic, "protobuf", schema_id)
            writer.add_message(channel_id, 2**64 - 1, data, 2**63)
        writer.finish()
    log = read(path)
    assert [len(c) for c in log] == [0, 0]
    assert [w.split(" samples")[0] for w in log.warnings] == ["/a/b: 1 of 1", "/c/d: 1 of 1"]


# -- files that are not logs


@pytest.mark.parametrize(
    ("contents", "error"),
    [
        (b"", "the file is empty"),
        (b"\x89MCA", "not an MCAP file"),
        (b"time,yaw_rate\n0,1\n", "not an MCAP file; `shiplog convert` reads tables"),
    ],
)
def test_a_file_that_is_not_mcap_is_rejected(path: Path, contents: bytes, error: str) -> None:
    path.write_bytes(contents)
    with pytest.raises(LogError, match=rf"{error}.*trial\.mcap"):
        read(path)


def test_a_missing_file_and_a_folder_are_rejected_by_name(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"no such file: .*nowhere"):
        read(tmp_path / "nowhere")
    with pytest.raises(LogError, match="a folder, not a log"):
        read(tmp_path)


def test_the_magic_bytes_alone_are_an_unfinished_empty_log(path: Path) -> None:
    path.write_bytes(b"\x89MCAP0\r\n")
    log = read(path)
    assert log.channels == ()
    assert len(log.warnings) == 1
    assert "was not finished" in log.warnings[0]


# -- damage


def test_an_unfinished_flushed_file_is_read_whole(path: Path) -> None:
    original, data = write_flushed(path)
    (end,) = (start for opcode, start, _ in file_records(data) if opcode == Opcode.DATA_END)
    path.write_bytes(data[:end])
    log = read(path)
    assert samples(log) == samples(original)
    assert log.metadata["place"] == "Neva"
    assert len(log.warnings) == 1
    assert "was not finished" in log.warnings[0]
    assert "its 1000 complete samples were read" in log.warnings[0]
    assert not log.data_lost


def complete_messages(data: bytes, cut: int, compression: str) -> int:
    """Count the complete messages that a plain decompressor finds before the cut."""
    whole = 0
    for start, end in mcap_chunk_ranges(data):
        body = start + 9 + 32 + len(compression) + 8
        content = data[body : min(end, cut)] if cut > body else b""
        if compression == "zstd":
            content = zstandard.ZstdDecompressor().decompressobj().decompress(content)
        at = 0
        while at + 9 <= len(content):
            opcode, length = struct.unpack_from("<BQ", content, at)
            at += 9 + length
            whole += opcode == Opcode.MESSAGE and at <= len(content)
    return whole


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.NONE])
def test_a_file_cut_anywhere_keeps_every_complete_message_before_the_cut(
    path: Path, compression: CompressionType
) -> None:
    # random values: trailing zeros would hide where an uncompressed file ends
    values = np.random.default_rng(0).normal(size=12_000)
    at = START + np.arange(12_000)
    original = Channel("yaw_rate", "gyro", "rad/s", at, at, values)
    data = write_by_mcap(path, original, compression=compression, chunk_size=1 << 18).read_bytes()
    assert len(mcap_chunk_ranges(data)) >= 2
    name = "zstd" if compression == CompressionType.ZSTD else ""
    edges = [
        edge + d for pair in mcap_chunk_ranges(data) for edge in pair for d in (-1, 0, 1, 9, 41, 60)
    ]
    cuts = [*edges, *np.random.default_rng(1).integers(8, len(data), 60).tolist()]
    for cut in sorted({c for c in cuts if 8 <= c < len(data)}):
        path.write_bytes(data[:cut])
        log = read(path)
        yaw_rate = log.get("yaw_rate")
        count = 0 if yaw_rate is None else len(yaw_rate)
        assert count == complete_messages(data, cut, name), cut
        if yaw_rate is not None:
            np.testing.assert_array_equal(yaw_rate.values, values[:count])
            np.testing.assert_array_equal(yaw_rate.measured_ns, at[:count])
        assert any("was not finished" in warning for warning in log.warnings)
        assert log.data_lost == (cut not in {end for _, _, end in file_records(data)})


@given(ANYWHERE, st.sampled_from([0, 1, 4096]))
@settings(derandomize=True, deadline=None, max_examples=150)
def test_zeros_from_any_point_on_lose_only_what_follows_and_add_no_samples(
    damaged: tuple[TrialLog, bytes, Path], where: float, zeros: int
) -> None:
    original, whole, path = damaged
    cut = offset_between(where, 8, len(whole))
    path.write_bytes(whole[:cut] + bytes(zeros or len(whole) - cut))
    log = read(path)
    assert is_subset_of(log, original)
    assert log.warnings
    kept = sum(cut >= end for _, end in mcap_chunk_ranges(whole))
    assert all(len(c) >= 100 * kept for c in log)
    assert not kept or len(log.channels) == 2


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> tuple[TrialLog, bytes, Path]:
    path = tmp_path_factory.mktemp("damaged") / "trial.mcap"
    return *write_flushed(path), path


@given(ANYWHERE, ANYWHERE, st.booleans())
@settings(derandomize=True, deadline=None, max_examples=120)
def test_a_byte_damaged_anywhere_in_the_data_is_reported_and_adds_no_samples(
    damaged: tuple[TrialLog, bytes, Path],
    record: float,
    where: float,
    in_its_head: bool,
) -> None:
    original, whole, path = damaged
    opcodes = [opcode for opcode, _, _ in file_records(whole)]
    _, start, end = file_records(whole)[offset_between(record, 0, opcodes.index(Opcode.DATA_END))]
    if in_its_head:  # which no checksum of an MCAP chunk protects
        end = min(end, start + 60)
    path.write_bytes(spoil(whole, offset_between(where, start, end)))
    log = read(path)
    assert is_subset_of(log, original)
    assert any(text.startswith("damaged at ") for text in log.warnings)
    assert log.data_lost or samples(log) == samples(original)


@given(ANYWHERE)
@settings(derandomize=True, deadline=None, max_examples=60)
def test_a_bit_flipped_anywhere_in_the_data_is_corrected(
    damaged: tuple[TrialLog, bytes, Path], where: float
) -> None:
    original, whole, path = damaged
    data_end = next(end for opcode, _, end in file_records(whole) if opcode == Opcode.DATA_END)
    bit = offset_between(where, 0, 8 * (data_end - 13))
    path.write_bytes(flip_bit(whole, bit))
    log = read(path)
    assert samples(log) == samples(original)
    assert any(f"damaged at byte {bit // 8}: one bit was wrong" in text for text in log.warnings)
    assert not log.data_lost
    part = read(path, channels=["speed"])
    assert samples(part) == {"/speed/test": samples(original)["/speed/test"]}
    assert part.warnings == log.warnings


def test_a_bit_flipped_in_a_message_loses_its_mcap_chunk_only(path: Path) -> None:
    original, data = write_flushed(path)
    start, end = mcap_chunk_ranges(data)[2]
    path.write_bytes(spoil(data, (start + end) // 2))
    log = read(path)
    assert samples(log) == {t: rows[:200] + rows[300:] for t, rows in samples(original).items()}
    (warning,) = log.warnings
    where = f"damaged at bytes {start} to {end}: "
    what = "lost 200 messages of /yaw_rate/test, /speed/test received from 2023-11-14T"
    assert warning.startswith(where + what)


def test_a_damaged_first_mcap_chunk_does_not_lose_the_others(path: Path) -> None:
    original, data = write_flushed(path)
    _, end = mcap_chunk_ranges(data)[0]
    path.write_bytes(spoil(data, end - 20))
    log = read(path)
    assert samples(log) == {topic: rows[100:] for topic, rows in samples(original).items()}
    assert len(log.warnings) == 1


@pytest.mark.parametrize("number", range(5))
def test_each_mcap_chunk_can_be_read_alone(path: Path, number: int) -> None:
    original, data = write_flushed(path)
    for n, (start, end) in enumerate(mcap_chunk_ranges(data)):
        if n != number:
            data = flip_bit(data, 4 * (start + end))
    path.write_bytes(data)
    rows = slice(100 * number, 100 * (number + 1))
    assert samples(read(path)) == {t: r[rows] for t, r in samples(original).items()}


def test_lost_samples_without_a_channel_description_are_counted(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other recorders describe a channel only once."""

    def described_once(self: McapRecordWriter) -> bytes:
        undescribed, self._undescribed = self._undescribed, []
        return _records_bytes(undescribed)

    monkeypatch.setattr(McapRecordWriter, "_all_descriptions", described_once)
    _, data = write_flushed(path)
    _, end = mcap_chunk_ranges(data)[0]
    (data_end,) = (begin for opcode, begin, _ in file_records(data) if opcode == Opcode.DATA_END)
    path.write_bytes(spoil(data, end - 20)[:data_end])
    log = read(path)
    assert log.channels == ()
    assert "lost 800 samples: the description of their channel" in log.warnings[1]


@given(ANYWHERE)
@settings(derandomize=True, deadline=None, max_examples=120)
def test_a_bit_flipped_in_the_summary_is_reported_and_loses_no_sample(
    damaged: tuple[TrialLog, bytes, Path], where: float
) -> None:
    original, whole, path = damaged
    first = next(end for opcode, _, end in file_records(whole) if opcode == Opcode.DATA_END)
    path.write_bytes(flip_bit(whole, offset_between(where, 8 * first, 8 * len(whole))))
    log = read(path)
    assert [samples(TrialLog("t", (c,))) for c in log if len(c)] == [
        samples(TrialLog("t", (c,))) for c in original
    ]
    assert log.warnings


def test_an_index_that_has_a_message_twice_is_not_used(path: Path) -> None:
    original, data = write_flushed(path)
    indexes = [r for r in file_records(data) if r[0] == Opcode.MESSAGE_INDEX]
    _, start, _ = indexes[4]
    entry = start + 9 + 6
    changed = bytearray(data)
    changed[entry + 8 : entry + 16] = changed[entry + 24 : entry + 32]
    path.write_bytes(bytes(changed))
    log = read(path)
    assert samples(log) == samples(original)
    assert any("a message index is wrong" in warning for warning in log.warnings)
    assert not log.data_lost


def test_an_index_of_another_channel_is_not_used(path: Path) -> None:
    original, data = write_flushed(path)
    indexes = [r for r in file_records(data) if r[0] == Opcode.MESSAGE_INDEX]
    changed = bytearray(data)
    for _, start, _ in indexes[4:6]:
        changed[start + 9] ^= 3  # exchange channels 1 and 2
    path.write_bytes(bytes(changed))
    log = read(path)
    assert samples(log) == samples(original)
    assert any("a message index is wrong" in warning for warning in log.warnings)


@pytest.mark.parametrize("noise", [bytes, lambda n: np.random.default_rng(0).bytes(n)])
def test_any_bytes_after_the_magic_are_read_or_rejected(
    path: Path, noise: Callable[[int], bytes]
) -> None:
    for opcode in range(256):
        for length in (0, 4, 8, 40, 100):
            for body in (noise(length), b"\xff" * length):
                record = struct.pack("<BQ", opcode, length) + body
                path.write_bytes(b"\x89MCAP0\r\n" + record + noise(20))
                _read_or_rejected(path)


def test_reading_leaves_the_file_free_to_be_replaced_or_removed(path: Path) -> None:
    write(TrialLog("t", (channel("speed", 1000),)), path)
    log = read(path)
    before = samples(log)
    path.write_bytes(b"other")
    path.unlink()
    assert samples(log) == before


def test_a_topic_described_twice_is_one_channel(tmp_path: Path) -> None:
    """A recorder that is restarted within one file writes such files."""
    path = tmp_path / "twice.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        scalar = schema_for(())
        schema_id = writer.register_schema(scalar.name, "protobuf", descriptor_set(scalar))
        for start in (0, 100):
            metadata = {"unit": "rad/s", "channel": "yaw_rate", "source": "gyro"}
            channel_id = writer.register_channel("/yaw_rate/gyro", "protobuf", schema_id, metadata)
            for k in range(start, start + 100):
                data = b"\x09" + struct.pack("<d", k)
                writer.add_message(channel_id, k * 10**8, data, k * 10**8)
        writer.finish()
    log = read(path)
    assert len(log.channels) == 1
    assert log["yaw_rate"].values.tolist() == list(range(200))


def test_one_channel_may_be_named_without_a_tuple(path: Path) -> None:
    stamps = np.arange(5) * 10**9
    both = [Channel(n, "a", "1", stamps, stamps, np.arange(5.0)) for n in ("speed", "rpm")]
    write(TrialLog("x", (replace(both[0], unit="m/s"), replace(both[1], unit="rpm"))), path)
    assert [c.name for c in read(path, channels="rpm")] == ["rpm"]
    with pytest.raises(UsageError, match="end_ns 1 is before start_ns 2; exchange them"):
        read(path, start_ns=2, end_ns=1)
