"""Decoders of messages: JSON, protobuf by the descriptors in the file, and CDR of ROS 2."""

import json
from collections.abc import Callable
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap import records

from shiplog.errors import LogError

MAX_MESSAGE_BYTES = 1 << 24  # of a message with measured values; longer ones are not decoded
MAX_SCHEMA_BYTES = 1 << 20
Decode = Callable[[bytes], Any]


class MessageError(ValueError):
    """A message that cannot be decoded; the text states the cause."""


def message_decoder(channel: records.Channel, schema: records.Schema | None) -> Decode:
    """Return the function that decodes the messages of a channel.

    It raises `MessageError` for a message that is damaged or not of the schema.

    Parameters
    ----------
    channel, schema
        The records that describe the channel.

    Raises
    ------
    LogError
        The encoding is not supported, the schema is damaged, or a package is not installed.
    """
    encoding = channel.message_encoding
    kind = schema.encoding if schema else ""
    if encoding == "json":
        return _bounded(_decode_json)
    name = f"{channel.topic} ({schema.name if schema else 'no type'})"
    if schema is not None and len(schema.data) > MAX_SCHEMA_BYTES:
        raise LogError(f"the schema of {name} is {len(schema.data)} bytes long, at most "
                       f"{MAX_SCHEMA_BYTES} are read; check the program that wrote it")  # fmt: skip
    if encoding == "protobuf" and kind == "protobuf" and schema:
        return _bounded(_protobuf_decoder(schema, name))
    if encoding == "cdr" and kind in ("ros2msg", "ros2idl") and schema:
        from .ros2_messages import ros2_decoder  # noqa: PLC0415 - an optional dependency

        return _bounded(ros2_decoder(schema, name))
    described = f"with a schema in {kind}" if kind else "without a schema"
    raise LogError(
        f"the messages of {name} have {f'the encoding {encoding}' if encoding else 'no encoding'} "
        f"{described}; readable are json, protobuf, and cdr with ros2msg or ros2idl"
    )


def _bounded(decode: Decode) -> Decode:
    """Return a decoder that refuses messages of absurd size."""

    def bounded(data: bytes) -> Any:  # noqa: ANN401 - of any type of message
        if len(data) > MAX_MESSAGE_BYTES:
            raise MessageError(f"{len(data)} bytes, at most {MAX_MESSAGE_BYTES} are read")
        return decode(data)

    return bounded


def _decode_json(data: bytes) -> Any:  # noqa: ANN401
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"not JSON: {error}") from error


def _protobuf_decoder(schema: records.Schema, name: str) -> Decode:
    """Return the decoder of a protobuf message by the descriptors that the schema carries."""
    try:
        pool = descriptor_pool.DescriptorPool()
        for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        message_type = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    except Exception as error:  # the library raises many kinds for a damaged schema
        raise schema_error(name, schema, error) from error

    def decode(data: bytes) -> Any:  # noqa: ANN401
        try:
            return message_type.FromString(data)
        except Exception as error:
            raise MessageError(str(error)) from error

    return decode


def schema_error(name: str, schema: records.Schema, cause: Exception) -> LogError:
    """Return the error for a schema that cannot be used."""
    if not schema.data:
        return LogError(
            f"the schema of {name} is empty, so that its messages cannot be decoded; "
            "record it again with the message definitions"
        )
    reason = " ".join(f"{type(cause).__name__} {cause}".split())
    return LogError(
        f"the schema of {name} cannot be read ({reason:.120}); "
        "check the program that wrote the file"
    )
