"""Conversion of a file's scanned contents to a `TrialLog`."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from google.protobuf.message import DecodeError
from mcap import records

from shiplog.errors import LogError, UsageError
from shiplog.types import (
    Channel,
    FloatArray,
    TimeArray,
    TrialLog,
    concatenate_channels,
    is_sorted,
)
from shiplog.units import CATALOGUE, conversion_factor

from .decode import McapContents, SampleBlock, schema_of
from .schema import FORMAT_VERSION, Schema, decode_messages

_CHANNEL_KEYS = {"channel", "source", "unit", "positive"}  # of the metadata: attributes of Channel


def build_trial_log(path: Path, contents: McapContents) -> TrialLog:
    """Make a log of the contents scanned so far, and drain them.

    Parameters
    ----------
    path
        The file; its name becomes that of the log.
    contents
        What the scan of the file has collected.

    Raises
    ------
    LogError
        The format version is another one, a unit is unknown, or a message is not of its schema.
    """
    version = contents.metadata.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION:
        raise LogError(
            f"written in format {version}, this shiplog reads format {FORMAT_VERSION}; "
            f"install a newer shiplog: {path}"
        )
    return TrialLog(
        path.name,
        merge_by_topic(channels_by_id(path, contents).values()),
        contents.metadata,
        contents.vessel_toml,
        tuple(_warnings(contents)),
        data_lost=contents.truncated or bool(contents.damage),
    )


def merge_by_topic(channels: Iterable[Channel]) -> tuple[Channel, ...]:
    """Join the channels of each topic into one, in the order of reception.

    A recorder that was restarted within one file describes its topics a second time.
    """
    parts: dict[tuple[str, tuple[str, ...]], list[Channel]] = {}
    for channel in channels:
        parts.setdefault(channel.key, []).append(channel)
    return tuple(
        c if is_sorted(c.received_ns) else c.take(np.argsort(c.received_ns, kind="stable"))
        for c in map(concatenate_channels, parts.values())
    )


def channels_by_id(path: Path, contents: McapContents) -> dict[int, Channel]:
    """Make channels of the contents, by channel id, and drain them.

    A channel that has no samples in the contents is empty. Topics of other programs are omitted.
    """
    blocks = contents.drain()
    channels = {}
    for channel_id, record in sorted(contents.channels.items()):
        schema = schema_of(record, contents.schemas)
        if schema is not None:
            channels[channel_id] = _channel(path, record, schema, blocks.pop(channel_id, []))
    return channels


def _warnings(contents: McapContents) -> list[str]:
    warnings = list(contents.damage)
    if not contents.finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed); "
            f"its {contents.total_samples} complete samples were read"
        )
    foreign = [
        channel.topic
        for _, channel in sorted(contents.channels.items())
        if schema_of(channel, contents.schemas) is None
    ]
    if foreign:
        warnings.append(f"ignored {len(foreign)} topics of other programs: {', '.join(foreign)}")
    return warnings


def _channel(
    path: Path, record: records.Channel, schema: Schema, blocks: list[SampleBlock]
) -> Channel:
    topic_name, _, topic_source = record.topic.strip("/").partition("/")
    name = record.metadata.get("channel", topic_name)
    try:
        received, measured, values = _columns(schema, blocks)
    except DecodeError as error:
        raise LogError(
            f"channel {name!r} has messages that are not {schema.name}; "
            f"correct the program that wrote them: {path}"
        ) from error
    if not is_sorted(received):
        order = np.argsort(received, kind="stable")
        received, measured, values = received[order], measured[order], values[order]
    unit = record.metadata.get("unit", "1")
    if schema.fields in (("value",), ("north", "east")):
        scale, unit = _si_scale(path, name, unit)
        values = values * scale if scale != 1 else values
    is_scalar = schema.fields == ("value",)
    return Channel(
        name,
        record.metadata.get("source", topic_source),
        unit,
        measured,
        received,
        values[:, 0] if is_scalar else values,
        () if is_scalar else schema.fields,
        {key: text for key, text in record.metadata.items() if key not in _CHANNEL_KEYS},
    )


def _columns(schema: Schema, blocks: list[SampleBlock]) -> tuple[TimeArray, TimeArray, FloatArray]:
    """Return the received times, measured times and values (n, k), in the order of the file."""
    if not blocks:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, len(schema.fields)))
    values = [
        block.values
        if isinstance(block.values, np.ndarray)
        else decode_messages(schema, block.values)
        for block in blocks
    ]
    return (
        np.concatenate([block.received for block in blocks]),
        np.concatenate([block.measured for block in blocks]),
        np.concatenate(values),
    )


def _si_scale(path: Path, name: str, unit: str) -> tuple[float, str]:
    """Return the factor to a known channel's unit in shiplog, and that unit."""
    kind = CATALOGUE.get(name)
    if kind is None:
        return 1.0, unit
    try:
        return conversion_factor(unit, kind.unit), kind.unit
    except UsageError as error:
        raise LogError(f"channel {name!r} should be in {kind.unit}: {error}: {path}") from error
