"""A format of streams for tests: a line is the name of a channel and a value, such as `rpm 60`."""

import argparse
from collections.abc import Sequence

from recorders.streams.counts import StreamCounts
from recorders.streams.format import OpenedFile, StreamFormat
from recorders.streams.packets import Batches, Packet
from recorders.streams.sample_buffer import SampleBuffer


class NumberDecoder:
    """Decodes the lines; every sample has the source `N`."""

    def __init__(self) -> None:
        self.counts = StreamCounts()

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            name, _, value = packet.data.decode().strip().partition(" ")
            try:
                samples.add(name, "N", float(value), packet.received_ns)
            except (ValueError, KeyError):
                self.counts.reject("not a number")
            else:
                self.counts.accept(name)

    def finish(self, samples: SampleBuffer) -> None:
        """Add nothing."""


def _open_file(batches: Batches, options: argparse.Namespace) -> OpenedFile:
    """Give the lines times from `start`, `step` s apart."""
    return OpenedFile(_timed(batches, options), NumberDecoder())


def _timed(batches: Batches, options: argparse.Namespace) -> Batches:
    number = 0
    for batch in batches:
        yield [
            packet._replace(received_ns=round((options.start + options.step * n) * 1e9))
            for n, packet in enumerate(batch, start=number)
        ]
        number += len(batch)


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--start", type=float, default=0.0)
    parser.add_argument("--step", type=float, default=0.1)
    parser.add_argument("--fast", action="store_true")


NUMBERS = StreamFormat(
    "numbers", "numbers", lambda _: NumberDecoder(), _open_file, configure=_configure
)
