"""Fuzzed packets through the decoder of every format: counts, exceptions, names and memory."""

import tracemalloc
from functools import cache
from random import Random

import pytest

from benchmarks.fuzz import FuzzResult, fuzz, make_decoder, options_of
from benchmarks.fuzzed_packets import STREAMS, FuzzedStream, distorted
from recorders.streams.counts import MAX_KINDS, MAX_WARNINGS, StreamCounts
from recorders.streams.format import GROUP, StreamFormat
from recorders.streams.packets import NO_TIME, Packet
from recorders.streams.sample_buffer import MAX_TOPICS, SampleBuffer
from recorders.streams.stream_source import StreamSource
from shiplog.errors import ShiplogError
from shiplog.extensions import extension_names, load_extension
from shiplog.types import Channel

pytest.importorskip("nmea2000")
PACKETS = 3000
START_NS = 10**18

every_stream = pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.name)


@cache
def result_of(stream: FuzzedStream) -> FuzzResult:
    return fuzz(stream, PACKETS, seed=1)


def test_every_format_is_fuzzed() -> None:
    assert {"nmea0183", "nmea2000", "signalk", "csv-lines"} <= set(extension_names(GROUP))
    assert {stream.format for stream in STREAMS} <= set(extension_names(GROUP))


@every_stream
def test_no_exception_leaves_a_decoder_and_no_sample_is_infinite(stream: FuzzedStream) -> None:
    result = result_of(stream)
    assert result.exceptions == []
    assert result.infinite == set()


@every_stream
def test_each_line_is_counted_once(stream: FuzzedStream) -> None:
    result = result_of(stream)
    assert result.parts >= PACKETS
    assert sum(result.counted) == result.parts
    assert all(count > PACKETS / 50 for count in result.counted)
    assert len(result.counts.rejected) >= 4


@every_stream
def test_names_from_the_wire_are_printable_and_bounded_in_number(stream: FuzzedStream) -> None:
    counts = result_of(stream).counts
    for names in (counts.accepted, counts.unused, counts.rejected, counts.flagged):
        assert len(names) <= MAX_KINDS + 1
        assert all(name.isprintable() and len(name) < 100 for name in names)
    assert len(counts.notes) <= MAX_KINDS
    assert len(counts.warnings) <= MAX_WARNINGS


@every_stream
def test_memory_is_flat_over_the_same_packets_again(stream: FuzzedStream) -> None:
    rng = Random(2)  # noqa: S311 - repeatable
    packets = [Packet(distorted(stream.packet(rng), rng), START_NS) for _ in range(1000)]
    decoder, samples = make_decoder(stream), SampleBuffer()

    def decode() -> None:
        decoder.decode(packets, samples)
        samples.take()

    decode()
    tracemalloc.start()
    for _ in range(2):
        decode()
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 500_000  # up to 4096 latencies of a receiver wait as floats


@every_stream
@pytest.mark.parametrize("errors", [0.0, 0.1, 1.0])
def test_a_file_of_fuzzed_lines_is_recorded_or_refused(stream: FuzzedStream, errors: float) -> None:
    stream_format = load_extension(GROUP, stream.format, StreamFormat, "format")
    stamps = (b"", b"2014-08-01T00:00:00.124Z ", b"22:42:04 ", b"(1322174524.388000) ")
    rng = Random(3)  # noqa: S311 - repeatable
    for stamp in (b"",) if stream.format == "nmea2000" else stamps:
        whole = [stamp + stream.packet(rng).replace(b"\n", b" ") for _ in range(300)]
        lines = [distorted(line, rng) if rng.random() < errors else line for line in whole]
        batches = iter([[Packet(line, NO_TIME) for line in lines]])
        try:
            opened = stream_format.open_file(batches, options_of(stream))
            source = StreamSource("port", stream.format, opened.batches, opened.decoder, True)
            raw = [item for chunk in source.chunks() for item in chunk]
        except ShiplogError:  # such as a file without times
            continue
        assert raw
        assert opened.decoder.counts.rejected or errors < 1


def test_a_flood_of_kinds_is_counted_in_bounded_memory() -> None:
    counts = StreamCounts()
    for n in range(10_000):
        for count in (counts.accept, counts.skip, counts.flag):
            count(f"kind {n}")
        counts.note(f"key {n}", "text")
        counts.warn("text")
    for names in (counts.accepted, counts.unused, counts.flagged):
        assert len(names) == MAX_KINDS + 1
        assert sum(names.values()) == 10_000
    assert (len(counts.notes), len(counts.warnings)) == (MAX_KINDS, MAX_WARNINGS)


def test_a_flood_of_sources_fills_no_more_topics_than_the_most() -> None:
    samples = SampleBuffer()
    added = [samples.add("heading", f"source {n}", 1.0, n) for n in range(10_000)]
    fixes = [samples.add_position(f"receiver {n}", (1.0, 2.0, 3.0), n) for n in range(10_000)]
    samples.describe("speed", "another", key="text")
    taken = [item for item in samples.take() if isinstance(item, Channel)]
    assert (sum(added), sum(fixes), len(taken)) == (MAX_TOPICS, 0, MAX_TOPICS)
    assert samples.add("heading", "source 0", 1.0, 0)


@every_stream
def test_an_empty_datagram_is_counted(stream: FuzzedStream) -> None:
    decoder = make_decoder(stream)
    decoder.decode([Packet(b"", START_NS), Packet(b"", START_NS)], SampleBuffer())
    assert sum(decoder.counts.unused.values()) + sum(decoder.counts.rejected.values()) == 2
