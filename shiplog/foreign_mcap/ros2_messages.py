"""Messages of ROS 2: CDR by the definitions in the file, decoded by the library rosbags."""

from typing import Any

from mcap import records

from shiplog.errors import LogError

from .message_decoders import Decode, MessageError, schema_error

_MAX_ELEMENTS = 1_000_000  # of an array in a message with measured values
_SEPARATOR = "=" * 80 + "\n"


def ros2_decoder(schema: records.Schema, name: str) -> Decode:
    """Return the decoder of messages by their definition in `ros2msg` or `ros2idl`.

    Parameters
    ----------
    schema
        The schema record.
    name
        The topic and its type, for messages.

    Raises
    ------
    LogError
        The definition is empty or damaged, or rosbags is not installed.
    """
    try:
        from rosbags.typesys import (  # noqa: PLC0415 - optional, and takes long to import
            Stores,
            get_types_from_idl,
            get_types_from_msg,
            get_typestore,
        )
    except ImportError as error:
        raise LogError(
            f"the messages of {name} are of ROS 2; install their library: "
            "pip install 'shiplog[ros2]'"
        ) from error
    try:
        text = schema.data.decode()
        if not text.strip():
            raise ValueError("empty")
        store = get_typestore(Stores.EMPTY)
        store.max_sequence_length = _MAX_ELEMENTS
        if schema.encoding == "ros2msg":
            store.register(get_types_from_msg(_with_separators(text), schema.name))
        else:
            for part in _idl_files(text):
                store.register(get_types_from_idl(part))
        type_name = _stored_name(schema.name)
        store.get_msgdef(type_name)
    except Exception as error:  # the library raises many kinds for a damaged definition
        raise schema_error(name, schema, error) from error

    def decode(data: bytes) -> Any:  # noqa: ANN401 - a class made of the definition
        try:
            return store.deserialize_cdr(data, type_name)
        except Exception as error:
            raise MessageError(" ".join(str(error).split())) from error

    return decode


def _stored_name(name: str) -> str:
    """Return the name of a type with `msg` in its middle, as the library stores it."""
    parts = name.split("/")
    return name if len(parts) > 2 else "/msg/".join(parts)


def _with_separators(text: str) -> str:
    """Return a definition with line ends and separators of the usual form."""
    lines = text.replace("\r\n", "\n").splitlines()
    return "\n".join("=" * 80 if line.strip("= ") == "" and line.startswith("===") else line
                     for line in lines) + "\n"  # fmt: skip


def _idl_files(text: str) -> list[str]:
    """Return the IDL files that a schema concatenates."""
    text = _with_separators(text)
    if _SEPARATOR not in text:
        return [text]
    parts = [part.partition("\n") for part in text.split(_SEPARATOR) if part.strip()]
    return [rest if head.startswith("IDL:") else f"{head}\n{rest}" for head, _, rest in parts]
