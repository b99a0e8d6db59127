"""The interface of a decoder: from packets of one format to samples of channels."""

from collections.abc import Sequence
from typing import Protocol

from .counts import StreamCounts
from .packets import Packet
from .sample_buffer import SampleBuffer


class Decoder(Protocol):
    """What turns the packets of one stream into samples, and carries the state this needs."""

    @property
    def counts(self) -> StreamCounts:
        """What was decoded, skipped and rejected so far."""

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        """Decode a batch; where batches are cut changes no sample.

        No content of a packet raises an exception: what cannot be decoded is counted.

        Parameters
        ----------
        batch
            Packets in the order of reception, with times.
        samples
            Receives the samples and events.
        """

    def finish(self, samples: SampleBuffer) -> None:
        """Add what waited for later packets; called once, after the last batch."""
