"""MCAP to `TrialLog`, by columns."""

import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from google.protobuf.message import DecodeError
from mcap import records

from shiplog.errors import LogError, UsageError
from shiplog.types import Channel, TimeArray, TrialLog, concatenate_channels, is_sorted
from shiplog.units import CATALOGUE, conversion_factor

from .decode import Contents, Piece, schema_of
from .records import MAGIC
from .scan import scan
from .schema import FORMAT_VERSION, Schema, decode_messages
from .summary import Summary, read_summary


@dataclass(frozen=True)
class Span:
    """Times of reception: from `start_ns` on, before `end_ns`; None is no bound."""

    start_ns: int | None = None
    end_ns: int | None = None

    def within(self, received_ns: TimeArray) -> tuple[int, int]:
        """Where the samples start and end that were received within it; (n,) ascending."""
        start = 0 if self.start_ns is None else np.searchsorted(received_ns, self.start_ns)
        end = len(received_ns) if self.end_ns is None else np.searchsorted(received_ns, self.end_ns)
        return int(start), max(int(start), int(end))

    def is_beside(self, first_ns: int, last_ns: int) -> bool:
        """Whether nothing of what lasts from the one to the other is within it."""
        return first_ns <= last_ns and (
            (self.start_ns is not None and last_ns < self.start_ns)
            or (self.end_ns is not None and first_ns >= self.end_ns)
        )


def read(
    path: str | os.PathLike[str],
    *,
    channels: Iterable[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> TrialLog:
    """Read a recorded trial, or a part of it.

    `channels` are named as in `log[...]`; the log keeps them in the order of the file. Samples
    are kept that were received from `start_ns` on and before `end_ns`. Chunks that by the file's
    summary hold none of that are not read: damage in them is not noticed, and the checksum of
    the data as a whole is not verified. A file without a summary is read whole, then cut.

    A file that was not finished is read as far as it goes; a damaged chunk is left out; foreign
    topics are passed over. The log's `warnings` say so.

    Raises `LogError` where the file is missing, is not MCAP, holds a unit nobody knows, or has
    no such channel.
    """
    path = Path(path)
    contents, skip = Contents(), frozenset[int]()
    if isinstance(channels, str):
        channels = (channels,)
    keys = None if channels is None else tuple(channels)
    if start_ns is not None and end_ns is not None and end_ns < start_ns:
        raise UsageError(f"the span ends before it starts, at {end_ns} ns; exchange them: {path}")
    span = Span(start_ns, end_ns)
    part = keys is not None or span != Span()
    with open_mcap(path) as stream:
        summary = read_summary(stream) if part else None
        if summary is not None:
            contents = described(summary)
            contents.wanted = _ids(path, contents, keys)
            skip = _not_wanted(summary, contents.wanted, span)
        for _ in scan(stream, contents, skip):
            pass
    log = trial_log(path, contents)
    return _part(log, keys, span) if part else log


@contextmanager
def open_mcap(path: Path) -> Iterator[IO[bytes]]:
    """The file, opened, if it begins as an MCAP file does.

    Raises `LogError` where it does not, or cannot be read, then or later.
    """
    try:
        with path.open("rb") as stream:
            magic = stream.read(len(MAGIC))
            if not magic:
                raise LogError(f"the file is empty: record or convert it again: {path}")
            if magic != MAGIC:
                raise LogError(f"not an MCAP file; tables are read by `shiplog convert`: {path}")
            stream.seek(0)
            yield stream
    except OSError as error:
        raise LogError(_cannot_read(path, error)) from error


def _cannot_read(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        return f"no such file: {path}"
    if isinstance(error, IsADirectoryError):
        return f"a folder, not a log; name one file in it: {path}"
    return f"cannot read: {(error.strerror or str(error)).lower()}: {path}"


def described(summary: Summary) -> Contents:
    """Contents that know from the start what every message of the file is."""
    return Contents(dict(summary.schemas), dict(summary.channels), keeps_orphans=False)


def trial_log(path: Path, contents: Contents) -> TrialLog:
    """All that the contents hold and say; they are drained.

    Raises `LogError` as `read` does.
    """
    version = contents.metadata.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION:
        raise LogError(
            f"written in format {version}, this shiplog reads format {FORMAT_VERSION}; "
            f"install a newer shiplog: {path}"
        )
    channels = merged(_channels(path, contents).values())
    warnings = list(contents.damage)
    if not contents.finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed); "
            f"its {contents.taken} whole samples were read"
        )
    foreign = [
        channel.topic
        for _, channel in sorted(contents.channels.items())
        if schema_of(channel, contents.schemas) is None
    ]
    if foreign:
        warnings.append(f"passed over {len(foreign)} topics not ours: {', '.join(foreign)}")
    return TrialLog(
        path.name,
        channels,
        contents.metadata,
        contents.vessel_toml,
        tuple(warnings),
        data_lost=contents.cut or bool(contents.damage),
    )


def merged(channels: Iterable[Channel]) -> tuple[Channel, ...]:
    """One channel a topic: a recorder that was started again describes its topics once more."""
    parts: dict[tuple[str, tuple[str, ...]], list[Channel]] = {}
    for channel in channels:
        parts.setdefault(channel.key, []).append(channel)
    whole = map(concatenate_channels, parts.values())
    return tuple(
        c if is_sorted(c.received_ns) else c.take(np.argsort(c.received_ns, kind="stable"))
        for c in whole
    )


def _channels(path: Path, contents: Contents) -> dict[int, Channel]:
    """The samples that the contents hold, by channel id; the contents are drained."""
    pieces = contents.drain()
    found = {}
    for channel_id, record in sorted(contents.channels.items()):
        schema = schema_of(record, contents.schemas)
        if schema is not None:
            found[channel_id] = _channel(path, record, schema, pieces.pop(channel_id, []))
    return found


def _channel(path: Path, record: records.Channel, schema: Schema, pieces: list[Piece]) -> Channel:
    topic_name, _, topic_source = record.topic.strip("/").partition("/")
    name = record.metadata.get("channel", topic_name)
    try:
        received, measured, values = _columns(schema, pieces)
    except DecodeError as error:
        raise LogError(
            f"channel {name!r} holds messages that are no {schema.name}: {path}"
        ) from error
    if not is_sorted(received):
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
    schema: Schema, pieces: list[Piece]
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """A channel's received times, measured times and values (n, k), in the order of the file."""
    if not pieces:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, len(schema.fields)))
    values = [p.values if isinstance(p.values, np.ndarray) else decode_messages(schema, p.values)
              for p in pieces]  # fmt: skip
    return (
        np.concatenate([piece.received for piece in pieces]),
        np.concatenate([piece.measured for piece in pieces]),
        np.concatenate(values),
    )


def _to_si(path: Path, name: str, unit: str) -> tuple[float, str]:
    kind = CATALOGUE.get(name)
    if kind is None:
        return 1.0, unit
    try:
        return conversion_factor(unit, kind.unit), kind.unit
    except UsageError as error:
        raise LogError(f"channel {name!r} should be in {kind.unit}: {error}: {path}") from error


def _ids(path: Path, contents: Contents, keys: Collection[str] | None) -> frozenset[int]:
    """Those of the described channels that are asked for."""
    by_id = _channels(path, contents)
    if keys is None:
        return frozenset(by_id)
    log = TrialLog(path.name, merged(by_id.values()))
    asked = {log[key].key for key in keys}
    return frozenset(id_ for id_, c in by_id.items() if c.key in asked)


def _not_wanted(summary: Summary, ids: frozenset[int], span: Span) -> frozenset[int]:
    """Where the chunks stand that hold nothing of these channels and this span."""
    return frozenset(
        chunk.offset
        for chunk in summary.chunk_places() or ()
        if ids.isdisjoint(chunk.channel_ids) or span.is_beside(chunk.first_ns, chunk.last_ns)
    )


def _part(log: TrialLog, keys: Collection[str] | None, span: Span) -> TrialLog:
    """The channels asked for, of the span asked for."""
    kept = log.channels if keys is None else [log[key] for key in keys]
    parts = [
        channel.part(*span.within(channel.received_ns))
        for channel in log
        if any(channel is one for one in kept)
    ]
    return replace(log, channels=tuple(parts))
