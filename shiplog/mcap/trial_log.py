"""Conversion of a file's scanned contents to a `TrialLog`."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from mcap import records

from shiplog.errors import LogError, UsageError
from shiplog.types import (
    Channel,
    TrialLog,
    concatenate_channels,
    is_sorted,
)
from shiplog.units import CATALOGUE, conversion_factor, utc_text

from .clock_repair import MessageColumns, drop_impossible_times, repair_clock_steps
from .contents import McapContents, SampleBlock
from .damage import damage_warnings, is_any_lost
from .decode import is_foreign, schema_of
from .schema import FORMAT_VERSION, Schema
from .still_clocks import replace_still_times
from .unset_times import replace_unset_times

FOREIGN_TOPICS = "topics of other programs"
FOREIGN_RECORDS = "attachments and metadata records of other programs"
MAX_NAMES = 8  # of ignored records that a warning lists
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
        The format version is another one, or a unit is unknown.
    """
    version = contents.metadata.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION and not (contents.damage or contents.lost_mcap_chunks):
        raise LogError(
            f"written in format {version}, this shiplog reads format {FORMAT_VERSION}; "
            f"install a newer shiplog: {path}"
        )
    channels = merge_by_topic(channels_by_id(path, contents).values())
    contents.pauses.add(channels)
    last = [int(channel.received_ns.max()) for channel in channels if len(channel)]
    before = [] if contents.last_sample_ns is None else [contents.last_sample_ns]
    contents.last_sample_ns = max(last + before, default=None)
    return TrialLog(
        path.name,
        channels,
        contents.metadata,
        contents.vessel_toml,
        tuple(_warnings(contents)),
        contents.truncated or bool(contents.not_of_schema) or _is_part_lost(contents),
        tuple(contents.events),
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
    described, columns = {}, {}
    for channel_id, record in sorted(contents.channels.items()):
        schema = schema_of(record, contents.schemas)
        if schema is not None:
            described[channel_id] = record, schema
            columns[channel_id] = _columns(record, schema, blocks.pop(channel_id, []), contents)
    columns = _with_repaired_times(path, columns, contents)
    return {
        channel_id: _channel(path, *description, columns.pop(channel_id))
        for channel_id, description in described.items()
    }


def _with_repaired_times(
    path: Path, columns: dict[int, MessageColumns], contents: McapContents
) -> dict[int, MessageColumns]:
    """Drop impossible times and remove steps of the clocks; the contents receive the warnings."""
    as_recorded = columns
    columns, replaced = replace_unset_times(columns)
    columns, still = replace_still_times(columns)
    columns, dropped = drop_impossible_times(columns)
    repair = repair_clock_steps(path.name, columns)
    contents.clock_warnings += replaced + still + dropped + repair.warnings
    contents.mixed_times += repair.mixed
    _decode_events(contents, as_recorded, repair.columns)
    return repair.columns


def _decode_events(
    contents: McapContents,
    as_recorded: Mapping[int, MessageColumns],
    repaired: Mapping[int, MessageColumns],
) -> None:
    """Decode the events that are not yet, with times repaired as those of the samples."""
    if not contents.event_messages:
        return
    from .messages import decode_event  # noqa: PLC0415 - protobuf takes long to import

    events, contents.event_messages = contents.event_messages, []
    is_changed = any(repaired[id_] is not channel for id_, channel in as_recorded.items())
    for event in events:
        shift = _shift_at(event.position, as_recorded, repaired) if is_changed else 0
        try:
            contents.events.append(decode_event(event.data, event.time_ns + shift))
        except ValueError as error:
            contents.report(f"skipped an event: {error}")


def concerns_kept(warning: str, *, with_topics: bool) -> bool:
    """Whether a warning of a log is about what a copy keeps; see `kept_groups`."""
    kept = (FOREIGN_TOPICS, FOREIGN_RECORDS) if with_topics else (FOREIGN_RECORDS,)
    return warning.startswith("ignored ") and any(words in warning for words in kept)


def no_samples_error(
    action: str, warnings: Sequence[str], where: str | os.PathLike[str]
) -> LogError:
    """Return the error for a log without samples, with the reader's warnings.

    Examples
    --------
    >>> str(no_samples_error("view", [], "trial.mcap"))
    'nothing to view, no samples of shiplog: record it again: trial.mcap'
    """
    causes = "; ".join(warnings) or "record it again"
    if any(FOREIGN_TOPICS in warning for warning in warnings):
        causes += "; read them by a layout, which `shiplog layout` drafts"
    return LogError(f"nothing to {action}, no samples of shiplog: {causes}: {where}")


def _shift_at(
    position: int,
    as_recorded: Mapping[int, MessageColumns],
    repaired: Mapping[int, MessageColumns],
) -> int:
    """Return by how much the time of the last sample before a place in the file was changed, ns."""
    last, shift = -1, 0
    for id_, channel in repaired.items():
        row = int(np.searchsorted(channel.positions, position)) - 1
        if row >= 0 and channel.positions[row] > last:
            last = int(channel.positions[row])
            original = as_recorded[id_]
            then = original.received_ns[np.searchsorted(original.positions, last)]
            shift = int(channel.received_ns[row] - then)
    return shift


def _warnings(contents: McapContents) -> list[str]:
    # where a part is lost, the pauses are those of the lost samples
    pauses = [] if _is_part_lost(contents) else contents.pauses.warnings()
    warnings = [
        *contents.part_warnings,
        *damage_warnings(contents.damage),
        *(
            f"{topic}: {count} messages are not {name} and were dropped; correct the program that "
            "wrote them"
            for (topic, name), count in contents.not_of_schema.items()
        ),
        *contents.clock_warnings,
        *pauses,
    ]
    if not contents.finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed); "
            f"its {contents.total_samples} complete samples were read"
            f"{_last_reception(contents.last_sample_ns)}; the end is missing"
        )
    foreign = [
        channel.topic
        for _, channel in sorted(contents.channels.items())
        if is_foreign(channel, contents.schemas)
    ]
    if foreign:
        warnings.append(f"ignored {len(foreign)} {FOREIGN_TOPICS}: {', '.join(foreign)}")
    if contents.foreign_records:
        names = list(contents.foreign_records)
        more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
        warnings.append(
            f"ignored {len(names)} {FOREIGN_RECORDS}, which only a copy in MCAP keeps: "
            f"{', '.join(names[:MAX_NAMES])}{more}"
        )
    return warnings


def _is_part_lost(contents: McapContents) -> bool:
    """Whether a part of the file is lost, up to its end."""
    return contents.is_part_missing or is_any_lost(contents.damage)


def _last_reception(time_ns: int | None) -> str:
    """Return in words when the last sample of a file was received; nothing where it has none."""
    return "" if time_ns is None else f", the last one received at {utc_text(time_ns * 1e-9)}"


def _channel(
    path: Path, record: records.Channel, schema: Schema, columns: MessageColumns
) -> Channel:
    name, source = _name_and_source(record)
    received, measured, values = columns.received_ns, columns.measured_ns, columns.values
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
        source,
        unit,
        measured,
        received,
        values[:, 0] if is_scalar else values,
        () if is_scalar else schema.fields,
        {
            key: text
            for key, text in record.metadata.items()
            if key not in _CHANNEL_KEYS or (key == "positive" and name not in CATALOGUE)
        },
    )


def _name_and_source(record: records.Channel) -> tuple[str, str]:
    topic_name, _, topic_source = record.topic.strip("/").partition("/")
    name = record.metadata.get("channel", topic_name)
    return name, record.metadata.get("source", topic_source)


def _columns(
    record: records.Channel, schema: Schema, blocks: Sequence[SampleBlock], contents: McapContents
) -> MessageColumns:
    """Return the messages of a channel in the order of the file; the contents count wrong ones."""
    name, source = _name_and_source(record)
    topic = f"/{name}/{source}"
    if not blocks:
        times = np.empty(0, np.int64)
        return MessageColumns(topic, times, times, times, np.empty((0, len(schema.fields))))
    decoded = [_decoded(schema, block) for block in blocks]
    counts = [sum(len(block.offsets) for block in each) for each in (blocks, decoded)]
    if counts[0] > counts[1]:
        contents.not_of_schema[record.topic, schema.name] += counts[0] - counts[1]
    return MessageColumns(
        topic,
        np.concatenate([(block.number << 32) + block.offsets for block in decoded]),
        np.concatenate([block.received for block in decoded]),
        np.concatenate([block.measured for block in decoded]),
        np.concatenate([block.values for block in decoded]),
    )


def _decoded(schema: Schema, block: SampleBlock) -> SampleBlock:
    """Return a block with its values decoded, without the messages that are not of the schema."""
    if isinstance(block.values, np.ndarray):
        return block
    from .messages import decode_messages  # noqa: PLC0415 - protobuf takes long to import

    values, good = decode_messages(schema, block.values)
    return replace(
        block,
        received=block.received[good],
        measured=block.measured[good],
        values=values[good],
        offsets=block.offsets[good],
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
