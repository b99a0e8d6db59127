"""What the scan of an MCAP file collects: samples, raw packets and events by channel."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from mcap import records
from mcap.records import AttachmentIndex
from numpy.typing import NDArray

from shiplog.types import Event, FloatArray, TimeArray

from .clock_repair import MixedTimes
from .damage import Damage
from .locate import Offsets, record_sizes
from .pauses import Pauses
from .record_walk import Record
from .records import MESSAGE_HEAD


@dataclass(frozen=True, eq=False)
class SampleBlock:
    """The samples of one channel in one MCAP chunk.

    Attributes
    ----------
    received, measured
        (n,) times, ns.
    values
        (n, k), or n messages that are still to be decoded since their layout is not fixed.
    number
        The number of the MCAP chunk, or run of messages outside of MCAP chunks, in the file.
    offsets
        (n,) offsets of the messages in its data.
    sequences
        The sequence numbers of the first and the last message.
    """

    received: TimeArray
    measured: TimeArray
    values: FloatArray | list[bytes]
    number: int
    offsets: Offsets
    sequences: tuple[int, int] = (0, 0)


@dataclass
class MessageCount:
    """The messages of one topic that are counted but not decoded.

    Attributes
    ----------
    count
        The number of messages.
    size
        Their size in bytes.
    first_ns, last_ns
        The earliest and the latest time of reception, ns; of no messages, in the wrong order.
    """

    count: int = 0
    size: int = 0
    first_ns: int = 2**63 - 1
    last_ns: int = -(2**63)

    def add(self, heads: NDArray[np.void]) -> None:
        """Count further messages, given their heads (n,)."""
        received_ns = heads["received"].astype(np.int64)
        self.count += len(heads)
        self.size += int(record_sizes(heads).sum()) - MESSAGE_HEAD.itemsize * len(heads)
        self.first_ns = min(self.first_ns, int(received_ns.min()))
        self.last_ns = max(self.last_ns, int(received_ns.max()))


@dataclass(frozen=True)
class EventMessage:
    """A message of the topic of events, as it is in the file.

    Attributes
    ----------
    position
        Its place in the file, common to all channels, as in `MessageColumns`.
    time_ns
        When it happened, ns since 1970-01-01 UTC.
    data
        The serialised message.
    """

    position: int
    time_ns: int
    data: bytes


@dataclass(frozen=True, eq=False)
class KeptMessages:
    """The messages of one channel in one MCAP chunk, as they are in the file.

    Attributes
    ----------
    received, measured
        (n,) times of logging and of publication, ns.
    messages
        n serialised messages.
    number, offsets
        Their place in the file, as in `SampleBlock`.
    """

    received: TimeArray
    measured: TimeArray
    messages: list[bytes]
    number: int
    offsets: Offsets


# whether the messages of a channel are kept as they are, given the schemas of the file
Keeps = Callable[[records.Channel, Mapping[int, records.Schema]], bool]


@dataclass(frozen=True)
class LostMcapChunk:
    """An MCAP chunk that cannot be read.

    Attributes
    ----------
    start, end
        The offsets of its first byte and of the byte after its last.
    messages
        The number of its messages; 0 if unknown.
    channel_ids
        Their channels, as far as known.
    span_ns
        Their times of reception, ns, the last included.
    cause
        Why it cannot be read, in words.
    """

    start: int
    end: int
    messages: int
    channel_ids: tuple[int, ...]
    span_ns: tuple[int, int]
    cause: str


@dataclass
class McapContents:
    """What the scan of a file has collected so far.

    Attributes
    ----------
    schemas, channels
        The schema and channel records, by id.
    description_bytes
        The memory that they take, about.
    messages
        The number of messages of all kinds read so far.
    selected
        The ids of the channels whose messages are kept; None for all.
    blocks
        The samples not yet taken by `drain`, by channel id, in the order of the file.
    pending_samples
        The number of samples in `blocks`.
    total_samples
        The number of samples read so far.
    undescribed
        Messages whose channel is not described yet: the data, the channel id, the offsets, and the
        number of their MCAP chunk.
    undescribed_bytes
        The size of these data.
    undescribed_counts
        The number of such messages, by channel id.
    keep_undescribed
        Whether to keep them, because a later record may describe their channel.
    not_decoded
        The numbers of raw packets, and of messages of other programs, by channel id.
    keeps
        Selects the channels whose messages are kept as they are in `kept`; none where it is None.
    kept
        The messages kept and not yet taken, by channel id, in the order of the file.
    held_bytes
        The size of the messages in `blocks` and `kept` that are not decoded.
    keep_records
        Whether to keep the intact records in `records` too.
    records
        Those not yet taken, in the order of the file; of an MCAP chunk and of a run of messages
        outside of them, its data.
    long_attachments
        Receives the indexes of intact attachments that are too long to be read at once, by their
        offsets; None where these are reported as not read.
    event_messages
        The events not yet decoded.
    events
        The events decoded so far.
    foreign_records
        The attachments and metadata records of other programs, in words; a dict for their order.
    metadata
        Text about the trial, by key.
    vessel_toml
        The attached vessel file, or None.
    in_order
        Whether each MCAP chunk was received after the one before, by its own times.
    latest_ns
        The last time of reception in the MCAP chunks so far, ns.
    last_sample_ns
        The last time of reception of the samples in the logs made so far, ns; None for none.
    finished
        Whether the file has its footer.
    truncated
        Whether an unfinished file ends within a record.
    damage
        The damaged parts so far.
    lost_mcap_chunks
        The lost MCAP chunks that are not yet in `damage`, as a later record may name their topics.
    reading
        The offsets, start and end, of the record that is being read.
    block_starts
        The offset of each MCAP chunk, or run of messages outside of them, by its number.
    is_whole
        Whether no samples were taken by `drain` so far.
    mcap_chunks_read
        The offsets of the MCAP chunks read so far, by their heads.
    data_blocks
        The number of MCAP chunks, and runs of messages outside of them, read so far.
    not_of_schema
        The numbers of messages that are not of their schema and were dropped, by topic and schema.
    clock_warnings
        Warnings about times of messages in the samples drained so far.
    mixed_times
        Steps of clocks that were not repaired in the samples drained so far.
    pauses
        Gaps in all channels in the samples drained so far.
    part_warnings, is_part_missing
        What is missing between the parts of a log that has several files, and whether one is.
    """

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    description_bytes: int = 0
    messages: int = 0
    selected: frozenset[int] | None = None
    blocks: dict[int, list[SampleBlock]] = field(default_factory=dict)
    pending_samples: int = 0
    total_samples: int = 0
    undescribed: list[tuple[bytes, int, Offsets, int]] = field(default_factory=list)
    undescribed_bytes: int = 0
    undescribed_counts: dict[int, int] = field(default_factory=dict)
    keep_undescribed: bool = True
    not_decoded: dict[int, MessageCount] = field(default_factory=dict)
    keeps: Keeps | None = None
    kept: dict[int, list[KeptMessages]] = field(default_factory=dict)
    held_bytes: int = 0
    keep_records: bool = False
    records: list[Record] = field(default_factory=list)
    long_attachments: dict[int, AttachmentIndex] | None = None
    event_messages: list[EventMessage] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    foreign_records: dict[str, None] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None
    in_order: bool = True
    latest_ns: int = 0
    last_sample_ns: int | None = None
    finished: bool = False
    truncated: bool = False
    damage: list[Damage] = field(default_factory=list)
    lost_mcap_chunks: list[LostMcapChunk] = field(default_factory=list)
    reading: tuple[int, int] = (0, 0)
    block_starts: list[int] = field(default_factory=list)
    is_whole: bool = True
    mcap_chunks_read: dict[bytes, int] = field(default_factory=dict)
    data_blocks: int = 0
    not_of_schema: Counter[tuple[str, str]] = field(default_factory=Counter)
    clock_warnings: list[str] = field(default_factory=list)
    mixed_times: list[MixedTimes] = field(default_factory=list)
    pauses: Pauses = field(default_factory=Pauses)
    part_warnings: tuple[str, ...] = ()
    is_part_missing: bool = False

    def drain(self) -> dict[int, list[SampleBlock]]:
        """Return the blocks collected so far, by channel id, and release them."""
        blocks, self.blocks, self.pending_samples = self.blocks, {}, 0
        self.held_bytes, self.is_whole = 0, False
        return blocks

    def keep(self, opcode: int, content: bytes) -> None:
        """Keep the record that is being read, where records are kept."""
        if self.keep_records:
            self.records.append(Record(opcode, *self.reading, content))

    def report(self, text: str) -> None:
        """Report damage in the record that is being read, by which something is lost."""
        self.damage.append(Damage(*self.reading, text))

    def take_kept(self) -> dict[int, list[KeptMessages]]:
        """Return the messages kept so far, by channel id, and release them."""
        kept, self.kept, self.held_bytes = self.kept, {}, 0
        return kept
