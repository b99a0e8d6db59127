"""Choice of the topics of a file that a layout describes, by their names or types."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mcap import records

from shiplog.errors import LayoutError
from shiplog.layouts.mcap_layout import FieldChannel, McapLayout
from shiplog.mcap.contents import McapContents
from shiplog.mcap.mcap_file import open_mcap
from shiplog.mcap.scan import scan
from shiplog.units import did_you_mean

from .topic_samples import short_type

MAX_LISTED = 8  # topics or types in a message


@dataclass(frozen=True)
class FileTopic:
    """A topic of a file, with messages of one type.

    Attributes
    ----------
    record, schema
        The records that describe it.
    messages
        The number of its messages.
    """

    record: records.Channel
    schema: records.Schema | None
    messages: int

    @property
    def topic(self) -> str:
        """Its name."""
        return self.record.topic

    @property
    def type(self) -> str:
        """The name of its schema; empty if it has none."""
        return self.schema.name if self.schema else ""


def read_file_topics(path: Path) -> list[FileTopic]:
    """Return the topics of an MCAP file, by its summary, or else by a scan.

    Raises
    ------
    LogError
        The file is missing or is not MCAP.
    """
    with open_mcap(path) as file:
        summary = None if file.check.is_intact is False else file.check.summary
        if summary is not None:
            counts = summary.statistics.channel_message_counts
            schemas, channels = summary.schemas, summary.channels
        else:
            contents = McapContents(selected=frozenset(), keeps=lambda *_: True)
            numbers: dict[int, int] = {}
            for _ in scan(file, contents):
                contents.event_messages.clear()
                for channel_id, blocks in contents.take_kept().items():
                    count = sum(len(block.messages) for block in blocks)
                    numbers[channel_id] = numbers.get(channel_id, 0) + count
            counts, schemas, channels = numbers, contents.schemas, contents.channels
    return [
        FileTopic(record, schemas.get(record.schema_id), counts.get(channel_id, 0))
        for channel_id, record in sorted(channels.items())
    ]


def choose_topics(
    layout: McapLayout, topics: Sequence[FileTopic], path: Path
) -> list[FieldChannel]:
    """Return the channels of a layout, each with its topic, type, stamp and source.

    Raises
    ------
    LayoutError
        Topics are missing or ambiguous, or two channels are alike; all errors at once, with the
        nearest names in the file.
    """
    errors: list[str] = []
    channels = []
    for channel in layout.channels:
        found = _topics_of(channel, topics)
        if isinstance(found, str):
            errors.append(f"{channel.label}: {found}")
            continue
        stamp = channel.choice.stamp or layout.stamp
        choice = replace(channel.choice, topic=found.topic, type=found.type, stamp=stamp)
        source = channel.source or layout.source or source_of_topic(found.topic)
        channels.append(replace(channel, choice=choice, source=source))
    labels = [channel.label for channel in channels]
    errors += [
        f"two sections give {label}; state a source, such as [{label.replace('.', '.x_')}]"
        for label in dict.fromkeys(labels)
        if labels.count(label) > 1
    ]
    if errors:
        raise LayoutError(f"{'; '.join(errors)}; correct {layout.where}: {path}")
    return channels


def source_of_topic(topic: str) -> str:
    """Return the source that a topic names.

    Examples
    --------
    >>> source_of_topic("/imu/data")
    'imu_data'
    """
    return re.sub(r"[^\w-]+", "_", topic).strip("_") or "mcap"


def _topics_of(channel: FieldChannel, topics: Sequence[FileTopic]) -> FileTopic | str:
    """Return the topic of a channel, or why there is none."""
    choice = channel.choice
    found = [topic for topic in topics if not choice.topic or topic.topic == choice.topic]
    if not found:
        return _unknown("topic", choice.topic, (topic.topic for topic in topics))
    wanted = short_type(choice.type)
    typed = [topic for topic in found if not wanted or short_type(topic.type) == wanted]
    if not typed:
        return _unknown("type", choice.type, (topic.type for topic in found))
    names = list(dict.fromkeys(topic.topic for topic in typed))
    if len(names) > 1:
        return f"several topics have the type {choice.type}, state topic: {_listed(names)}"
    types = list(dict.fromkeys(topic.type for topic in typed))
    if len(types) > 1:
        return f"{names[0]} has messages of several types, state type: {_listed(types)}"
    return typed[0]


def _unknown(what: str, name: str, known: Iterable[str]) -> str:
    names = [each for each in dict.fromkeys(known) if each]
    near = did_you_mean(name, names)
    return f"no {what} {name!r}{near or f'; the file has {_listed(names)}'}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return (", ".join(names[:MAX_LISTED]) or "none") + more
