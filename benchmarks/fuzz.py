"""Every format of streams and of settings against errors: `python -m benchmarks.fuzz`.

Fuzzed packets from fixed seeds pass the decoders as from a live transport. No exception may leave
them, each line (of Signal K: each value) must be counted once as accepted, unused or rejected, no
sample may be infinite, and memory must not grow. Settings files and headers of tables with random
errors are read, or refused in one line. The exit code is 1 where one of these fails. The tests do
the same with fewer.
"""

import argparse
import resource
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from random import Random

import numpy as np

from recorders.streams.counts import StreamCounts
from recorders.streams.decoder import Decoder
from recorders.streams.format import GROUP, StreamFormat
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer
from shiplog.errors import ShiplogError
from shiplog.extensions import load_extension
from shiplog.types import Channel

from .fuzzed_packets import STREAMS, FuzzedStream, distorted
from .fuzzed_settings import KINDS, FuzzedText, mutated

BATCH = 1000
WARM_UP = 20_000  # packets that fill the bounded tables
MAX_GROWTH = 30e6  # bytes: the latencies of receivers are kept, 8 bytes each, up to a million
_LOST = "lost before reception (TAG line counts)"  # were never received
_START_NS = 1_406_851_200 * 10**9


@dataclass
class FuzzResult:
    """What became of the packets of a stream.

    Attributes
    ----------
    packets, parts
        The number of packets and of what must be counted in them: lines, or values.
    exceptions
        The exceptions that left the decoder, with their packets.
    infinite
        The topics with infinite samples.
    growth
        The growth of the peak of memory after the first `WARM_UP` packets, bytes.
    processor_secs
        The processor time of decoding, s.
    counts
        The counts of the decoder.
    """

    packets: int
    counts: StreamCounts
    parts: int = 0
    exceptions: list[str] = field(default_factory=list)
    infinite: set[str] = field(default_factory=set)
    growth: int = 0
    processor_secs: float = 0.0

    @property
    def counted(self) -> tuple[int, int, int]:
        """The number of accepted, unused and rejected parts."""
        counts = self.counts
        rejected = sum(counts.rejected.values()) - counts.rejected.get(_LOST, 0)
        return sum(counts.accepted.values()), sum(counts.unused.values()), rejected

    @property
    def is_right(self) -> bool:
        """Whether no exception has left the decoder, and each part is counted once."""
        return not self.exceptions and not self.infinite and sum(self.counted) == self.parts


def fuzz(stream: FuzzedStream, packets: int, seed: int) -> FuzzResult:
    """Decode fuzzed packets of a stream."""
    decoder, samples = make_decoder(stream), SampleBuffer()
    result = FuzzResult(packets, decoder.counts)
    peak = 0
    for number, batch in enumerate(_batches(stream, packets, seed)):
        if number * BATCH <= WARM_UP:
            peak = _peak_bytes()
        result.parts += sum(stream.count(packet.data) for packet in batch)
        start = time.process_time()
        for packet in batch:
            try:
                decoder.decode([packet], samples)
            except Exception as error:  # noqa: BLE001 - any is a finding
                result.exceptions.append(f"{error!r} of {packet.data!r}")
        channels = [item for item in samples.take() if isinstance(item, Channel)]
        result.processor_secs += time.process_time() - start
        result.infinite |= {each.topic for each in channels if np.isinf(each.values).any()}
    decoder.finish(samples)
    result.growth = _peak_bytes() - peak
    return result


def make_decoder(stream: FuzzedStream) -> Decoder:
    """Make the decoder of a stream, as a recording does."""
    stream_format = load_extension(GROUP, stream.format, StreamFormat, "format")
    return stream_format.make_decoder(options_of(stream))


def options_of(stream: FuzzedStream) -> argparse.Namespace:
    """Return the options of a stream as the command line parses them."""
    parser = argparse.ArgumentParser()
    load_extension(GROUP, stream.format, StreamFormat, "format").configure(parser)
    return parser.parse_args(stream.options)


def _batches(stream: FuzzedStream, packets: int, seed: int) -> Iterator[list[Packet]]:
    rng = Random(f"{stream.name} {seed}")  # noqa: S311 - repeatable
    for first in range(0, packets, BATCH):
        yield [
            Packet(distorted(stream.packet(rng), rng), _START_NS + n * 10**7)
            for n in range(first, min(first + BATCH, packets))
        ]


def _peak_bytes() -> int:
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def unexpected_errors(kind: FuzzedText, texts: int, seed: int) -> list[str]:
    """Read fuzzed texts of a kind; return what is neither a result nor an error of one line."""
    rng = Random(f"{kind.name} {seed}")  # noqa: S311 - repeatable
    found = []
    for _ in range(texts):
        text = mutated(kind, rng)
        try:
            kind.read(text)
        except ShiplogError as error:
            if "\n" in str(error):
                found.append(f"{error!r} of {text!r}")
        except Exception as error:  # noqa: BLE001 - any is a finding
            found.append(f"{error!r} of {text!r}")
    return found


def _print(stream: FuzzedStream, result: FuzzResult) -> None:
    accepted, unused, rejected = result.counted
    print(
        f"{stream.name}: {result.packets} packets, {result.parts} lines or values: {accepted} "
        f"accepted, {unused} unused, {rejected} rejected, "
        f"{result.parts - accepted - unused - rejected} not counted; "
        f"{len(result.exceptions)} exceptions; {len(result.infinite)} topics with infinities; "
        f"memory +{result.growth / 1e6:.1f} MB; {result.processor_secs:.1f} s"
    )
    for reason, count in sorted(result.counts.rejected.items(), key=lambda item: -item[1]):
        print(f"{count:9d}  {reason}")
    for text in (*result.exceptions[:3], *sorted(result.infinite)[:3]):
        print(f"    {text[:300]}")


def main() -> int:
    """Decode the packets of all streams, each in a process of its own, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--packets", type=int, default=1_000_000, help="of all streams together")
    parser.add_argument("--texts", type=int, default=20_000, help="of all kinds together")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    each = -(-arguments.packets // len(STREAMS))
    right = True
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        futures = [pool.submit(_fuzz_number, n, each, arguments.seed) for n in range(len(STREAMS))]
        for stream, future in zip(STREAMS, futures, strict=True):
            result = future.result()
            _print(stream, result)
            right &= result.is_right and result.growth < MAX_GROWTH
    each = -(-arguments.texts // len(KINDS))
    for kind in KINDS:
        errors = unexpected_errors(kind, each, arguments.seed)
        print(f"{kind.name}: {each} texts, {len(errors)} unexpected errors")
        for text in errors[:3]:
            print(f"    {text[:300]}")
        right &= not errors
    return int(not right)


def _fuzz_number(number: int, packets: int, seed: int) -> FuzzResult:
    return fuzz(STREAMS[number], packets, seed)


if __name__ == "__main__":
    sys.exit(main())
