"""A small log of several MCAP chunks, and the ways in which `benchmarks.damage` damages it."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode

from shiplog import Channel, LogWriter
from shiplog.mcap.records import MAGIC, RECORD_HEAD
from shiplog.types import Event, RawPackets

START_NS = 1_700_000_000 * 10**9
CHUNKS, SAMPLES = 3, 20  # MCAP chunks, and samples of each scalar channel in each
VESSEL_TOML = 'name = "a test"\n[yaw]\nT1 = 150.0\n'
MAX_BURST = 64  # bytes


@dataclass(frozen=True)
class Piece:
    """A record of the file: its kind in words, and the offsets of its begin and its end."""

    kind: str
    opcode: int
    start: int
    end: int


@dataclass(frozen=True)
class Variant:
    """A damaged file.

    Attributes
    ----------
    way
        How it is damaged.
    place
        The kind of record in which the damage begins.
    data
        The bytes of the file.
    intact
        The numbers of the MCAP chunks that are as they were.
    """

    way: str
    place: str
    data: bytes
    intact: frozenset[int]


def write_log(path: Path) -> bytes:
    """Write the log, of samples, positions, packets, events, metadata and a vessel file."""
    rng = np.random.default_rng(15)
    with LogWriter(path, metadata={"place": "Neva"}, vessel_toml=VESSEL_TOML) as writer:
        for number in range(CHUNKS):
            at = START_NS + (np.arange(SAMPLES) + number * SAMPLES) * 100_000_000
            few = at[::10]
            fixes = np.stack(
                [60 + 1e-6 * rng.normal(size=len(few)), 30 + few * 1e-18, few * 0.0], axis=1
            )
            fields = ("latitude", "longitude", "altitude")
            writer.write(
                Channel("yaw_rate", "gyro", "rad/s", at, at + 7, rng.normal(size=SAMPLES)),
                Channel("speed", "log", "m/s", at, at + 9, rng.normal(size=SAMPLES)),
                Channel("position", "gps", "deg", few, few + 11, fixes, fields),
                RawPackets("gyro", "nmea0183", few + 13, (b"$HEROT,1.5,A*2E",) * len(few)),
                Event(int(at[5]), f"event {number}"),
            )
            writer.flush()
            writer._file.close_mcap_chunk()  # noqa: SLF001 - a flush leaves it open for more
    return path.read_bytes()


def pieces(data: bytes) -> list[Piece]:
    """Return the parts of a whole file: its records, and the bytes at its ends."""
    result, at = [Piece("first bytes", 0, 0, len(MAGIC))], len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        end = at + RECORD_HEAD.size + length
        result.append(Piece(Opcode(opcode).name.lower().replace("_", " "), opcode, at, end))
        at = end
    return [*result, Piece("last bytes", 0, at, len(data))]


def mcap_chunks(data: bytes) -> list[Piece]:
    """Return the MCAP chunks of a whole file."""
    return [piece for piece in pieces(data) if piece.opcode == Opcode.CHUNK]


def cuts(data: bytes, step: int = 1) -> Iterator[Variant]:
    """Yield the file cut off at every byte, or at every `step`-th."""
    for at in range(len(MAGIC), len(data), step):
        yield _variant("cut", data, data[:at], at, len(data))


def flips(data: bytes, step: int = 1) -> Iterator[Variant]:
    """Yield the file with one bit of every byte inverted, or of every `step`-th."""
    for at in range(0, len(data), step):
        changed = bytearray(data)
        changed[at] ^= 1 << (at * 5 + at // 8) % 8
        yield _variant("bit", data, bytes(changed), at, at + 1)


def bursts(data: bytes, count: int, seed: int = 0) -> Iterator[Variant]:
    """Yield the file with random bytes in place of up to `MAX_BURST` of its own."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        at = int(rng.integers(len(data)))
        noise = rng.bytes(int(rng.integers(2, MAX_BURST + 1)))[: len(data) - at]
        changed = data[:at] + noise + data[at + len(noise) :]
        if changed != data:
            yield _variant("burst", data, changed, at, at + len(noise))


def orders(data: bytes) -> Iterator[Variant]:
    """Yield the file with its MCAP chunks in every other order, and with each of them twice."""
    chunks = mcap_chunks(data)
    ends = [*(chunk.start for chunk in chunks[1:]), _data_end(data)]
    groups = [
        data[c.start : end] for c, end in zip(chunks, ends, strict=True)
    ]  # with their indexes
    before, after = data[: chunks[0].start], data[ends[-1] :]
    everything = frozenset(range(len(chunks)))
    for order in itertools.permutations(range(len(groups))):
        if order != tuple(sorted(order)):
            middle = b"".join(groups[number] for number in order)
            yield Variant("order", "chunk", before + middle + after, everything)
    for twice, at in itertools.product(range(len(groups)), repeat=2):
        middle = b"".join([*groups[: at + 1], groups[twice], *groups[at + 1 :]])
        yield Variant("twice", "chunk", before + middle + after, everything)
        yield Variant("twice, cut", "chunk", before + middle, everything)


def _data_end(data: bytes) -> int:
    return next(piece.start for piece in pieces(data) if piece.opcode == Opcode.DATA_END)


def _variant(way: str, data: bytes, changed: bytes, start: int, end: int) -> Variant:
    """Return a variant in which the bytes from `start` to before `end` are damaged."""
    place = next(piece.kind for piece in pieces(data) if start < piece.end)
    intact = frozenset(
        number
        for number, chunk in enumerate(mcap_chunks(data))
        if chunk.end <= start or chunk.start >= end
    )
    return Variant(way, place, changed, intact)
