"""Streams decoded to channels, as tests look at them."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from recorders.streams.counts import StreamCounts
from recorders.streams.decoder import Decoder
from recorders.streams.format import StreamFormat
from recorders.streams.packets import NO_TIME, Batches, Packet
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.types import Channel


@dataclass(frozen=True)
class Decoded:
    """Channels by topic, and what was counted."""

    channels: Mapping[str, Channel]
    counts: StreamCounts

    def values(self, topic: str) -> list[float]:
        """Return the values of a channel, or nothing where there is none."""
        return self.channels[topic].values.tolist() if topic in self.channels else []


def options_of(stream_format: StreamFormat, *arguments: str) -> argparse.Namespace:
    """Return the options of a format as the command line parses them."""
    parser = argparse.ArgumentParser()
    stream_format.configure(parser)
    return parser.parse_args(arguments)


def file_batches(lines: Sequence[bytes], size: int = 2500) -> Batches:
    """Yield the lines of a file in batches."""
    for start in range(0, len(lines), size):
        yield [Packet(line, NO_TIME) for line in lines[start : start + size]]


def live_batches(packets: Sequence[bytes], interval_ns: int = 10**8) -> Batches:
    """Yield packets received one after the other."""
    yield [Packet(data, n * interval_ns) for n, data in enumerate(packets)]


def decode(batches: Batches, decoder: Decoder) -> Decoded:
    """Decode all batches."""
    samples = SampleBuffer()
    for batch in batches:
        decoder.decode(batch, samples)
    decoder.finish(samples)
    channels = (item for item in samples.take() if isinstance(item, Channel))
    return Decoded({channel.topic: channel for channel in channels}, decoder.counts)


def decode_file(
    stream_format: StreamFormat, lines: Sequence[bytes], *arguments: str, size: int = 2500
) -> Decoded:
    """Decode the lines of a file with options of the command line."""
    options = options_of(stream_format, *arguments)
    opened = stream_format.open_file(file_batches(lines, size), options)
    return decode(opened.batches, opened.decoder)


def decode_live(stream_format: StreamFormat, packets: Sequence[bytes], *arguments: str) -> Decoded:
    """Decode packets received every 0.1 s from the time 0 on."""
    decoder = stream_format.make_decoder(options_of(stream_format, *arguments))
    return decode(live_batches(packets), decoder)


def file_lines(path: Path) -> list[bytes]:
    """Return the lines of a file."""
    return path.read_bytes().splitlines()


def damaged(lines: Sequence[bytes], count: int, seed: int) -> Iterator[bytes]:
    """Yield lines with bytes changed, cut out, repeated, joined or replaced by noise."""
    import random  # noqa: PLC0415

    rng = random.Random(seed)  # noqa: S311 - no secret
    for _ in range(count):
        line = bytearray(rng.choice(lines))
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(line) + 1)
            change = rng.randrange(5)
            if change == 0 and at < len(line):
                line[at] = rng.randrange(256)
            elif change == 1:
                del line[at : at + rng.randint(1, 20)]
            elif change == 2:
                line[at:at] = line[at : at + rng.randint(1, 300)]
            elif change == 3:
                line += rng.choice(lines)
            else:
                line[at:at] = rng.randbytes(rng.randint(1, 40))
        yield bytes(line)
