"""Protobuf messages: the descriptors of the schemas, and messages encoded and decoded one by one.

Only what writes a file, and what reads messages of variable length, imports this module, because
the protobuf library takes long to import. The descriptors are in the file: Rerun, Foxglove and
PlotJuggler read it without knowing shiplog.
"""

from functools import cache

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.message import DecodeError, Message

from shiplog.types import Channel, FloatArray
from shiplog.units import GEOGRAPHIC

from .schema import LOCATION_FIX, Schema, fill_message_rows, schema_for

_DOUBLE = descriptor_pb2.FieldDescriptorProto.TYPE_DOUBLE


def encode_messages(channel: Channel) -> list[bytes]:
    """Return the samples of a channel as serialised messages, one per sample."""
    if schema_for(channel.fields).dtype is None:
        return _encode_location_fixes(channel)
    rows = np.empty(len(channel), schema_for(channel.fields).dtype)
    fill_message_rows(rows, channel)
    return [row.tobytes() for row in rows]


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
    ValueError
        A message is not of the schema.

    Examples
    --------
    >>> decode_messages(schema_for(()), [b""])
    array([[nan]])
    """
    message_type = _message_type(schema)
    values = np.full((len(messages), len(schema.fields)), np.nan)
    for row, data in enumerate(messages):
        try:
            message = message_type.FromString(data)
        except DecodeError as error:
            raise ValueError(f"message {row} is not {schema.name}") from error
        for column, name in enumerate(schema.fields):
            if schema.name == LOCATION_FIX or message.HasField(name):
                values[row, column] = getattr(message, name)
    return values


@cache
def descriptor_set(schema: Schema) -> bytes:
    """Return the serialised ``FileDescriptorSet`` of a schema, as MCAP files carry it.

    Examples
    --------
    >>> b"shiplog/Position.proto" in descriptor_set(schema_for(("north", "east")))
    True
    """
    is_fix = schema.name == LOCATION_FIX
    files = _location_fix_files() if is_fix else [_fixed_width_file(schema)]
    return descriptor_pb2.FileDescriptorSet(file=files).SerializeToString(deterministic=True)


def _fixed_width_file(schema: Schema) -> descriptor_pb2.FileDescriptorProto:
    name = schema.name
    file = descriptor_pb2.FileDescriptorProto(
        name=f"{name.replace('.', '/')}.proto", package="shiplog", syntax="proto3"
    )
    message = file.message_type.add(name=name.removeprefix("shiplog."))
    for number, field in enumerate(schema.fields, start=1):
        message.oneof_decl.add(name=f"_{field}")  # the proto3 encoding of `optional`
        message.field.add(
            name=field,
            number=number,
            type=_DOUBLE,
            label=descriptor_pb2.FieldDescriptorProto.LABEL_OPTIONAL,
            oneof_index=number - 1,
            proto3_optional=True,
        )
    return file


def _location_fix_files() -> list[descriptor_pb2.FileDescriptorProto]:
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
    return [timestamp, file]


@cache
def _message_type(schema: Schema) -> type[Message]:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(schema)).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


def _encode_location_fixes(channel: Channel) -> list[bytes]:
    message_type = _message_type(schema_for(GEOGRAPHIC))
    messages = []
    for stamp, (latitude, longitude, altitude) in zip(
        channel.measured_ns.tolist(), channel.values.tolist(), strict=True
    ):
        fix = message_type(latitude=latitude, longitude=longitude, altitude=altitude)
        fix.timestamp.FromNanoseconds(stamp)  # type: ignore[attr-defined]
        messages.append(fix.SerializeToString(deterministic=True))
    return messages
