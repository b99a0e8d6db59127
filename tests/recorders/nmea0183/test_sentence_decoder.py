"""Tests of recorders.nmea0183.sentence_decoder, hostile input included."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sentences import decoded, sentence, tagged

from benchmarks.fuzzed_packets import BODIES
from recorders.nmea0183.sentence_decoder import DecodingOptions, SentenceDecoder
from recorders.streams.counts import MAX_KINDS
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import MAX_TOPICS, SampleBuffer
from shiplog.types import Channel

SECOND_NS = 10**9
START_NS = 1_406_851_200 * SECOND_NS  # 2014-08-01


def _run(
    lines: list[bytes], *, batch: int = 1000, options: DecodingOptions | None = None
) -> tuple[SentenceDecoder, dict[str, Channel]]:
    decoder, samples = SentenceDecoder(options), SampleBuffer()
    packets = [Packet(line, START_NS + n * SECOND_NS // 10) for n, line in enumerate(lines)]
    for first in range(0, len(packets), batch):
        decoder.decode(packets[first : first + batch], samples)
    decoder.finish(samples)
    return decoder, {item.topic: item for item in samples.take() if isinstance(item, Channel)}


def test_the_source_is_the_talker_behind_the_sender_of_a_tag_block() -> None:
    _, channels = _run([sentence("HEHDT,1.0,T"), tagged("s:GR0001", "HEHDT,1.0,T")])
    assert list(channels) == ["/heading/HE", "/heading/GR0001.HE"]


def test_what_is_not_decoded_is_counted_by_kind() -> None:
    bodies = ("GPGSV,1,1,00", "PASHR,1", "HEHDT,,T", "HEHDT,1.0,T", "HETHS,1.0,V")
    lines = [*map(sentence, bodies), sentence("AIVDM,1,1,,A,13u,0", "!"), b"$HEHDT,1,T*00"]
    counts = _run(lines)[0].counts
    assert counts.unused == {"GPGSV": 1, "!AIVDM": 1, "PASHR": 1, "HEHDT without a value": 1}
    assert counts.accepted == {"HEHDT": 1, "HETHS": 1}
    assert counts.flagged == {"HETHS": 1}
    assert counts.rejected == {"wrong checksum": 1}


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [([1, 2, 3], 0), ([1, 2, 5], 2), ([998, 999, 1], 0), ([998, 2], 2), ([7, 7], 0)],
)
def test_gaps_in_the_line_counts_of_a_sender_are_lost_lines(numbers: list[int], lost: int) -> None:
    decoder, _ = _run([tagged(f"s:GR0001,n:{n}", "HEHDT,1.0,T") for n in numbers])
    assert sum(decoder.counts.rejected.values()) == lost


def test_a_line_that_is_rejected_is_not_lost_too() -> None:
    lines = [tagged(f"s:GR0001,n:{n}", "HEHDT,1.0,T") for n in (1, 2, 3)]
    lines[1] = lines[1][:-2] + b"00"
    decoder, _ = _run(lines)
    assert decoder.counts.rejected == {"wrong checksum": 1}


def test_gnss_time_is_the_time_of_measurement_on_request_for_the_whole_burst() -> None:
    lines = [sentence("HEHDT,1.0,T")]
    for n in range(5):
        lines.append(sentence(f"GPRMC,00000{n}.00,A,6005.0,N,02332.0,E,5,1,010814,,,A"))
        lines.append(sentence("GPVTG,215.11,T,,M,9.1,N,,K,A"))
        lines += [sentence("HEHDT,1.0,T")] * 8
    _, received = _run(lines)
    _, channels = _run(lines, options=DecodingOptions(gnss_time=True))
    epochs = START_NS + np.arange(5) * SECOND_NS
    assert channels["/position/GP.RMC"].measured_ns.tolist() == epochs.tolist()
    assert channels["/speed_over_ground/GP"].measured_ns.tolist() == epochs.tolist()
    for topic, channel in received.items():
        assert channel.measured_ns.tolist() == channel.received_ns.tolist()
        assert channels[topic].received_ns.tolist() == channel.received_ns.tolist()
    assert (
        channels["/heading/HE"].measured_ns.tolist() == received["/heading/HE"].measured_ns.tolist()
    )


def test_the_latency_of_each_kind_of_timed_sentence_is_noted() -> None:
    lines = [sentence(f"GPZDA,0000{n // 10:02d}.{n % 10},01,08,2014,,") for n in range(100)]
    assert _run(lines)[0].counts.notes == {"latency_s.GP.ZDA": "0.000 (90 % from 0.000 to 0.000)"}


@pytest.mark.parametrize("batch", [1, 3, 17])
def test_where_batches_are_cut_changes_no_sample(batch: int) -> None:
    lines = [sentence(body) for body in BODIES] * 3
    _, whole = _run(lines)
    _, cut = _run(lines, batch=batch)
    assert list(cut) == list(whole)
    for topic, channel in whole.items():
        np.testing.assert_array_equal(cut[topic].values, channel.values)
        np.testing.assert_array_equal(cut[topic].measured_ns, channel.measured_ns)


def test_every_kind_that_is_decoded_has_samples_here() -> None:
    decoder, _ = _run([sentence(body) for body in BODIES])
    assert len(decoder.counts.accepted) == len(BODIES)
    assert decoder.counts.rejected == {}


def test_sources_and_counters_are_bounded_in_number() -> None:
    lines = [tagged(f"s:G{n}", "HEHDT,1.0,T") for n in range(1000)]
    lines += [sentence(f"P{n:04d},1") for n in range(1000)]
    decoder, channels = _run(lines)
    assert len(channels) <= MAX_TOPICS
    assert len(decoder.counts.unused) <= MAX_KINDS + 1
    assert sum(decoder.counts.unused.values()) == 1000


@given(st.binary(max_size=120))
def test_any_bytes_are_counted_and_raise_nothing(data: bytes) -> None:
    _run([data])


@given(st.sampled_from(BODIES), st.lists(st.text(max_size=12), max_size=16))
def test_any_fields_with_a_correct_checksum_raise_nothing(body: str, fields: list[str]) -> None:
    _run([sentence(",".join([body.split(",", maxsplit=1)[0], *fields]))])


@pytest.mark.parametrize(
    ("body", "formatter"), [("SDDPT,1e308,1e308,", "DPT"), ("WIXDR,P,1e308,B,Barometer", "XDR")]
)
def test_a_value_that_is_infinite_in_our_unit_is_rejected(body: str, formatter: str) -> None:
    decoder, channels = _run([sentence(body)])
    assert channels == {}
    assert decoder.counts.rejected == {f"malformed field of {formatter}": 1}


def test_terminal_codes_from_the_wire_reach_no_name() -> None:
    lines = [
        sentence("HEHDT\x1b[31m,1.0,T"),
        sentence("\x1b[2J,1"),
        tagged("s:\x1b[2J", "HEHDT,1,T"),
    ]
    counts = _run(lines)[0].counts
    names = [*counts.accepted, *counts.unused, *counts.rejected]
    assert names
    assert all(name.isprintable() for name in names)


def test_values_do_not_depend_on_the_checksum_option() -> None:
    assert decoded("HEHDT,1.0,T") == decoded(
        "HEHDT,1.0,T", options=DecodingOptions(require_checksum=False)
    )
