"""The conformance files of the MCAP project, and their padded variants, record by record."""

import json
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from padded_mcap import padded
from places import RECORDINGS

from shiplog.cli.main import main
from shiplog.mcap.decompress import mcap_chunk_data
from shiplog.mcap.file_check import check_file
from shiplog.mcap.locate import complete_records
from shiplog.mcap.metadata_record import read_metadata
from shiplog.mcap.record_structure import content_size, read_attachment
from shiplog.mcap.record_walk import RecordWalk
from shiplog.mcap.records import MAGIC, RECORD_HEAD, index_entries

FOLDER = RECORDINGS / "mcap_conformance"
POSITIONS = {  # fields of a padded file that differ from those of the plain one
    "Footer": {"summary_crc", "summary_offset_start", "summary_start"},
    "DataEnd": {"data_section_crc"},
    "SummaryOffset": {"group_start", "group_length"},
    "AttachmentIndex": {"offset", "length"},
    "MetadataIndex": {"offset", "length"},
    "ChunkIndex": {"chunk_start_offset", "chunk_length", "message_index_offsets",
                   "message_index_length", "compressed_size", "uncompressed_size"},
}  # fmt: skip
pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason="the MCAP conformance files are not here"
)

Fields = tuple[str, dict[str, Any]]


@cache
def plain_files() -> dict[str, bytes]:
    return {file.stem: file.read_bytes() for file in sorted(FOLDER.glob("*.mcap"))}


@cache
def padded_files() -> dict[str, bytes]:
    return {f"{name}-pad": padded(data) for name, data in plain_files().items()}


def expected(name: str) -> list[Fields]:
    text = (FOLDER / "expected" / f"{name.removesuffix('-pad')}.json").read_text(encoding="utf-8")
    return [(each["type"], dict(each["fields"])) for each in json.loads(text)["records"]]


def walked(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the records of a file as shiplog reads them, those of MCAP chunks in their place."""
    stream = BytesIO(data)
    check = check_file(stream)
    assert check.is_finished
    assert check.is_intact is not False
    walk = RecordWalk(stream, data_end=check.data_end)
    for record in walk:
        if record.opcode == Opcode.CHUNK:
            chunk = mcap_chunk_data(record.content)
            for opcode, start, end in complete_records(chunk, 0):
                yield opcode, chunk[start + RECORD_HEAD.size : end]
        elif record.opcode == Opcode.MESSAGE_INDEX:
            channel_id, entries = index_entries(record.content)
            for time, offset in entries.tolist():
                assert chunk[offset] == Opcode.MESSAGE
                head = struct.unpack_from("<H4xQ", chunk, offset + RECORD_HEAD.size)
                assert head == (channel_id, time)
        else:
            yield record.opcode, record.content
    assert (walk.is_complete, walk.remarks, walk.gaps) == (True, [], [])
    after = data[: len(data) - len(MAGIC)]
    for opcode, start, end in complete_records(after, walk.end):
        yield opcode, after[start + RECORD_HEAD.size : end]


def parsed(opcode: int, content: bytes) -> Fields:
    """Return the kind of a record and its fields, written as in the expected files."""
    name = Opcode(opcode).name.title().replace("_", "")
    size = content_size(opcode, content)
    assert size is not None
    if opcode == Opcode.ATTACHMENT:
        fields = vars(read_attachment(content))
    elif opcode == Opcode.METADATA:
        fields = vars(read_metadata(content))
    elif opcode == Opcode.MESSAGE:
        fields = vars(records.Message.read(ReadDataStream(BytesIO(content)), len(content)))
    else:
        fields = vars(getattr(records, name).read(ReadDataStream(BytesIO(content))))
    return name, {key: printed(value) for key, value in fields.items()}


def printed(value: object) -> object:
    if isinstance(value, dict):
        return {str(key): printed(each) for key, each in value.items()}
    return list(map(str, value)) if isinstance(value, bytes) else str(value)


def test_every_record_of_every_conformance_file_is_the_expected_one() -> None:
    assert len(plain_files()) == 208
    for name, data in plain_files().items():
        assert [parsed(*each) for each in walked(data)] == expected(name), name


def test_bytes_after_the_fields_of_a_record_change_none_of_them() -> None:
    """Of the padded files; their offsets are verified by what they point to."""
    assert len(padded_files()) == 208
    for name, data in padded_files().items():
        result = [parsed(*each) for each in walked(data)]
        assert [unplaced(each) for each in result] == list(map(unplaced, expected(name))), name
        for kind, fields in result:
            verify_position(data, kind, fields)


def unplaced(record: Fields) -> Fields:
    kind, fields = record
    return kind, {key: value for key, value in fields.items() if key not in POSITIONS.get(kind, ())}


def verify_position(data: bytes, kind: str, fields: dict[str, Any]) -> None:
    targets = {
        "SummaryOffset": ("group_start", fields.get("group_opcode")),
        "AttachmentIndex": ("offset", Opcode.ATTACHMENT),
        "MetadataIndex": ("offset", Opcode.METADATA),
        "ChunkIndex": ("chunk_start_offset", Opcode.CHUNK),
    }
    if kind in targets:
        key, opcode = targets[kind]
        assert data[int(fields[key])] == int(opcode)


@pytest.mark.parametrize("files", [plain_files, padded_files], ids=["plain", "padded"])
def test_info_lists_the_topics_messages_and_times_of_every_conformance_file(
    files: Callable[[], dict[str, bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, data in files().items():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(data)
        assert main(["info", str(path), "--json", "-"]) == 0
        info = json.loads(capsys.readouterr().out)
        assert (info["state"], info["data_lost"], info["channels"]) == ("finished", False, []), name
        assert all("of other programs" in warning for warning in info["warnings"]), name
        listed = [[t["topic"], t["messages"], t["first_ns"], t["last_ns"]] for t in info["foreign"]]
        assert listed == topics(expected(name)), name


def topics(content: list[Fields]) -> list[list[Any]]:
    """Return topic, number of messages, and first and last time of each channel with messages."""
    names = {fields["id"]: fields["topic"] for kind, fields in content if kind == "Channel"}
    messages = [fields for kind, fields in content if kind == "Message"]
    counts = Counter(fields["channel_id"] for fields in messages)
    times = [int(fields["log_time"]) for fields in messages]
    assert len(counts) <= 1  # these files have one channel
    return [[names[id_], count, min(times), max(times)] for id_, count in counts.items()]
