"""Protobuf messages: the descriptors of the schemas, and messages encoded and decoded one by one.

Only what writes a file, and what reads messages of variable length, imports this module, because
the protobuf library takes long to import. The descriptors are in the file: Rerun, Foxglove and
PlotJuggler read it without knowing shiplog.
"""

from functools import cache
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.message import DecodeError, Message
from numpy.typing import NDArray

from shiplog.types import Channel, Event, EventLevel, FloatArray
from shiplog.units import GEOGRAPHIC

from .schema import EVENT, LOCATION_FIX, RAW, Schema, fill_message_rows, schema_for

_Field = descriptor_pb2.FieldDescriptorProto
_DOUBLE = _Field.TYPE_DOUBLE
_TIMESTAMP = ".google.protobuf.Timestamp"


def encode_messages(channel: Channel) -> list[bytes]:
    """Return the samples of a channel as serialised messages, one per sample."""
    if schema_for(channel.fields).dtype is None:
        return _encode_location_fixes(channel)
    rows = np.empty(len(channel), schema_for(channel.fields).dtype)
    fill_message_rows(rows, channel)
    return [row.tobytes() for row in rows]


def decode_messages(schema: Schema, messages: list[bytes]) -> tuple[FloatArray, NDArray[np.bool_]]:
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
    is_decoded
        (n,) whether each message is of the schema.

    Examples
    --------
    >>> decode_messages(schema_for(()), [b"", b"x"])
    (array([[nan],
           [nan]]), array([ True, False]))
    """
    message_type = _message_type(schema)
    values = np.full((len(messages), len(schema.fields)), np.nan)
    is_decoded = np.ones(len(messages), bool)
    for row, data in enumerate(messages):
        try:
            message = message_type.FromString(data)
        except DecodeError:
            is_decoded[row] = False
            continue
        for column, name in enumerate(schema.fields):
            if schema.name == LOCATION_FIX or message.HasField(name):
                values[row, column] = getattr(message, name)
    return values, is_decoded


def encode_event(event: Event) -> bytes:
    """Return an event as a serialised ``foxglove.Log``.

    Examples
    --------
    >>> b"execute" in encode_event(Event(0, "execute"))
    True
    """
    message = _message_type(EVENT)(
        level=int(event.level), message=_encodable(event.text), name=_encodable(event.source)
    )
    message.timestamp.FromNanoseconds(event.time_ns)  # type: ignore[attr-defined]
    return message.SerializeToString(deterministic=True)


def decode_event(data: bytes, time_ns: int) -> Event:
    """Decode a ``foxglove.Log`` that happened at a time, ns.

    Raises
    ------
    ValueError
        It is no such message.

    Examples
    --------
    >>> decode_event(encode_event(Event(0, "execute")), 5)
    Event(time_ns=5, text='execute', source='operator', level=<EventLevel.INFO: 2>)
    """
    try:
        message: Any = _message_type(EVENT).FromString(data)
    except DecodeError as error:
        raise ValueError(f"not {EVENT.name}") from error
    level = EventLevel(min(max(message.level, EventLevel.INFO), EventLevel.ERROR))
    return Event(time_ns, message.message, message.name, level)


def decode_packet(data: bytes) -> bytes:
    """Return the packet of a ``shiplog.Raw``, which may have other fields too.

    Raises
    ------
    ValueError
        It is no such message.
    """
    try:
        message: Any = _message_type(RAW).FromString(data)
    except DecodeError as error:
        raise ValueError(f"not {RAW.name}") from error
    packet: bytes = message.data
    return packet


@cache
def descriptor_set(schema: Schema) -> bytes:
    """Return the serialised ``FileDescriptorSet`` of a schema, as MCAP files carry it.

    Examples
    --------
    >>> b"shiplog/Position.proto" in descriptor_set(schema_for(("north", "east")))
    True
    """
    files = _FILES.get(schema.name, lambda: [_fixed_width_file(schema)])()
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
            label=_Field.LABEL_OPTIONAL,
            oneof_index=number - 1,
            proto3_optional=True,
        )
    return file


def _location_fix_files() -> list[descriptor_pb2.FileDescriptorProto]:
    """Return Foxglove's schema for a geographic position, which viewers draw on a map."""
    timestamp, file, message = _foxglove_files("LocationFix")
    kinds = message.enum_type.add(name="PositionCovarianceType")
    for value, label in enumerate(("UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN")):
        kinds.value.add(name=label, number=value)
    kind = ".foxglove.LocationFix.PositionCovarianceType"
    _add_field(message, 1, "latitude", _DOUBLE)
    _add_field(message, 2, "longitude", _DOUBLE)
    _add_field(message, 3, "altitude", _DOUBLE)
    _add_field(message, 4, "position_covariance", _DOUBLE, repeated=True)
    _add_field(message, 5, "position_covariance_type", _Field.TYPE_ENUM, kind)
    _add_field(message, 6, "timestamp", _Field.TYPE_MESSAGE, _TIMESTAMP)
    _add_field(message, 7, "frame_id", _Field.TYPE_STRING)
    return [timestamp, file]


def _event_files() -> list[descriptor_pb2.FileDescriptorProto]:
    """Return Foxglove's schema for a log message, which viewers list as text."""
    timestamp, file, message = _foxglove_files("Log")
    levels = message.enum_type.add(name="Level")
    for value, label in enumerate(("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL")):
        levels.value.add(name=label, number=value)
    _add_field(message, 1, "timestamp", _Field.TYPE_MESSAGE, _TIMESTAMP)
    _add_field(message, 2, "level", _Field.TYPE_ENUM, ".foxglove.Log.Level")
    _add_field(message, 3, "message", _Field.TYPE_STRING)
    _add_field(message, 4, "name", _Field.TYPE_STRING)
    _add_field(message, 5, "file", _Field.TYPE_STRING)
    _add_field(message, 6, "line", _Field.TYPE_FIXED32)
    return [timestamp, file]


def _raw_files() -> list[descriptor_pb2.FileDescriptorProto]:
    """Return the schema of a raw packet."""
    file = descriptor_pb2.FileDescriptorProto(
        name="shiplog/Raw.proto", package="shiplog", syntax="proto3"
    )
    _add_field(file.message_type.add(name="Raw"), 1, "data", _Field.TYPE_BYTES)
    return [file]


def _foxglove_files(
    name: str,
) -> tuple[
    descriptor_pb2.FileDescriptorProto,
    descriptor_pb2.FileDescriptorProto,
    descriptor_pb2.DescriptorProto,
]:
    """Return the file of time stamps, that of a message of Foxglove, and the empty message."""
    timestamp = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(timestamp)
    file = descriptor_pb2.FileDescriptorProto(
        name=f"foxglove/{name}.proto",
        package="foxglove",
        syntax="proto3",
        dependency=[timestamp.name],
    )
    return timestamp, file, file.message_type.add(name=name)


def _add_field(
    message: descriptor_pb2.DescriptorProto,
    number: int,
    name: str,
    kind: descriptor_pb2.FieldDescriptorProto.Type.ValueType,
    type_name: str | None = None,
    *,
    repeated: bool = False,
) -> None:
    arity = _Field.LABEL_REPEATED if repeated else _Field.LABEL_OPTIONAL
    message.field.add(name=name, number=number, type=kind, label=arity, type_name=type_name)


_FILES = {LOCATION_FIX: _location_fix_files, EVENT.name: _event_files, RAW.name: _raw_files}


@cache
def _message_type(schema: Schema) -> type[Message]:
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(descriptor_set(schema)).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))


def _encodable(text: str) -> str:
    """Return a text without surrogates, as which undecodable bytes of the wire may be in it."""
    return text.encode(errors="replace").decode()


def _encode_location_fixes(channel: Channel) -> list[bytes]:
    fix: Any = _message_type(schema_for(GEOGRAPHIC))()  # one for all: its making takes longest
    timestamp = fix.timestamp
    messages = []
    for stamp, values in zip(channel.measured_ns.tolist(), channel.values.tolist(), strict=True):
        fix.latitude, fix.longitude, fix.altitude = values
        timestamp.seconds, timestamp.nanos = divmod(stamp, 10**9)
        messages.append(fix.SerializeToString(deterministic=True))
    return messages
