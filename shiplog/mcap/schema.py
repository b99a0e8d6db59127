"""How a sample is written: topics, message schemas, metadata keys and the format version.

Every field is fixed-width and `optional`, so that a message has the same length whatever it says
and a column of messages is one numpy array. The descriptors travel in the file: Rerun, Foxglove
and PlotJuggler read it without knowing shiplog.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.message import Message
from numpy.typing import NDArray

from shiplog.types import Channel, FloatArray
from shiplog.units import GEOGRAPHIC

FORMAT_VERSION = "1"
METADATA_NAME = "shiplog"  # of the file's metadata record
VESSEL_ATTACHMENT = "vessel.toml"
ENCODING = "protobuf"

LOCATION_FIX = "foxglove.LocationFix"

_DOUBLE = descriptor_pb2.FieldDescriptorProto.TYPE_DOUBLE
_FIXED_WIDTH = {
    # schema's name: its fields
    "shiplog.Scalar": ("value",),
    "shiplog.Position": ("north", "east"),
}


@dataclass(frozen=True)
class Schema:
    """A message type: its name, its fields, its serialised FileDescriptorSet."""

    name: str
    fields: tuple[str, ...]
    descriptor_set: bytes

    @property
    def dtype(self) -> np.dtype[np.void] | None:
        """The layout of one message where it is fixed: a tag byte before each double."""
        if self.name not in _FIXED_WIDTH:
            return None
        return np.dtype([part for f in self.fields for part in ((f"tag_{f}", "u1"), (f, "<f8"))])

    @property
    def tags(self) -> dict[str, int]:
        """The tag bytes of that layout; a message with others is not laid out so."""
        fixed64 = 1  # the wire type
        return {f"tag_{f}": number << 3 | fixed64 for number, f in enumerate(self.fields, start=1)}


def schema_for(fields: tuple[str, ...]) -> Schema:
    """The schema that carries these components (none: a scalar)."""
    if fields == GEOGRAPHIC:
        return _location_fix()
    for name, its_fields in _FIXED_WIDTH.items():
        if its_fields == (fields or ("value",)):
            return _fixed_width(name)
    raise ValueError(f"no message carries the fields {fields}")


def schema_named(name: str) -> Schema | None:
    """The schema of that name, or None where it is not one of ours."""
    if name == LOCATION_FIX:
        return _location_fix()
    return _fixed_width(name) if name in _FIXED_WIDTH else None


def encode_messages(channel: Channel) -> list[bytes]:
    """The samples of a channel as messages."""
    if schema_for(channel.fields).dtype is None:
        return _encode_fixes(channel)
    rows = np.empty(len(channel), schema_for(channel.fields).dtype)
    fill_rows(rows, channel)
    return [row.tobytes() for row in rows]


def fill_rows(rows: NDArray[np.void], channel: Channel) -> None:
    """Lay out a channel's samples in rows (n,) that have the fields of its schema's dtype."""
    schema = schema_for(channel.fields)
    for tag, value in schema.tags.items():
        rows[tag] = value
    columns = channel.values.reshape(len(channel), len(schema.fields))
    for name, column in zip(schema.fields, columns.T, strict=True):
        rows[name] = column


def decode_messages(schema: Schema, messages: list[bytes]) -> FloatArray:
    """Messages, of whatever length, as values (n, k); a field left out is NaN."""
    message_type = _message_type(schema)
    values = np.full((len(messages), len(schema.fields)), np.nan)
    for row, data in enumerate(messages):
        message = message_type.FromString(data)
        for column, name in enumerate(schema.fields):
            if schema.name == LOCATION_FIX or message.HasField(name):
                values[row, column] = getattr(message, name)
    return values


@cache
def _fixed_width(name: str) -> Schema:
    file = descriptor_pb2.FileDescriptorProto(
        name=f"{name.replace('.', '/')}.proto", package="shiplog", syntax="proto3"
    )
    message = file.message_type.add(name=name.removeprefix("shiplog."))
    for number, field in enumerate(_FIXED_WIDTH[name], start=1):
        message.oneof_decl.add(name=f"_{field}")  # how proto3 spells `optional`
        message.field.add(
            name=field,
            number=number,
            type=_DOUBLE,
            label=descriptor_pb2.FieldDescriptorProto.LABEL_OPTIONAL,
            oneof_index=number - 1,
            proto3_optional=True,
        )
    files = descriptor_pb2.FileDescriptorSet(file=[file])
    return Schema(name, _FIXED_WIDTH[name], files.SerializeToString(deterministic=True))


@cache
def _location_fix() -> Schema:
    """Foxglove's schema for a position on the globe, which viewers draw on a map."""
    proto = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(
        name="foxglove/LocationFix.proto",
        package="foxglove",
        syntax="proto3",
        dependency=["google/protobuf/timestamp.proto"],
    )
    message = file.message_type.add(name="LocationFix")
    kinds = message.enum_type.add(name="PositionCovarianceType")
    for value, label in enumerate(("UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN")):
        kinds.value.add(name=label, number=value)
    one, many = proto.LABEL_OPTIONAL, proto.LABEL_REPEATED
    for number, name, kind, arity, type_name in (
        (1, "latitude", _DOUBLE, one, None),
        (2, "longitude", _DOUBLE, one, None),
        (3, "altitude", _DOUBLE, one, None),
        (4, "position_covariance", _DOUBLE, many, None),
        (5, "position_covariance_type", proto.TYPE_ENUM, one,
         ".foxglove.LocationFix.PositionCovarianceType"),
        (6, "timestamp", proto.TYPE_MESSAGE, one, ".google.protobuf.Timestamp"),
        (7, "frame_id", proto.TYPE_STRING, one, None),
    ):  # fmt: skip
        message.field.add(name=name, number=number, type=kind, label=arity, type_name=type_name)
    timestamp = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(timestamp)
    files = descriptor_pb2.FileDescriptorSet(file=[timestamp, file])
    return Schema(LOCATION_FIX, GEOGRAPHIC, files.SerializeToString(deterministic=True))


@cache
def _message_type(schema: Schema) -> type[Message]:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.descriptor_set).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


def _encode_fixes(channel: Channel) -> list[bytes]:
    message_type = _message_type(_location_fix())
    messages = []
    for stamp, (latitude, longitude, altitude) in zip(
        channel.measured_ns.tolist(), channel.values.tolist(), strict=True
    ):
        fix = message_type(latitude=latitude, longitude=longitude, altitude=altitude)
        fix.timestamp.FromNanoseconds(stamp)  # type: ignore[attr-defined]
        messages.append(fix.SerializeToString(deterministic=True))
    return messages
