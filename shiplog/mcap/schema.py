"""Message schemas of a log, its topics' metadata keys, and the format version.

Every field is fixed-width and `optional`, so that all messages of a schema have the same length
whatever their values, and a column of messages is one numpy array. These need no protobuf library;
`messages` uses it for the descriptors and for all other messages.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.types import Channel
from shiplog.units import GEOGRAPHIC

FORMAT_VERSION = "1"
METADATA_NAME = "shiplog"  # of the metadata record
PART_KEY = "part."  # of metadata of a file that is a part of a recording
PART_SET, PART_NUMBER = f"{PART_KEY}set", f"{PART_KEY}number"
PART_NEXT = f"{PART_KEY}continued_in"  # the name of the file that follows
PART_INDEX = f"{PART_KEY}index."  # followed by a part's number: what it holds, in words
VESSEL_ATTACHMENT = "vessel.toml"
ENCODING = "protobuf"

LOCATION_FIX = "foxglove.LocationFix"
EVENTS_TOPIC = "/events"
RAW_NAME = "raw"  # of the topics of raw packets, before the source

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
    """

    name: str
    fields: tuple[str, ...]

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


RAW = Schema("shiplog.Raw", ("data",))  # one packet of a source
EVENT = Schema("foxglove.Log", ("timestamp", "level", "message", "name", "file", "line"))


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
        return Schema(LOCATION_FIX, GEOGRAPHIC)
    for name, schema_fields in _FIXED_WIDTH.items():
        if schema_fields == (fields or ("value",)):
            return Schema(name, schema_fields)
    raise ValueError(f"no message schema has the fields {fields}")


def schema_named(name: str) -> Schema | None:
    """Return the schema of a name, or None if shiplog does not define it."""
    if name == LOCATION_FIX:
        return Schema(LOCATION_FIX, GEOGRAPHIC)
    return Schema(name, _FIXED_WIDTH[name]) if name in _FIXED_WIDTH else None


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
