"""Message schemas of a log, its topics' metadata keys, and the format version.

Every field is fixed-width and `optional`, so that all messages of a schema have the same length
whatever their values, and a column of messages is one numpy array. The protobuf descriptors are in
the file: Rerun, Foxglove and PlotJuggler read it without knowing shiplog.
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
METADATA_NAME = "shiplog"  # of the metadata record
VESSEL_ATTACHMENT = "vessel.toml"
ENCODING = "protobuf"

LOCATION_FIX = "foxglove.LocationFix"

_DOUBLE = descriptor_pb2.FieldDescriptorProto.TYPE_DOUBLE
_FIXED_WIDTH = {
    # name of the schema: its fields
    "shiplog.Scalar": ("value",),
    "shiplog.Position": ("north", "east"),
}


@dataclass(frozen=True)
class Schema:
    """A message type.

    Attributes
    ----------
    name
        The full name of the protobuf message.
    fields
        The names of the fields that hold a sample's components.
    descriptor_set
        The serialised ``google.protobuf.FileDescriptorSet``, as MCAP files carry it.
    """

    name: str
    fields: tuple[str, ...]
    descriptor_set: bytes

    @property
    def dtype(self) -> np.dtype[np.void] | None:
        """The layout of a fixed-width message: a tag byte before each double; else None."""
        if self.name not in _FIXED_WIDTH:
            return None
        return np.dtype([part for f in self.fields for part in ((f"tag_{f}", "u1"), (f, "<f8"))])

    @property
    def tags(self) -> dict[str, int]:
        """The tag byte of each field in that layout; other bytes mean another layout."""
        fixed64 = 1  # the protobuf wire type of a double
        return {f"tag_{f}": number << 3 | fixed64 for number, f in enumerate(self.fields, start=1)}


def schema_for(fields: tuple[str, ...]) -> Schema:
    """Return the schema for a channel's fields.

    Parameters
    ----------
    fields
        The names of the components: none for a scalar, ``("north", "east")`` or `GEOGRAPHIC`.

    Raises
    ------
    ValueError
        No schema has these fields.

    Examples
    --------
    >>> schema_for(("north", "east")).name
    'shiplog.Position'
    """
    if fields == GEOGRAPHIC:
        return _location_fix()
    for name, schema_fields in _FIXED_WIDTH.items():
        if schema_fields == (fields or ("value",)):
            return _fixed_width(name)
    raise ValueError(f"no message schema has the fields {fields}")


def schema_named(name: str) -> Schema | None:
    """Return the schema of a name, or None if shiplog does not define it."""
    if name == LOCATION_FIX:
        return _location_fix()
    return _fixed_width(name) if name in _FIXED_WIDTH else None


def encode_messages(channel: Channel) -> list[bytes]:
    """Return the samples of a channel as serialised messages, one per sample."""
    if schema_for(channel.fields).dtype is None:
        return _encode_location_fixes(channel)
    rows = np.empty(len(channel), schema_for(channel.fields).dtype)
    fill_message_rows(rows, channel)
    return [row.tobytes() for row in rows]


def fill_message_rows(rows: NDArray[np.void], channel: Channel) -> None:
    """Write a channel's samples into message rows.

    Parameters
    ----------
    rows
        (n,) structures that have the fields of the schema's `dtype`, and perhaps others.
    channel
        n samples.
    """
    schema = schema_for(channel.fields)
    for tag, value in schema.tags.items():
        rows[tag] = value
    columns = channel.values.reshape(len(channel), len(schema.fields))
    for name, column in zip(schema.fields, columns.T, strict=True):
        rows[name] = column


def decode_messages(schema: Schema, messages: list[bytes]) -> FloatArray:
    """Decode messages of any length, one by one.

    Parameters
    ----------
    schema
        The schema of the messages, with k fields.
    messages
        n serialised messages.

    Returns
    -------
    values
        (n, k); NaN for a field that is absent.

    Raises
    ------
    google.protobuf.message.DecodeError
        A message is not of the schema.

    Examples
    --------
    >>> decode_messages(schema_for(()), [b""])
    array([[nan]])
    """
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
        message.oneof_decl.add(name=f"_{field}")  # the proto3 encoding of `optional`
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
    """Return Foxglove's schema for a geographic position, which viewers draw on a map."""
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


def _encode_location_fixes(channel: Channel) -> list[bytes]:
    message_type = _message_type(_location_fix())
    messages = []
    for stamp, (latitude, longitude, altitude) in zip(
        channel.measured_ns.tolist(), channel.values.tolist(), strict=True
    ):
        fix = message_type(latitude=latitude, longitude=longitude, altitude=altitude)
        fix.timestamp.FromNanoseconds(stamp)  # type: ignore[attr-defined]
        messages.append(fix.SerializeToString(deterministic=True))
    return messages
