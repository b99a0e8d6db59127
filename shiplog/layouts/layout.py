"""Layout files, which describe the columns of a foreign table."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import tzinfo

from shiplog.errors import LayoutError
from shiplog.toml_text import read_toml_text
from shiplog.units import CATALOGUE

DELIMITERS = {"whitespace": None, ",": ",", ";": ";", "tab": "\t"}
DATE_ORDERS = ("ymd", "dmy", "mdy")
VELOCITIES = ("velocity_north", "velocity_east")
HEMISPHERES = ("north_south", "east_west")  # columns with the letters N, S and E, W
DEGREES_MINUTES = "ddmm.mmmm"  # unit of a position: degrees and minutes in one number
# what a column can hold, with its SI unit: the time, a channel, or an earth-fixed velocity
ROLES = {"time": "s"} | {name: kind.unit for name, kind in CATALOGUE.items()}
ROLES |= dict.fromkeys(VELOCITIES, "m/s")


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    place
        Number of the column, from 1, or its name in the header.
    unit
        Unit of its numbers.
    sign
        1, or -1 where the sign is opposite to the convention of the channel.
    metadata
        Metadata of the channel: `interpolation` where it is stated, and `positive` of a channel
        that is not in the catalogue.
    """

    place: int | str
    unit: str
    sign: int = 1
    metadata: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class TimeForm:
    """How the times of a table are printed.

    Attributes
    ----------
    start_ns
        Instant of the printed time zero, ns since 1970-01-01 UTC; None where it is not stated.
    zone
        Time zone of printed dates and day times; None where it is not stated.
    date_order
        One of `DATE_ORDERS`; None where the dates themselves determine it.
    uniform
        Whether the times are to be rebuilt at a uniform step.
    assumed
        Whether a draft assumed the date order, which is still to be confirmed.
    """

    start_ns: int | None = None
    zone: tzinfo | None = None
    date_order: str | None = None
    uniform: bool = False
    assumed: bool = False


@dataclass(frozen=True)
class Layout:
    """The description of a foreign table.

    Attributes
    ----------
    name
        Name of the layout; by default that of its file.
    where
        File of the layout, for error messages.
    columns
        Columns by role: the name of a channel, with its source after a point where one is stated
        (`rpm.port`); "time" and "date"; "velocity_north", "velocity_east"; or a component of the
        position: "north" and "east", or "latitude", "longitude", "altitude" and `HEMISPHERES`,
        with the source after a point where one is stated (`latitude.bow`).
    time
        How the times are printed.
    source
        Source of the channels that state none.
    encoding
        Encoding of the text.
    skip_rows
        Number of lines before the header or the first row.
    comment
        How a line begins that is a comment; empty where there are none.
    delimiter
        Key of `DELIMITERS`.
    decimal_comma
        Whether numbers have a decimal comma.
    header
        Whether the first row has the names of the columns.
    froude_scale
        Length of the ship over that of the model.
    rebuild_heading
        Whether the heading is to be rebuilt from the yaw rate.
    """

    name: str
    where: str
    columns: Mapping[str, Column]
    time: TimeForm = TimeForm()
    source: str = "table"
    encoding: str = "utf-8"
    skip_rows: int = 0
    comment: str = "#"
    delimiter: str = ","
    decimal_comma: bool = False
    header: bool = False
    froude_scale: float = 1.0
    rebuild_heading: bool = False

    @property
    def receivers(self) -> tuple[str, ...]:
        """The sources of positions; an empty name for the one that states none."""
        roles = [role.partition(".") for role in self.columns]
        return tuple(source for name, _, source in roles if name in ("latitude", "north"))


@dataclass(frozen=True)
class Draft:
    """A drafted layout.

    Attributes
    ----------
    text
        The layout file, TOML.
    remarks
        One line for each column or topic: what it is read as, and what this is based on.
    """

    text: str
    remarks: tuple[str, ...]


def load_layout(path: str | os.PathLike[str]) -> Layout:
    """Load a layout from its TOML file.

    Raises
    ------
    LayoutError
        The file cannot be read or has errors; the message lists all of them.

    Examples
    --------
    >>> layout = load_layout("sample_data/layouts/simman_marin.toml")
    >>> layout.columns["rudder"].place, layout.columns["rudder"].sign
    (10, -1)
    """
    from .layout_parser import KIND, parse_layout  # noqa: PLC0415 - the parser makes layouts

    text = read_toml_text(path, KIND, LayoutError, f"no such {KIND}")
    return parse_layout(text, os.fspath(path))
