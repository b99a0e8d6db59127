"""Sentences with random errors, decoded: `python -m benchmarks.fuzzed_sentences`.

A million sentences and datagrams from fixed seeds pass the decoder of NMEA 0183. No exception may
leave it, each line must be counted, and memory must not grow; the exit code is 1 where one of these
fails. The test-suite does the same with fewer.
"""

import argparse
import sys
import tracemalloc
from collections import Counter
from functools import reduce
from operator import xor

import numpy as np

from recorders.nmea0183.framing import DATAGRAM_HEADER, split_packet
from recorders.nmea0183.sentence_decoder import SentenceDecoder
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer

BODIES = (
    "TIROT,-6.0,A",
    "AGRSA,1.26,A,,V",
    "ECRPM,E,2,1500.0,50,A",
    "VWVHW,205.5,T,203.0,M,6.11,N,11.31,K",
    "VDVBW,12.3,-0.5,A,12.0,-0.9,A,,V,,V",
    "HETHS,77.52,A",
    "HCHDG,359.80,1.0,W,0.55,E",
    "INGGA,000000.16,2200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,",
    "GPGLL,6005.071,N,02332.346,E,095559,A,D",
    "INRMC,000000.16,A,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,W,A",
    "GNGNS,014035.00,4332.69262,S,17235.48549,E,RR,13,0.9,25.63,11.24,,",
    "INVTG,215.11,T,239.79,M,9.1,N,16.9,K,A",
    "INZDA,000000.17,01,08,2014,,",
    "IIMWV,142.0,R,006.1,N,A",
    "IIVWR,039,L,08.10,N,04.17,M,,",
    "SDDPT,10.0,1.5,100",
    "YXXDR,A,0.19,D,Pitch,A,-0.34,D,Roll",
    "PSXN,23,0.35,-1.74,218.26,0.58",
    "AGHTD,V,5.0,R,M,,,,,,,,T,A,A,A,1",
)
"""One sentence of each kind, without start and checksum."""

_FIELDS = ("", "-", "9" * 40, "1e308", "nan", "\x7f", "A", "V", "é", "$", "0x1", "\x1b[2J", "1_0")
_START_NS = 1_406_851_200 * 10**9
BATCH = 5000


def fuzzed_packet(rng: np.random.Generator) -> bytes:
    """Return a sentence, at times in a datagram, with random changes.

    Half of the packets have wrong fields and a correct checksum; in the others bytes are changed,
    and the end is cut.
    """
    fields = BODIES[rng.integers(len(BODIES))].split(",")
    for _ in range(rng.integers(3)):
        fields[rng.integers(1, len(fields))] = _FIELDS[rng.integers(len(_FIELDS))]
    body = ",".join(fields).encode()
    line = b"$%b*%02X" % (body, reduce(xor, body, 0))
    if rng.random() < 0.2:
        tag = b"s:G%04d,n:%d" % (rng.integers(10_000), rng.integers(1, 1000))
        line = b"%b\\%b*%02X\\%b\r\n" % (DATAGRAM_HEADER, tag, reduce(xor, tag, 0), line)
    if rng.random() < 0.5:
        changed = bytearray(line)
        for _ in range(rng.integers(1, 4)):
            changed[rng.integers(len(changed))] = rng.integers(256)
        line = bytes(changed[: rng.integers(len(changed) + 1)])
    return line


def decode_fuzzed(packets: int, seed: int) -> SentenceDecoder:
    """Decode fuzzed packets, and check that each of their lines is counted.

    Raises
    ------
    RuntimeError
        A line is not counted.
    """
    rng = np.random.default_rng(seed)
    decoder, samples, lines = SentenceDecoder(), SampleBuffer(), 0
    for first in range(0, packets, BATCH):
        count = min(BATCH, packets - first)
        batch = [Packet(fuzzed_packet(rng), _START_NS + (first + n) * 10**7) for n in range(count)]
        lines += sum(1 for packet in batch for _ in split_packet(packet.data))
        decoder.decode(batch, samples)
        samples.take()
    decoder.finish(samples)
    counts = decoder.counts
    rejected = Counter(counts.rejected)
    rejected.pop("lost before reception (TAG line counts)", None)
    counted = sum(map(sum, (counts.accepted.values(), counts.unused.values(), rejected.values())))
    if counted != lines:
        raise RuntimeError(f"{lines} lines, but {counted} counted (seed {seed})")
    return decoder


def main() -> int:
    """Decode, and print the reasons of rejection and the growth of memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--packets", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    decode_fuzzed(BATCH, arguments.seed)  # what is allocated once
    tracemalloc.start()
    counts = decode_fuzzed(arguments.packets, arguments.seed).counts
    peak = tracemalloc.get_traced_memory()[1]
    for reason, count in sorted(counts.rejected.items(), key=lambda item: -item[1]):
        print(f"{count:9d}  {reason}")
    print(f"{sum(counts.accepted.values()):9d}  decoded; peak {peak / 1e6:.1f} MB")
    return int(peak > 50e6)


if __name__ == "__main__":
    sys.exit(main())
