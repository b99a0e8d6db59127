from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer

from shiplog import Channel, LogWriter, read
from shiplog.tables.convert import convert
from shiplog.types import RawPackets

START_NS = 1_700_000_000 * 10**9
N = 50
TIMES_NS = START_NS + np.arange(N) * 10**9


def mixed_file(path: Path) -> Path:
    """Write a log of shiplog with topics, an attachment and metadata of other programs."""
    own = path.with_name("own.mcap")
    with LogWriter(own, metadata={"place": "Neva"}, vessel_toml="length = 1.0") as log:
        log.write(
            Channel("rudder", "feedback", "rad", TIMES_NS, TIMES_NS, np.linspace(0, 1, N)),
            RawPackets("gyro", "nmea0183", TIMES_NS, (b"$HEROT,1.5,A*2E",) * N),
        )
    with path.open("wb") as stream, own.open("rb") as source:
        writer = Writer(stream)
        writer.start()
        reader = make_reader(source)
        for schema, channel, message in reader.iter_messages():
            schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
            channel_id = writer.register_channel(
                channel.topic, channel.message_encoding, schema_id, channel.metadata
            )
            writer.add_message(channel_id, message.log_time, message.data, message.publish_time)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for attachment in reader.iter_attachments():
            writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
        for name in ("A", "B", ""):  # one topic with two types and none
            schema_id = writer.register_schema(name, "jsonschema", name.encode()) if name else 0
            channel_id = writer.register_channel("/odd", "json", schema_id, {"key": name})
            for i, at in enumerate(TIMES_NS.tolist()):
                writer.add_message(channel_id, at + 5, f"{i}{name}".encode(), at + 3)
        writer.add_attachment(7, 9, "photo.jpg", "image/jpeg", b"\xff\xd8")
        writer.add_metadata("rosbag2", {"version": "8"})
        writer.finish()
    return path


def foreign_content(path: Path) -> tuple[list[object], list[object], list[object]]:
    """Return messages of others and raw packets, attachments and metadata, by the mcap library."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        messages: list[object] = [
            (channel.topic, channel.message_encoding, tuple(sorted(channel.metadata.items())),
             schema and (schema.name, schema.encoding, schema.data),
             message.log_time, message.publish_time, message.data)
            for schema, channel, message in reader.iter_messages()
            if channel.topic in ("/odd", "/raw/gyro")
        ]  # fmt: skip
        attachments: list[object] = [
            (each.name, each.media_type, each.log_time, each.create_time, each.data)
            for each in reader.iter_attachments()
        ]
        metadata: list[object] = [
            (each.name, each.metadata) for each in reader.iter_metadata() if each.name == "rosbag2"
        ]
    return sorted(messages, key=repr), attachments, metadata


def test_a_copy_keeps_topics_attachments_and_metadata_of_other_programs(tmp_path: Path) -> None:
    source = mixed_file(tmp_path / "mixed.mcap")
    log, warnings = convert(source, tmp_path / "copy.mcap")
    messages, attachments, metadata = foreign_content(source)
    assert len(messages) == 4 * N
    copied, attachments_copied, metadata_copied = foreign_content(tmp_path / "copy.mcap")
    assert copied == messages
    assert sorted(attachments_copied, key=repr) == sorted(attachments, key=repr)
    assert metadata_copied == metadata == [("rosbag2", {"version": "8"})]
    assert warnings == []
    copy = read(tmp_path / "copy.mcap")
    np.testing.assert_array_equal(copy["rudder"].values, log["rudder"].values)
    assert copy.vessel_toml == "length = 1.0"
    assert copy.metadata["place"] == "Neva"


def test_a_cut_keeps_the_messages_received_within_it(tmp_path: Path) -> None:
    source = mixed_file(tmp_path / "mixed.mcap")
    convert(source, tmp_path / "part.mcap", start=10, end=20)
    messages, attachments, _ = foreign_content(tmp_path / "part.mcap")
    times = {item[4] for item in messages}  # type: ignore[index]
    assert min(times) >= TIMES_NS[10]
    assert max(times) < TIMES_NS[20]
    assert len(messages) == 4 * 10
    assert ("photo.jpg", "image/jpeg", 9, 7, b"\xff\xd8") in attachments


def test_a_second_copy_is_the_first_to_the_byte(tmp_path: Path) -> None:
    convert(mixed_file(tmp_path / "mixed.mcap"), tmp_path / "a.mcap")
    convert(tmp_path / "a.mcap", tmp_path / "b.mcap")
    convert(tmp_path / "b.mcap", tmp_path / "c.mcap")
    assert (tmp_path / "b.mcap").read_bytes() == (tmp_path / "c.mcap").read_bytes()


def test_what_a_table_or_a_layout_does_not_keep_is_named(tmp_path: Path) -> None:
    source = mixed_file(tmp_path / "mixed.mcap")
    _, warnings = convert(source, tmp_path / "table.csv")
    texts = " ".join(warnings)
    assert "topics of other programs: /odd" in texts
    assert "only a copy in MCAP keeps: attachment 'photo.jpg', metadata 'rosbag2'" in texts
    layout = tmp_path / "layout.toml"
    layout.write_text("[rpm]\ntopic = '/odd'\ntype = 'A'\nfield = 'x'\nunit = 'rpm'\n")
    with (tmp_path / "bag.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("A", "jsonschema", b"{}")
        for topic in ("/odd", "/camera"):
            channel = writer.register_channel(topic, "json", schema)
            for at in TIMES_NS.tolist():
                writer.add_message(channel, at, b'{"x": 1}', at)
        writer.add_metadata("rosbag2", {"version": "8"})
        writer.finish()
    _, warnings = convert(tmp_path / "bag.mcap", tmp_path / "trial.mcap", layout)
    assert warnings == ["ignored 1 topics of other programs: /camera"]
    messages, _, metadata = foreign_content(tmp_path / "trial.mcap")
    assert (messages, metadata) == ([], [("rosbag2", {"version": "8"})])
