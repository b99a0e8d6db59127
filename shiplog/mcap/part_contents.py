"""Contents of the parts of a log, joined: each file has its own ids of schemas and channels."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from .contents import McapContents, MessageCount
from .schema import PART_KEY


class PartContents:
    """Moves what the scan of one part collects to the contents of the whole log.

    A channel that is described as one of the parts before is that one, so that the contents are
    those of a single file. Any other one is added under a free id.

    Parameters
    ----------
    path
        The part, for messages.
    whole
        The contents of the log so far.

    Attributes
    ----------
    own
        The contents to scan the part into.
    """

    def __init__(self, path: Path, whole: McapContents) -> None:
        self._path, self._whole = path, whole
        self._first_block = whole.data_blocks
        self._schema_ids: dict[int, int] = {0: 0}
        self._channel_ids: dict[int, int] = {}
        self.own = McapContents(
            selected=whole.selected,
            keep_undescribed=whole.keep_undescribed,
            keeps=whole.keeps,
            keep_records=whole.keep_records,
            latest_ns=whole.latest_ns,
        )

    def move(self) -> None:
        """Move the messages that were collected since the last call."""
        own, whole = self.own, self._whole
        self._join_descriptions()
        samples = own.pending_samples
        for own_id, blocks in own.drain().items():
            moved = [replace(b, number=b.number + self._first_block) for b in blocks]
            whole.blocks.setdefault(self._channel_ids[own_id], []).extend(moved)
        whole.pending_samples += samples
        whole.total_samples += samples
        for own_id, kept in own.take_kept().items():
            moved_kept = [replace(k, number=k.number + self._first_block) for k in kept]
            whole.kept.setdefault(self._channel_ids[own_id], []).extend(moved_kept)
        whole.records += own.records
        own.records = []
        for event in own.event_messages:
            position = event.position + (self._first_block << 32)
            whole.event_messages.append(replace(event, position=position))
        own.event_messages.clear()
        whole.data_blocks = self._first_block + own.data_blocks
        whole.in_order &= own.in_order
        whole.latest_ns = own.latest_ns

    def finish(self) -> None:
        """Move the rest of the messages, and what is known of the part as a whole."""
        self.move()
        own, whole = self.own, self._whole
        for own_id, count in own.not_decoded.items():
            joined = whole.not_decoded.setdefault(self._channel_ids[own_id], MessageCount())
            joined.count += count.count
            joined.size += count.size
            joined.first_ns = min(joined.first_ns, count.first_ns)
            joined.last_ns = max(joined.last_ns, count.last_ns)
        whole.metadata |= {k: t for k, t in own.metadata.items() if not k.startswith(PART_KEY)}
        whole.vessel_toml = own.vessel_toml or whole.vessel_toml
        whole.foreign_records |= own.foreign_records
        whole.truncated |= own.truncated
        whole.damage += [replace(damage, file=self._path.name) for damage in own.damage]

    def _join_descriptions(self) -> None:
        own, whole = self.own, self._whole
        for own_id, schema in own.schemas.items():
            if own_id not in self._schema_ids:
                known = (
                    i for i, each in whole.schemas.items() if replace(each, id=own_id) == schema
                )
                self._schema_ids[own_id] = id_ = next(known, _free_id(whole.schemas))
                whole.schemas.setdefault(id_, replace(schema, id=id_))
        for own_id, channel in own.channels.items():
            if own_id in self._channel_ids or channel.schema_id not in self._schema_ids:
                continue
            joined = replace(channel, schema_id=self._schema_ids[channel.schema_id])
            taken = set(self._channel_ids.values())
            known = (
                i
                for i, each in whole.channels.items()
                if i not in taken and replace(each, id=own_id) == joined
            )
            self._channel_ids[own_id] = id_ = next(known, _free_id(whole.channels))
            whole.channels.setdefault(id_, replace(joined, id=id_))


def _free_id(taken: Mapping[int, object]) -> int:
    return max(taken, default=0) + 1
