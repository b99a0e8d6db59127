"""MCAP files of other programs, written by the libraries of those programs."""

import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from shiplog.mcap.messages import descriptor_set, encode_messages
from shiplog.mcap.schema import schema_for
from shiplog.types import Channel
from shiplog.units import GEOGRAPHIC

START_NS = 1_700_000_000 * 10**9
STEP_NS = 10**8
RECEPTION_NS = 5_000_000  # after the stamp
PUBLICATION_NS = 2_000_000


def stamp(number: int) -> dict[str, int]:
    """Return the stamp of a message of ROS 2 by its number."""
    at = START_NS + number * STEP_NS
    return {"sec": at // 10**9, "nanosec": at % 10**9}


@cache
def definition(name: str) -> str:
    """Return the definition of a type of ROS 2."""
    return get_typestore(Stores.ROS2_JAZZY).generate_msgdef(name, ros_version=2)[0]


def write_ros2(path: Path, topics: Mapping[str, tuple[str, Iterable[Any]]]) -> Path:
    """Write messages of ROS 2: by topic their type and the messages, 0.1 s apart."""
    with path.open("wb") as stream, Ros2Writer(stream) as writer:
        for topic, (name, messages) in topics.items():
            schema = writer.register_msgdef(name, definition(name))
            for number, message in enumerate(messages):
                at = START_NS + number * STEP_NS
                writer.write_message(topic, schema, message, at + RECEPTION_NS, at + PUBLICATION_NS)
    return path


def write_messages(
    path: Path,
    messages: Iterable[bytes],
    *,
    topic: str = "/data",
    encoding: str = "json",
    schema: tuple[str, str, bytes] | None = None,
) -> Path:
    """Write serialised messages of one topic, with the name, encoding and data of its schema."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema_id = writer.register_schema(*schema) if schema else 0
        channel = writer.register_channel(topic, encoding, schema_id)
        for number, data in enumerate(messages):
            at = START_NS + number * STEP_NS
            writer.add_message(channel, at + RECEPTION_NS, data, at + PUBLICATION_NS)
        writer.finish()
    return path


def write_json(path: Path, messages: Iterable[Any]) -> Path:
    """Write messages in JSON."""
    return write_messages(path, (json.dumps(message).encode() for message in messages))


def write_location_fixes(path: Path, number: int) -> tuple[Path, np.ndarray]:
    """Write fixes of the type of Foxglove at their stamps, and return them too."""
    at = START_NS + STEP_NS * np.arange(number)
    columns = [54.0 + np.arange(number) * 1e-5, np.full(number, 10.0), np.full(number, 3.0)]
    fixes = np.column_stack(columns)
    schema = schema_for(GEOGRAPHIC)
    data = encode_messages(Channel("position", "x", "deg", at, at, fixes, GEOGRAPHIC))
    described = (schema.name, "protobuf", descriptor_set(schema))
    bag = write_messages(path, data, topic="/gps", encoding="protobuf", schema=described)
    return bag, fixes


def protobuf_type() -> tuple[tuple[str, str, bytes], Callable[..., Any]]:
    """Return the schema of a message with nested, optional and repeated fields, and its class."""
    kinds = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(
        name="ship/Motion.proto",
        package="ship",
        syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )
    inner = file.message_type.add(name="Rates")
    inner.field.add(name="z", number=1, type=kinds.TYPE_FLOAT, label=kinds.LABEL_OPTIONAL)
    motion = file.message_type.add(name="Motion")
    motion.oneof_decl.add(name="_rpm")
    for name, number, kind, label, type_name in (
        ("timestamp", 1, kinds.TYPE_MESSAGE, kinds.LABEL_OPTIONAL, ".google.protobuf.Timestamp"),
        ("rates", 2, kinds.TYPE_MESSAGE, kinds.LABEL_OPTIONAL, ".ship.Rates"),
        ("rudders", 3, kinds.TYPE_DOUBLE, kinds.LABEL_REPEATED, None),
        ("name", 5, kinds.TYPE_STRING, kinds.LABEL_OPTIONAL, None),
    ):
        motion.field.add(name=name, number=number, type=kind, label=label, type_name=type_name)
    motion.field.add(
        name="rpm",
        number=4,
        type=kinds.TYPE_DOUBLE,
        label=kinds.LABEL_OPTIONAL,
        oneof_index=0,
        proto3_optional=True,
    )
    stamps = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(stamps)
    pool = descriptor_pool.DescriptorPool()
    files = descriptor_pb2.FileDescriptorSet(file=[stamps, file])
    for each in files.file:
        pool.Add(each)
    message = message_factory.GetMessageClass(pool.FindMessageTypeByName("ship.Motion"))
    return ("ship.Motion", "protobuf", files.SerializeToString()), message
