"""MCAP files of other programs, read as trials by a layout."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from mcap import records

from shiplog.errors import LayoutError, LogError
from shiplog.layouts.mcap_layout import FieldChannel, McapLayout
from shiplog.mcap.clock_repair import MixedTimes
from shiplog.mcap.contents import McapContents, SampleBlock
from shiplog.mcap.mcap_file import open_mcap
from shiplog.mcap.scan import scan
from shiplog.mcap.schema import ENCODING, schema_for
from shiplog.mcap.trial_log import build_trial_log
from shiplog.types import TrialLog

from .field_conversion import ConvertedFields
from .topic_choice import choose_topics, read_file_topics
from .topic_samples import TopicSamples


def read_foreign_mcap(path: Path, layout: McapLayout) -> tuple[TrialLog, list[MixedTimes]]:
    """Read the topics of an MCAP file that a layout describes, and the channels of shiplog in it.

    What was not measured is dropped and counted in the warnings: NaN, absent and infinite values, a
    covariance of -1 of a `sensor_msgs/Imu`, a `sensor_msgs/NavSatFix` without fix. Steps of the
    clocks are repaired as in `shiplog.read`.

    Parameters
    ----------
    path
        The MCAP file.
    layout
        Its description.

    Returns
    -------
    log, mixed
        The trial in SI units, and the spans for which the caller has to call `refuse_mixed_times`.

    Raises
    ------
    LayoutError
        The file does not have the topics or fields of the layout; all errors at once.
    LogError
        The file is not MCAP, or messages cannot be decoded.
    """
    channels = choose_topics(layout, read_file_topics(path), path)
    converted = _Converted(path, layout, channels)
    names = {channel.choice.topic for channel in channels}
    contents = McapContents(keeps=lambda record, _: record.topic in names)
    with open_mcap(path) as file:
        for _ in scan(file, contents):
            converted.add(contents)
    errors = [text for topic in converted.topics.values() for text in topic.errors()]
    if errors:
        listed = "; ".join(dict.fromkeys(errors))
        raise LayoutError(f"{listed}; correct {layout.where}: {path}")
    useless = [topic for topic in converted.topics.values() if topic.failed == topic.total]
    if useless:
        raise LogError(f"{'; '.join(text for topic in useless for text in topic.damage())}: {path}")
    converted.move_to(contents)
    contents.metadata |= {"converted_from": path.name, "layout": layout.name}
    log = build_trial_log(path, contents)
    damage = [text for topic in converted.topics.values() for text in topic.damage()]
    warnings = [text for topic in converted.topics.values() for text in topic.warnings()]
    if layout.assumed:
        warnings.append(
            f"the layout assumes the {', the '.join(layout.assumed)}; compare with the ship and "
            f"remove `assumed` there: {layout.where}"
        )
    filled = tuple(channel for channel in log if len(channel))
    log = replace(
        log,
        channels=filled,
        warnings=(*log.warnings, *damage, *warnings),
        data_lost=log.data_lost or bool(damage),
    )
    return log, contents.mixed_times


@dataclass(eq=False)
class _Converted:
    """The samples converted so far.

    Attributes
    ----------
    path, layout, channels
        The file, the layout, and its channels with their topics.
    topics
        The topics, by the id of their channel in the file.
    blocks
        Their samples, by that id and the name and source of the channel they become.
    """

    path: Path
    layout: McapLayout
    channels: Sequence[FieldChannel]
    topics: dict[int, TopicSamples] = field(default_factory=dict)
    blocks: dict[tuple[int, str, str], list[SampleBlock]] = field(default_factory=dict)
    _records: dict[tuple[int, str, str], tuple[FieldChannel, ConvertedFields]] = field(
        default_factory=dict
    )

    def add(self, contents: McapContents) -> None:
        """Convert the messages that a scan has kept."""
        for channel_id, blocks in contents.take_kept().items():
            topic = self._topic(channel_id, contents)
            if topic is None:
                continue
            for kept in blocks:
                for channel, values, block in topic.add(kept):
                    key = channel_id, values.name, channel.source
                    self._records[key] = channel, values
                    self.blocks.setdefault(key, []).append(block)
                    contents.total_samples += len(block.received)

    def move_to(self, contents: McapContents) -> None:
        """Add the samples to the contents of the file, as if it had channels of shiplog.

        So their clocks are checked with those of all other channels.
        """
        names = {channel.choice.topic for channel in self.channels}
        contents.channels = {
            id_: record for id_, record in contents.channels.items() if record.topic not in names
        }
        new_id = max((*contents.channels, *contents.schemas, 0)) + 1
        for key, (channel, values) in self._records.items():
            schema = schema_for(values.components)
            contents.schemas[new_id] = records.Schema(
                id=new_id, data=b"", encoding=ENCODING, name=schema.name
            )
            contents.channels[new_id] = records.Channel(
                id=new_id,
                topic=f"/{values.name}/{channel.source}",
                message_encoding=ENCODING,
                metadata=_metadata(channel, values),
                schema_id=new_id,
            )
            contents.blocks[new_id] = sorted(self.blocks[key], key=lambda block: block.number)
            new_id += 1

    def _topic(self, channel_id: int, contents: McapContents) -> TopicSamples | None:
        """Return the reader of a channel of the file; None for one of another type."""
        if channel_id not in self.topics:
            record = contents.channels[channel_id]
            schema = contents.schemas.get(record.schema_id)
            mine = [
                channel
                for channel in self.channels
                if channel.choice.topic == record.topic
                and channel.choice.type == (schema.name if schema else "")
            ]
            if not mine:
                return None
            unit = self.layout.stamp_unit
            try:
                self.topics[channel_id] = TopicSamples(record, schema, mine, unit)
            except LogError as error:
                raise LogError(f"{error}: {self.path}") from error
        return self.topics[channel_id]


def _metadata(channel: FieldChannel, values: ConvertedFields) -> dict[str, str]:
    """Return the metadata of a channel, with the fields it was read from."""
    fields = ", ".join(channel.paths)
    return dict(channel.metadata) | {
        "channel": values.name,
        "source": channel.source,
        "unit": values.unit,
        "read_from": f"{channel.choice.topic}: {fields}",
    }
