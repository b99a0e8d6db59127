"""`TrialLog` <-> pandas, CSV and Parquet, with nothing lost.

All three are in long form: one row per sample and field. What is no number (units, sources,
metadata, the vessel, channels without samples) stands in a header of JSON lines, which a CSV
carries as comments and a Parquet file in its schema's metadata.
"""

import csv
import json
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.mcap.schema import schema_for
from shiplog.types import Channel, FloatArray, TimeArray, TrialLog
from shiplog.units import did_you_mean

if TYPE_CHECKING:  # only verbs that need pandas shall wait for it
    import pandas as pd

CSV_MARK = "# shiplog csv 1"
CSV_END = "# end"  # without it the file was cut
COLUMNS = ("topic", "field", "measured_ns", "received_ns", "value")
HEADER_KEY = "shiplog"  # of a frame's attrs and of a Parquet file's metadata

Codes = NDArray[np.int32]
Rows = NDArray[np.intp]


def to_frame(log: TrialLog) -> "pd.DataFrame":
    """A trial as one long frame: topic, field, measured_ns, received_ns, value.

    One row per sample and field, channel after channel, each in its own order; `attrs` has what
    is no number, so that `from_frame` gives back the whole log.
    """
    import pandas as pd  # noqa: PLC0415 - see above

    topics, topic_codes, fields, field_codes = _labels(log)
    measured, received, values = _long(log)
    frame = pd.DataFrame(
        {
            "topic": pd.Categorical.from_codes(topic_codes, pd.Index(topics, dtype=str)),
            "field": pd.Categorical.from_codes(field_codes, pd.Index(fields, dtype=str)),
            "measured_ns": measured,
            "received_ns": received,
            "value": values,
        }
    )
    frame.attrs[HEADER_KEY] = _header(log)
    return frame


def from_frame(frame: "pd.DataFrame", name: str = "frame") -> TrialLog:
    """The trial of a frame that `to_frame` made; rows may have been changed, dropped or added.

    Raises `LogError` for a frame without its header, or with rows that fit no channel.
    """
    if HEADER_KEY not in frame.attrs:
        raise LogError(
            f"the frame's attrs have no {HEADER_KEY!r}, which says its units; "
            f"begin with to_frame and keep the attrs: {name}"
        )
    columns = [frame[column].to_numpy() for column in COLUMNS]
    return _assemble(name, str(frame.attrs[HEADER_KEY]).split("\n"), *columns)


def write_csv(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a trial as CSV; nothing half-written is left there if it fails."""
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
        stream.write(f"{CSV_MARK}\n")
        stream.writelines(f"# {line}\n" for line in _header(log).split("\n"))
        stream.write(",".join(COLUMNS) + "\n")
        for channel in log:
            heads = [f"{_quoted(channel.topic)},{field}" for field in _fields(channel)]
            texts = map(repr, channel.values.ravel().tolist())
            stamps = zip(channel.measured_ns.tolist(), channel.received_ns.tolist(), strict=True)
            for measured, received in stamps:
                for head in heads:
                    stream.write(f"{head},{measured},{received},{next(texts)}\n")
        stream.write(f"{CSV_END}\n")


def read_csv(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a CSV that `write_csv` wrote.

    Raises `LogError`, naming the line, where it is none, or was spoilt since.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            header = _csv_header(path, stream)
            return _assemble(path.name, header, *_csv_rows(path, stream, len(header) + 2))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LogError(f"cannot read: {reason}: {path}") from error
    except UnicodeDecodeError as error:
        raise LogError(f"not text in UTF-8; convert the log again: {path}") from error


def _csv_header(path: Path, stream: IO[str]) -> list[str]:
    """The JSON lines after the mark; the stream then stands at the first sample."""
    mark = stream.readline().rstrip("\r\n")
    if mark != CSV_MARK:
        ours = CSV_MARK.rpartition(" ")[0]
        remedy = "install a newer shiplog" if mark.startswith(ours) else "it needs a layout"
        raise LogError(f"the first line is not {CSV_MARK!r} but {mark[:40]!r}; {remedy}: {path}")
    header = []
    while (line := stream.readline().rstrip("\r\n")).startswith("# "):
        header.append(line.removeprefix("# "))
    if line != ",".join(COLUMNS):
        raise LogError(
            f"line {len(header) + 2} should say {','.join(COLUMNS)!r}; "
            f"convert the log again: {path}"
        )
    return header


def _csv_rows(path: Path, stream: IO[str], before: int) -> tuple[Any, ...]:
    """The five columns of the samples; `before` is the number of lines above them."""
    rows: tuple[list[Any], ...] = ([], [], [], [], [])
    topics, fields, measured, received, values = rows
    reader, ended = csv.reader(stream), False
    try:
        for cells in reader:
            if ended:
                raise LogError(f"rows stand behind its {CSV_END!r}; take them out: {path}")
            if cells == [CSV_END]:
                ended = True
                continue
            topic, field, measured_text, received_text, text = cells
            topics.append(topic)
            fields.append(field)
            measured.append(int(measured_text))
            received.append(int(received_text))
            values.append(float(text or "nan"))
        if not ended:
            raise LogError(f"it was cut, its last line is not {CSV_END!r}; copy it again: {path}")
        return (topics, fields, *(np.array(c, np.int64) for c in rows[2:4]), np.array(values))
    except OverflowError:
        raise LogError(f"a time needs more than 64 bits; convert the log again: {path}") from None
    except (ValueError, csv.Error) as error:
        reason = str(error) if len(cells) == 5 else f"it has {len(cells)} columns, not 5"
        raise LogError(
            f"line {before + reader.line_num} cannot be read ({reason}); "
            f"mend it or take it out: {path}"
        ) from None


def write_parquet(log: TrialLog, path: str | os.PathLike[str]) -> None:
    """Write a trial as Parquet; nothing half-written is left there if it fails."""
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import parquet  # noqa: PLC0415

    topics, topic_codes, fields, field_codes = _labels(log)
    columns = (
        pa.DictionaryArray.from_arrays(topic_codes, pa.array(topics, pa.string())),
        pa.DictionaryArray.from_arrays(field_codes, pa.array(fields, pa.string())),
        *(pa.array(column) for column in _long(log)),
    )
    table = pa.Table.from_arrays(list(columns), names=list(COLUMNS))
    table = table.replace_schema_metadata({HEADER_KEY: _header(log)})
    with atomic_write(path) as part:
        parquet.write_table(table, part, compression="zstd", use_dictionary=list(COLUMNS[:2]))


def read_parquet(path: str | os.PathLike[str]) -> TrialLog:
    """Read a trial from a Parquet file that `write_parquet` wrote.

    Raises `LogError` where it is none.
    """
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import parquet  # noqa: PLC0415

    path = Path(path)
    try:
        with parquet.ParquetFile(path) as file:
            header = (file.schema_arrow.metadata or {}).get(HEADER_KEY.encode())
            if header is None:
                raise LogError(f"a Parquet file, but not of shiplog; convert a log to it: {path}")
            table = file.read(columns=list(COLUMNS))
            columns = [table.column(name).to_numpy() for name in COLUMNS]
    except OSError as error:
        raise LogError(f"cannot read: {str(error).lower()}: {path}") from error
    except (pa.ArrowException, KeyError) as error:
        raise LogError(f"not a whole Parquet file of shiplog ({error}): {path}") from error
    return _assemble(path.name, header.decode().split("\n"), *columns)


def _fields(channel: Channel) -> tuple[str, ...]:
    return channel.fields or ("value",)


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',"\r\n') else text


def _long(log: TrialLog) -> tuple[TimeArray, TimeArray, FloatArray]:
    """Measured times, received times and values, one row per sample and field."""
    none: list[Any] = [np.zeros(0, np.int64)]
    measured = [np.repeat(c.measured_ns, len(_fields(c))) for c in log]
    received = [np.repeat(c.received_ns, len(_fields(c))) for c in log]
    values = [c.values.ravel() for c in log]
    return (
        np.concatenate(none + measured),
        np.concatenate(none + received),
        np.concatenate([np.zeros(0), *values]),
    )


def _labels(log: TrialLog) -> tuple[list[str], Codes, list[str], Codes]:
    """The topics and the fields, and of each row of `_long` which topic and which field."""
    topics = list(dict.fromkeys(c.topic for c in log))
    fields = list(dict.fromkeys(f for c in log for f in _fields(c)))
    codes: list[Any] = [np.zeros(0, np.int32)]
    of_topic = [np.full(c.values.size, topics.index(c.topic), np.int32) for c in log]
    of_field = [
        np.tile(np.array([fields.index(f) for f in _fields(c)], np.int32), len(c)) for c in log
    ]
    return topics, np.concatenate(codes + of_topic), fields, np.concatenate(codes + of_field)


def _header(log: TrialLog) -> str:
    """What of a trial is no number: a line of its metadata, one a channel, those of its vessel."""
    lines = ["metadata " + _json(dict(log.metadata))]
    for c in log:
        said = {"name": c.name, "source": c.source, "unit": c.unit, "fields": list(c.fields)}
        lines.append("channel " + _json(said | {"metadata": dict(c.metadata)}))
    if log.vessel_toml is not None:
        lines += ["vessel " + _json(line) for line in log.vessel_toml.split("\n")]
    return "\n".join(lines)


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def _assemble(
    name: str,
    header: list[str],
    topics: Iterable[str],
    fields: Iterable[str],
    measured_ns: TimeArray,
    received_ns: TimeArray,
    values: FloatArray,
) -> TrialLog:
    """A trial from its header and its rows."""
    empty, metadata, vessel_toml = _read_header(name, header)
    place = {(c.topic, field): i for i, (c, field) in enumerate(_components(empty))}
    labels = zip(topics, fields, strict=True)
    of_row = np.fromiter((place.get(label, -1) for label in labels), np.int32, len(values))
    if np.any(of_row < 0):
        topic, field = list(zip(topics, fields, strict=True))[int(np.argmin(of_row))]
        raise LogError(
            f"no channel {topic!r} with a field {field!r} is in the header"
            f"{did_you_mean(topic, [t for t, _ in place])}; convert the log again: {name}"
        )
    rows = iter([np.flatnonzero(of_row == i) for i in range(len(_components(empty)))])
    channels = []
    for channel in empty:
        its = [next(rows) for _ in _fields(channel)]
        channels.append(_filled(name, channel, its, measured_ns, received_ns, values))
    return TrialLog(name, tuple(channels), metadata, vessel_toml)


def _read_header(name: str, header: list[str]) -> tuple[list[Channel], dict[str, str], str | None]:
    """The channels without their samples, the metadata and the vessel."""
    metadata: dict[str, str] = {}
    channels: list[Channel] = []
    vessel: list[str] = []
    for line in header:
        key, _, text = line.partition(" ")
        try:
            said = json.loads(text)
            if key == "metadata":
                metadata |= said
            elif key == "channel":
                channels.append(_empty_channel(**said))
            elif key == "vessel":
                vessel.append(said)
            else:
                raise ValueError(f"{key!r} is not known")
        except (ValueError, TypeError) as error:
            raise LogError(
                f"the header's line {line[:60]!r} cannot be read ({error}); "
                f"convert the log again: {name}"
            ) from error
    return channels, metadata, "\n".join(vessel) if vessel else None


def _components(channels: list[Channel]) -> list[tuple[Channel, str]]:
    return [(channel, field) for channel in channels for field in _fields(channel)]


def _empty_channel(
    name: str, source: str, unit: str, fields: list[str], metadata: dict[str, str]
) -> Channel:
    schema_for(tuple(fields))  # a ValueError for fields that no message carries
    none = np.zeros(0, np.int64)
    values = np.zeros((0, len(fields)) if fields else 0)
    return Channel(name, source, unit, none, none, values, tuple(fields), metadata)


def _filled(
    name: str,
    channel: Channel,
    rows: list[Rows],
    measured_ns: TimeArray,
    received_ns: TimeArray,
    values: FloatArray,
) -> Channel:
    """A channel with its samples; `rows` says where each of its fields stands."""
    first = rows[0]
    for field, its in zip(_fields(channel), rows, strict=True):
        paired = len(its) == len(first) and all(
            np.array_equal(stamps[its], stamps[first]) for stamps in (measured_ns, received_ns)
        )
        if not paired:
            raise LogError(
                f"{channel.topic}: its field {field!r} does not pair with {_fields(channel)[0]!r} "
                f"row by row; keep or drop all rows of an instant together: {name}"
            )
    stamps = measured_ns[first], received_ns[first]
    if len(first) and min(int(s.min()) for s in stamps) < 0:
        raise LogError(f"{channel.topic} has times before 1970; mend its clock: {name}")
    columns = [values[its] for its in rows]
    together = np.stack(columns, axis=1) if channel.fields else columns[0]
    return replace(channel, measured_ns=stamps[0], received_ns=stamps[1], values=together)
