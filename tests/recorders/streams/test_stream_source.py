"""Tests of recorders.streams.stream_source, with a decoder of numbers."""

from collections.abc import Iterator, Sequence

from recorders.streams.counts import StreamCounts
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer
from recorders.streams.stream_source import StreamSource
from shiplog.types import Channel, Event, RawPackets


class _Numbers:
    """Decodes packets that are a number as a heading, and adds a last one at the end."""

    def __init__(self) -> None:
        self.counts = StreamCounts()

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            try:
                samples.add("heading", "HE", float(packet.data), packet.received_ns)
            except ValueError:
                self.counts.reject("not a number")

    def finish(self, samples: SampleBuffer) -> None:
        samples.add("heading", "HE", 9.0, 9)


def _source(*, keep_raw: bool = False) -> StreamSource:
    def batches() -> Iterator[list[Packet]]:
        yield [Packet(b"1.5", 1), Packet(b"x", 2)]
        yield []
        yield [Packet(b"2.5", 3)]

    return StreamSource("gyro", "numbers", batches(), _Numbers(), keep_raw, "numbers.txt")


def test_each_batch_with_content_is_a_chunk_and_the_end_is_flushed() -> None:
    chunks = list(_source().chunks())
    values = [c.values.tolist() for chunk in chunks for c in chunk if isinstance(c, Channel)]
    assert values == [[1.5], [2.5], [9.0]]


def test_raw_packets_are_kept_on_request_rejected_ones_included() -> None:
    raw = [
        p for chunk in _source(keep_raw=True).chunks() for p in chunk if isinstance(p, RawPackets)
    ]
    assert [p.data for p in raw] == [(b"1.5", b"x"), (b"2.5",)]
    assert raw[0].received_ns.tolist() == [1, 2]
    assert raw[0].topic == "/raw/gyro"


def test_metadata_at_the_end_count_the_rejected_packets() -> None:
    source = _source()
    list(source.chunks())
    assert source.metadata == {
        "source": "numbers",
        "origin": "numbers.txt",
        "rejected.not a number": "1",
    }


def test_warnings_are_events_with_their_time_or_that_of_the_last_packet() -> None:
    source = _source()
    source.decoder.counts.warn("the receiver was set", 7)
    chunks = source.chunks()
    first = next(chunks)
    source.decoder.counts.warn("no date")
    events = [item for chunk in (first, *chunks) for item in chunk if isinstance(item, Event)]
    assert [(event.text, event.time_ns) for event in events] == [
        ("the receiver was set", 7),
        ("no date", 2),
    ]
    assert source.decoder.counts.warnings == ("the receiver was set", "no date")


def test_notes_and_invalid_values_are_metadata() -> None:
    source = _source()
    source.decoder.counts.note("latency_s.GP.RMC", "0.30")
    source.decoder.counts.flag("HETHS")
    assert source.metadata["latency_s.GP.RMC"] == "0.30"
    assert source.metadata["invalid.HETHS"] == "1"


def test_the_duration_is_that_from_the_first_to_the_last_packet() -> None:
    source = _source()
    assert source.duration_secs == 0
    list(source.chunks())
    assert source.duration_secs == 2e-9


class _Failing(_Numbers):
    """Fails on one packet, against its contract, after it has decoded those before."""

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            if packet.data == b"x":
                raise IndexError("list index out of range")
            super().decode([packet], samples)

    def finish(self, _samples: SampleBuffer) -> None:
        raise KeyError("at the end")


def test_a_decoder_that_fails_loses_one_batch_and_is_counted_and_reported_once() -> None:
    source = _source(keep_raw=True)
    source.decoder = _Failing()
    items = [item for chunk in source.chunks() for item in chunk]
    values = [v for c in items if isinstance(c, Channel) for v in c.values.tolist()]
    assert values == [1.5, 2.5]
    assert sum(len(p) for p in items if isinstance(p, RawPackets)) == 3
    assert source.metadata["rejected.failure of the decoder"] == "3"
    (event,) = [item for item in items if isinstance(item, Event)]
    assert "the decoder of numbers failed (IndexError: list index out of range)" in event.text


def test_a_time_beyond_all_clocks_loses_no_other_batch() -> None:
    class Impossible(_Numbers):
        def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
            for packet in batch:
                late = 2**70 if packet.data == b"x" else None
                samples.add("heading", "HE", 1.0, packet.received_ns, late)

        def finish(self, samples: SampleBuffer) -> None:
            """Add nothing."""

    source = _source()
    source.decoder = Impossible()
    times = [t for c in source.chunks() for i in c if isinstance(i, Channel) for t in i.received_ns]
    assert times == [3]
    assert source.decoder.counts.rejected == {"failure of the decoder": 2}


def test_counts_are_bounded_in_number_and_length_whatever_the_wire_names() -> None:
    counts = StreamCounts()
    for n in range(1000):
        counts.accept(f"{n}" + "x" * 4000)
        counts.reject(f"reason {n}")
    assert len(counts.accepted) <= 257
    assert len(counts.rejected) <= 257
    assert max(map(len, counts.accepted)) <= 100
    assert sum(counts.accepted.values()) == sum(counts.rejected.values()) == 1000
