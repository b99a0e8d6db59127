"""MCAP to `TrialLog`, by columns."""

import mmap
import os
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from google.protobuf.message import DecodeError
from mcap import records

from .errors import LogError, UsageError
from .mcap_layout import MAGIC
from .scan import Bytes, Contents, scan, schema_of
from .schema import FORMAT_VERSION, Schema, decode
from .types import Channel, TrialLog
from .units import CATALOGUE, factor


def read(path: str | os.PathLike[str]) -> TrialLog:
    """Read a recorded trial.

    A file that was not finished is read as far as it goes; a damaged chunk is left out; foreign
    topics are passed over. The log's `warnings` say so.

    Raises `LogError` where the file is missing, is not MCAP, or holds a unit nobody knows.
    """
    path = Path(path)
    with open_mcap(path) as stream:
        # unmapped by its last reader: closing it would fail while an exception holds a slice
        contents = scan(Bytes(mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)))
    return _trial_log(path, contents)


def open_mcap(path: Path) -> IO[bytes]:
    """The file, opened, if it exists and begins as an MCAP file does; else `LogError`."""
    try:
        stream = path.open("rb")
    except OSError as error:
        raise LogError(_cannot_read(path, error)) from error
    try:
        magic = stream.read(len(MAGIC))
        stream.seek(0)
    except OSError as error:
        stream.close()
        raise LogError(_cannot_read(path, error)) from error
    if magic != MAGIC:
        stream.close()
        if not magic:
            raise LogError(f"the file is empty: record or convert it again: {path}")
        raise LogError(f"not an MCAP file; tables are read by `shiplog convert`: {path}")
    return stream


def _cannot_read(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return f"no such file: {path}"
    if isinstance(error, IsADirectoryError):
        return f"a folder, not a log; name one file in it: {path}"
    return f"cannot read: {(error.strerror or str(error)).lower()}: {path}"


def _trial_log(path: Path, contents: Contents) -> TrialLog:
    version = contents.metadata.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION:
        raise LogError(
            f"written in format {version}, this shiplog reads format {FORMAT_VERSION}; "
            f"install a newer shiplog: {path}"
        )
    channels, foreign = [], []
    for channel_id, record in sorted(contents.channels.items()):
        schema = schema_of(record, contents)
        if schema is None:
            foreign.append(record.topic)
        else:
            channels.append(_channel(path, record, schema, contents, channel_id))
    channels = _merged(channels)
    warnings = list(contents.damage)
    if not contents.finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed); "
            f"its {sum(map(len, channels))} whole samples were read"
        )
    if foreign:
        warnings.append(f"passed over {len(foreign)} topics not ours: {', '.join(foreign)}")
    return TrialLog(
        path.name,
        tuple(channels),
        contents.metadata,
        contents.vessel_toml,
        tuple(warnings),
        data_lost=contents.cut or bool(contents.damage),
    )


def _merged(channels: list[Channel]) -> list[Channel]:
    """One channel a topic: a recorder that was started again describes its topics once more."""
    merged: dict[tuple[str, tuple[str, ...]], Channel] = {}
    for channel in channels:
        key = (channel.topic, channel.fields)
        if key in merged:
            first = merged[key]
            received = np.concatenate((first.received_ns, channel.received_ns))
            order = np.argsort(received, kind="stable")
            channel = replace(  # noqa: PLW2901 - the same channel, whole
                first,
                received_ns=received[order],
                measured_ns=np.concatenate((first.measured_ns, channel.measured_ns))[order],
                values=np.concatenate((first.values, channel.values))[order],
            )
        merged[key] = channel
    return list(merged.values())


def _channel(
    path: Path,
    record: records.Channel,
    schema: Schema,
    contents: Contents,
    channel_id: int,
) -> Channel:
    topic_name, _, topic_source = record.topic.strip("/").partition("/")
    name = record.metadata.get("channel", topic_name)
    try:
        received, measured, values = _columns(schema, contents, channel_id)
    except DecodeError as error:
        raise LogError(
            f"channel {name!r} holds messages that are no {schema.name}: {path}"
        ) from error
    if np.any(received[1:] < received[:-1]):
        order = np.argsort(received, kind="stable")
        received, measured, values = received[order], measured[order], values[order]
    unit = record.metadata.get("unit", "1")
    if schema.fields in (("value",), ("north", "east")):
        scale, unit = _to_si(path, name, unit)
        values = values * scale if scale != 1 else values
    scalar = schema.fields == ("value",)
    ours = {"channel", "source", "unit", "positive"}
    return Channel(
        name,
        record.metadata.get("source", topic_source),
        unit,
        measured,
        received,
        values[:, 0] if scalar else values,
        () if scalar else schema.fields,
        {key: value for key, value in record.metadata.items() if key not in ours},
    )


def _columns(
    schema: Schema, contents: Contents, channel_id: int
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A channel's received times, measured times and values (n, k), in the order of the file."""
    slabs = [
        (
            slab["received"].astype(np.int64),
            slab["measured"].astype(np.int64),
            np.stack([slab[name] for name in schema.fields], axis=1),
        )
        for slab in contents.columns.get(channel_id, [])
    ]
    ragged = contents.ragged.get(channel_id, [])
    if ragged or not slabs:
        received, measured, data = zip(*ragged, strict=True) if ragged else ((), (), ())
        slabs.append(
            (
                np.array(received, np.uint64).astype(np.int64),
                np.array(measured, np.uint64).astype(np.int64),
                decode(schema, list(data)),
            )
        )
    return tuple(np.concatenate(column) for column in zip(*slabs, strict=True))  # type: ignore[return-value]


def _to_si(path: Path, name: str, unit: str) -> tuple[float, str]:
    kind = CATALOGUE.get(name)
    if kind is None:
        return 1.0, unit
    try:
        return factor(unit, kind.unit), kind.unit
    except UsageError as error:
        raise LogError(f"channel {name!r} should be in {kind.unit}: {error}: {path}") from error
