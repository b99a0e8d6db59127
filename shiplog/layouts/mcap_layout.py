"""Layouts of MCAP files of other programs: which fields of which topics are channels."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field

from shiplog.errors import LayoutError
from shiplog.toml_text import read_toml_text

AXES = ("enu", "ned")  # east, north, up with a body forward, left, up; or north, east, down
QUATERNION = "quaternion"  # unit of an orientation; its angles are in radians
MESSAGE_TIMES = ("publish_time", "log_time")  # of the record of a message in the file
ASSUMABLE = ("topic", "field", "unit", "sign", "axes")  # what a draft can leave to be confirmed


@dataclass(frozen=True)
class TopicChoice:
    """The messages that a channel is read from.

    Attributes
    ----------
    topic
        Their topic; empty where their type alone selects it.
    type
        The name of their schema; empty for any.
    stamp
        Path of the time of measurement, or one of `MESSAGE_TIMES`; empty for the default.
    """

    topic: str = ""
    type: str = ""
    stamp: str = ""

    def __str__(self) -> str:
        """Return the topic, or the type where it selects the topic."""
        return self.topic or f"type {self.type}"


@dataclass(frozen=True)
class FieldChannel:
    """A channel, or a velocity from which channels are computed, and the fields it is read from.

    Attributes
    ----------
    name
        Name of the channel; "velocity" for its components to north and east.
    source
        Source; empty where it follows from the topic.
    choice
        The messages.
    paths
        Paths of the fields: one, or one for each of `components`.
    units
        Unit of each field, or `QUATERNION`.
    signs
        Of each field 1, or -1 where the sign is opposite to the convention of the channel.
    components
        Names of the components of a position or a velocity; empty for a scalar.
    axes
        One of `AXES` for an angle in these; empty for one that follows the convention.
    metadata
        Metadata of the channel, as in `Column`.
    """

    name: str
    source: str
    choice: TopicChoice
    paths: tuple[str, ...]
    units: tuple[str, ...]
    signs: tuple[int, ...]
    components: tuple[str, ...] = ()
    axes: str = ""
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Name of its section, for messages."""
        return f"{self.name}.{self.source}" if self.source else self.name


@dataclass(frozen=True)
class McapLayout:
    """The description of an MCAP file of another program.

    Attributes
    ----------
    name
        Name of the layout; by default that of its file.
    where
        File of the layout, for error messages.
    channels
        The channels, each with its fields.
    source
        Source of the channels that state none; empty: by their topics.
    stamp
        Path of the time of measurement in all messages; empty for the default.
    stamp_unit
        Unit of times that are numbers since 1970; empty where there are none.
    assumed
        What a draft assumed and is still to be confirmed, such as "sign of yaw_rate".
    """

    name: str
    where: str
    channels: tuple[FieldChannel, ...]
    source: str = ""
    stamp: str = ""
    stamp_unit: str = ""
    assumed: tuple[str, ...] = ()


def load_mcap_layout(path: str | os.PathLike[str]) -> McapLayout:
    """Load the layout of an MCAP file from its TOML file.

    Raises
    ------
    LayoutError
        The file cannot be read or has errors; the message lists all of them.
    """
    from .layout_parser import KIND  # noqa: PLC0415 - the parsers make layouts
    from .mcap_layout_parser import parse_mcap_layout  # noqa: PLC0415

    text = read_toml_text(path, KIND, LayoutError, f"no such {KIND}")
    return parse_mcap_layout(text, os.fspath(path))
