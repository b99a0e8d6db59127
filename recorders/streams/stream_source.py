"""Source of samples made of one stream: batches of packets, decoded, and kept raw beside it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from recorders.source import Recordable
from shiplog.types import RawPackets

from .decoder import Decoder
from .packets import Batches, Packet
from .sample_buffer import SampleBuffer

T = TypeVar("T")
DECODER_FAILURE = "failure of the decoder"  # the reason of a rejection


@dataclass
class StreamSource:
    """A stream of packets as a `recorders.source.Source`.

    A decoder that fails, against its contract, ends neither the stream nor the other streams of a
    trial: the packets of the batch are counted as rejected, and the first failure is a warning.

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
    prefix
        Put before the source of its topics.
    options
        The options of its format, as they stand on a command line.
    """

    name: str
    format: str
    batches: Batches
    decoder: Decoder
    keep_raw: bool = False
    origin: str = ""
    vessel_toml: str | None = None
    prefix: str = ""
    options: str = ""
    _samples: SampleBuffer = field(init=False, repr=False)
    _first_ns: int | None = field(default=None, init=False, repr=False)  # times of reception
    _last_ns: int = field(default=0, init=False, repr=False)

    def __post_init__(self) -> None:
        self._samples = SampleBuffer(self.prefix, self.name)

    @property
    def metadata(self) -> Mapping[str, str]:
        """The origin, format and options, and the rejected and invalid packets so far."""
        counts = self.decoder.counts
        decoding = {"options": self.options, "prefix": self.prefix}
        origin = {"source": self.format, "origin": self.origin}
        rejected = {f"rejected.{reason}": str(n) for reason, n in counts.rejected.items()}
        invalid = {f"invalid.{kind}": str(n) for kind, n in counts.flagged.items()}
        known = {key: text for key, text in decoding.items() if text}
        return origin | known | dict(counts.notes) | rejected | invalid

    @property
    def duration_secs(self) -> float:
        """The time from the first to the last packet so far, s."""
        return 0.0 if self._first_ns is None else (self._last_ns - self._first_ns) * 1e-9

    def steps(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield the samples, events and raw packets of each batch, or nothing, and of the end."""
        for batch in self.batches:
            self._guard(partial(self.decoder.decode, batch, self._samples), len(batch))
            if batch:
                self._first_ns = batch[0].received_ns if self._first_ns is None else self._first_ns
                self._last_ns = batch[-1].received_ns
            samples = self._take_samples(len(batch))
            raw = [self._raw(batch)] if self.keep_raw and batch else []
            yield (*samples, *raw)
        yield self.finish()

    def finish(self) -> tuple[Recordable, ...]:
        """Return what the decoder still held after the last batch."""
        self._guard(partial(self.decoder.finish, self._samples), 1)
        return self._take_samples(1)

    def chunks(self) -> Iterator[tuple[Recordable, ...]]:
        """Yield what the steps yield, without those that yield nothing."""
        return filter(None, self.steps())

    def _take_samples(self, packets: int) -> tuple[Recordable, ...]:
        """Return what was decoded from some packets, and the new warnings as events."""
        samples = self._guard(self._samples.take, packets) or ()
        self._add_warnings()
        return (*samples, *self._samples.take())

    def _guard(self, step: Callable[[], T], packets: int) -> T | None:
        """Return the result of a step with some packets; count a failure, and return None."""
        try:
            return step()
        except Exception as error:  # noqa: BLE001 - a trial is not repeated for one packet
            counts = self.decoder.counts
            if DECODER_FAILURE not in counts.rejected:
                cause = " ".join(f"{type(error).__name__}: {error}".split())[:200]
                counts.warn(
                    f"the decoder of {self.format} failed ({cause}); what it misses can be decoded "
                    "from the raw packets when it is corrected"
                )
            counts.reject(DECODER_FAILURE, packets)
            return None

    def _add_warnings(self) -> None:
        """Add the new warnings of the stages and the decoder as events."""
        for time_ns, text in self.decoder.counts.take_warnings():
            self._samples.add_event(self._last_ns if time_ns is None else time_ns, text, self.name)

    def _raw(self, batch: Sequence[Packet]) -> RawPackets:
        times = np.array([packet.received_ns for packet in batch], np.int64)
        return RawPackets(self.name, self.format, times, tuple(p.data for p in batch))
