"""Long form of a trial: one row per sample and component, from which nothing is lost.

What is not a number (units, sources, metadata, events, the vessel file, channels without samples)
is in a header of JSON lines. A data frame carries it in its `attrs`, a CSV in comments, a Parquet
file in the metadata of its schema.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import LogError
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog
from shiplog.units import did_you_mean

from .table_header import header_lines, read_header

if TYPE_CHECKING:  # slow to import: only what makes a frame waits for it
    import pandas as pd

COLUMNS = ("topic", "field", "measured_ns", "received_ns", "value")
HEADER_KEY = "shiplog"  # of the header in a frame's attrs and in the metadata of a Parquet file

Codes = NDArray[np.int32]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class LongColumns:
    """The columns of n rows, in the order of `COLUMNS`.

    Attributes
    ----------
    topics, fields
        Topic and component of each row.
    measured_ns, received_ns
        (n,) times, ns since 1970-01-01 UTC.
    values
        (n,) values, in the units of the channels.
    """

    topics: Iterable[str]
    fields: Iterable[str]
    measured_ns: TimeArray
    received_ns: TimeArray
    values: FloatArray


def to_frame(log: TrialLog) -> "pd.DataFrame":
    """Convert a trial to a long data frame: one row per sample and component.

    The rows are in the order of the channels and of their samples. `TrialLog.to_pandas` gives the
    wide form, one column per quantity on a uniform clock.

    Returns
    -------
    pandas.DataFrame
        Columns topic, field, measured_ns, received_ns and value. `attrs` has the header (units,
        metadata, the vessel), from which `from_frame` restores the whole trial.

    Examples
    --------
    >>> import shiplog
    >>> frame = to_frame(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> list(frame.columns)
    ['topic', 'field', 'measured_ns', 'received_ns', 'value']
    """
    import pandas as pd  # noqa: PLC0415 - slow to import

    topics, topic_codes, fields, field_codes = row_labels(log)
    measured, received, values = long_columns(log)
    frame = pd.DataFrame(
        {
            "topic": pd.Categorical.from_codes(topic_codes, pd.Index(topics, dtype=str)),
            "field": pd.Categorical.from_codes(field_codes, pd.Index(fields, dtype=str)),
            "measured_ns": measured,
            "received_ns": received,
            "value": values,
        }
    )
    frame.attrs[HEADER_KEY] = header_lines(log)
    return frame


def from_frame(frame: "pd.DataFrame", name: str = "frame") -> TrialLog:
    """Convert a long data frame back to a trial.

    Parameters
    ----------
    frame
        A frame from `to_frame`; rows may have been changed, dropped or added.
    name
        Name of the trial, also for error messages.

    Raises
    ------
    LogError
        The frame has lost its header, or has rows that belong to no channel.
    """
    if HEADER_KEY not in frame.attrs:
        raise LogError(
            f"the attrs of the frame have no {HEADER_KEY!r} with the units of the channels; "
            f"make it with to_frame and keep the attrs: {name}"
        )
    columns = LongColumns(*(frame[column].to_numpy() for column in COLUMNS))
    return assemble(name, str(frame.attrs[HEADER_KEY]).split("\n"), columns)


def field_names(channel: Channel) -> tuple[str, ...]:
    """Return the components of a channel; `value` for one value per sample."""
    return channel.fields or ("value",)


def long_columns(log: TrialLog) -> tuple[TimeArray, TimeArray, FloatArray]:
    """Return the numeric columns of the long form.

    Returns
    -------
    measured_ns, received_ns
        (n,) times; n counts the components of all samples.
    values
        (n,) values.
    """
    empty: list[Any] = [np.zeros(0, np.int64)]
    measured = [np.repeat(c.measured_ns, len(field_names(c))) for c in log]
    received = [np.repeat(c.received_ns, len(field_names(c))) for c in log]
    values = [c.values.ravel() for c in log]
    return (
        np.concatenate(empty + measured),
        np.concatenate(empty + received),
        np.concatenate([np.zeros(0), *values]),
    )


def row_labels(log: TrialLog) -> tuple[list[str], Codes, list[str], Codes]:
    """Return the text columns of the long form as codes.

    Returns
    -------
    topics
        Each topic once.
    topic_codes
        (n,) index of the topic of each row.
    fields
        Each name of a component once.
    field_codes
        (n,) index of the component of each row.
    """
    topics = list(dict.fromkeys(c.topic for c in log))
    fields = list(dict.fromkeys(f for c in log for f in field_names(c)))
    codes: list[Any] = [np.zeros(0, np.int32)]
    topic_codes = [np.full(c.values.size, topics.index(c.topic), np.int32) for c in log]
    field_codes = [
        np.tile(np.array([fields.index(f) for f in field_names(c)], np.int32), len(c)) for c in log
    ]
    return topics, np.concatenate(codes + topic_codes), fields, np.concatenate(codes + field_codes)


def assemble(name: str, header: list[str], columns: LongColumns) -> TrialLog:
    """Assemble a trial from its header and its rows.

    Parameters
    ----------
    name
        Name of the trial, also for error messages.
    header
        Lines of `header_lines`.
    columns
        The rows, of all channels.

    Raises
    ------
    LogError
        The header cannot be read, or a row belongs to no channel of it.
    """
    outline = read_header(name, header)
    empty = outline.channels
    place = {(c.topic, field): i for i, (c, field) in enumerate(_components(empty))}
    labels = zip(columns.topics, columns.fields, strict=True)
    of_row = np.fromiter((place.get(label, -1) for label in labels), np.int32, len(columns.values))
    if np.any(of_row < 0):
        labels = zip(columns.topics, columns.fields, strict=True)
        topic, field = list(labels)[int(np.argmin(of_row))]
        raise LogError(
            f"the header has no channel {topic!r} with a field {field!r}"
            f"{did_you_mean(topic, [t for t, _ in place])}; convert the log again: {name}"
        )
    rows = iter([np.flatnonzero(of_row == i) for i in range(len(_components(empty)))])
    channels = []
    for channel in empty:
        channel_rows = [next(rows) for _ in field_names(channel)]
        channels.append(_filled(name, channel, channel_rows, columns))
    return replace(outline, channels=tuple(channels))


def _components(channels: Sequence[Channel]) -> list[tuple[Channel, str]]:
    return [(channel, field) for channel in channels for field in field_names(channel)]


def _filled(name: str, channel: Channel, rows: list[Rows], columns: LongColumns) -> Channel:
    """Fill a channel with samples; `rows` has the indices of the rows of each component."""
    first = rows[0]
    for field, field_rows in zip(field_names(channel), rows, strict=True):
        paired = len(field_rows) == len(first) and all(
            np.array_equal(stamps[field_rows], stamps[first])
            for stamps in (columns.measured_ns, columns.received_ns)
        )
        if not paired:
            raise LogError(
                f"{channel.topic}: the rows of its field {field!r} do not match those of "
                f"{field_names(channel)[0]!r}; keep or drop all rows of an instant together: {name}"
            )
    stamps = columns.measured_ns[first], columns.received_ns[first]
    if len(first) and min(int(s.min()) for s in stamps) < 0:
        raise LogError(f"{channel.topic} has times before 1970; correct its clock: {name}")
    values = [columns.values[field_rows] for field_rows in rows]
    together = np.stack(values, axis=1) if channel.fields else values[0]
    return replace(channel, measured_ns=stamps[0], received_ns=stamps[1], values=together)
