"""Source of samples made of one stream: batches of packets, decoded, and kept raw beside it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from recorders.source import Recordable
from shiplog.types import RawPackets

from .decoder import Decoder
from .packets import Batches, Packet
from .sample_buffer import SampleBuffer


@dataclass
class StreamSource:
    """A stream of packets as a `recorders.source.Source`.

    Attributes
    ----------
    name
        The name of the stream, as its raw topic has it.
    format
        The format of the packets, such as ``nmea0183``.
    batches
        The packets with their times of reception.
    decoder
        Decodes the packets.
    keep_raw
        Whether to record the packets beside the samples.
    origin
        Where the packets come from, for the metadata: a file name or an address.
    vessel_toml
        The text of the vessel file to keep in the log, or None.
    samples
        Collects what is decoded.
    """

    name: str
    format: str
    batches: Batches
    decoder: Decoder
    keep_raw: bool = False
    origin: str = ""
    vessel_toml: str | None = None
    samples: SampleBuffer = field(default_factory=SampleBuffer, repr=False)
    _last_ns: int = field(default=0, init=False, repr=False)  # the last time of reception

    @property
    def metadata(self) -> Mapping[str, str]:
        """The origin and format of the stream, and its rejected and invalid packets so far."""
        counts = self.decoder.counts
        rejected = {f"rejected.{reason}": str(n) for reason, n in counts.rejected.items()}
        invalid = {f"invalid.{kind}": str(n) for kind, n in counts.flagged.items()}
        origin = {"source": self.format, "origin": self.origin}
        return origin | dict(counts.notes) | rejected | invalid

    def steps(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield the samples, events and raw packets of each batch, or nothing, and of the end."""
        for batch in self.batches:
            self.decoder.decode(batch, self.samples)
            if batch:
                self._last_ns = batch[-1].received_ns
            self._add_warnings()
            raw = [self._raw(batch)] if self.keep_raw and batch else []
            yield (*self.samples.take(), *raw)
        yield self.finish()

    def finish(self) -> tuple[Recordable, ...]:
        """Return what the decoder still held after the last batch."""
        self.decoder.finish(self.samples)
        self._add_warnings()
        return self.samples.take()

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield what the steps yield, without those that yield nothing."""
        return filter(None, self.steps())

    def _add_warnings(self) -> None:
        """Add the new warnings of the stages and the decoder as events."""
        for time_ns, text in self.decoder.counts.take_warnings():
            self.samples.add_event(self._last_ns if time_ns is None else time_ns, text, self.name)

    def _raw(self, batch: Sequence[Packet]) -> RawPackets:
        times = np.array([packet.received_ns for packet in batch], np.int64)
        return RawPackets(self.name, self.format, times, tuple(p.data for p in batch))
