"""Recorded streams, such as the files of several loggers, joined to one source by time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from recorders.source import Recordable
from recorders.streams.packets import Batches, Packet
from recorders.streams.stream_source import StreamSource
from shiplog.errors import LogError

from .undecoded import why_undecoded


class _Feed:
    """Packets of one stream, let through up to a time."""

    def __init__(self, batches: Batches) -> None:
        self._batches = batches
        self._next: list[Packet] = []
        self._released: list[Packet] = []
        self.ended = False

    def fill(self) -> None:
        """Take the next batch from the file where there is no other."""
        while not self._next and not self.ended:
            batch = next(self._batches, None)
            self.ended = batch is None
            self._next = batch or []

    @property
    def last_ns(self) -> int:
        """The latest time of the packets that wait."""
        return max(packet.received_ns for packet in self._next)

    @property
    def waits(self) -> bool:
        """Whether packets wait."""
        return bool(self._next)

    def release(self, until_ns: int) -> None:
        """Let through the packets up to a time, and those that stand before them in the file."""
        count = max(
            (n for n, p in enumerate(self._next, start=1) if p.received_ns <= until_ns), default=0
        )
        self._released, self._next = self._next[:count], self._next[count:]

    def released(self) -> Batches:
        """Yield what was let through since it was last asked for; it never ends by itself."""
        while True:
            batch, self._released = self._released, []
            yield batch


@dataclass
class RecordedSource:
    """Recorded streams as one `recorders.source.Source`, in the order of reception.

    Attributes
    ----------
    streams
        The streams; each has its own times of reception, which ascend.
    trial_metadata
        Text about the trial, by key.
    vessel_toml
        The text of the vessel file to keep in the log, or None.
    """

    streams: Sequence[StreamSource]
    trial_metadata: Mapping[str, str] = field(default_factory=dict)
    vessel_toml: str | None = None

    @property
    def metadata(self) -> Mapping[str, str]:
        """The trial's metadata, and the metadata of each stream by its name."""
        streams = {
            f"{stream.name}.{key}": text
            for stream in self.streams
            for key, text in stream.metadata.items()
        }
        return dict(self.trial_metadata) | streams

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield the samples of all streams, up to the same time of reception in each chunk."""
        feeds = [_Feed(stream.batches) for stream in self.streams]
        for stream, feed in zip(self.streams, feeds, strict=True):
            stream.batches = feed.released()
        steps = [stream.steps() for stream in self.streams]
        while True:
            for feed in feeds:
                feed.fill()
            waiting = [feed for feed in feeds if feed.waits]
            if not waiting:
                break
            until_ns = min(feed.last_ns for feed in waiting)
            for feed in waiting:
                feed.release(until_ns)
            if items := tuple(item for each in steps for item in next(each)):
                yield items
        items = tuple(item for stream in self.streams for item in stream.finish())
        if items:
            yield items
        silent = [stream for stream in self.streams if not stream.decoder.counts.accepted]
        texts = [
            f"no sample could be decoded from {stream.origin}: "
            f"{why_undecoded(stream.decoder.counts)}"
            for stream in silent
        ]
        if len(silent) == len(self.streams):
            raise LogError("; ".join(texts))
        for stream, text in zip(silent, texts, strict=True):
            stream.decoder.counts.warn(text)
