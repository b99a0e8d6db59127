"""Tests of recorders.nmea2000.pgn_decoder."""

import struct
from pathlib import Path

import numpy as np
import pytest
from decoded_streams import damaged, decode, decode_file, decode_live, live_batches, options_of
from nmea2000 import NMEA2000Decoder, _canboat

from recorders.nmea2000.cli import NMEA2000
from recorders.nmea2000.pgn_decoder import FAST_PGNS
from recorders.streams.packets import packet_lines
from shiplog.errors import LogError, UsageError

FIX = (
    struct.pack("<BHI", 1, 20_000, 432_000_000)
    + struct.pack("<qqq", 54 * 10**16, 10 * 10**16, 12 * 10**6)
    + struct.pack("<BBBhhiBHh", 0x10, 0xFC, 9, 80, 120, 0, 0, 0xFFFF, 0x7FFF)[:12]
)


def candump(pgn: int, data: bytes, source: int = 27, time: float = 1.7e9) -> bytes:
    identifier = _canboat.can_id_compose(2, pgn, source, 255)
    return b"(%.6f) can0 %08X#%s" % (time, identifier, data.hex().upper().encode())


def fix_frames(sequence: int = 0, source: int = 27) -> list[bytes]:
    frames = _canboat.fast_packet_fragment(sequence, FIX)
    return [candump(129029, frame, source, 1.7e9 + 0.001 * n) for n, frame in enumerate(frames)]


def canboat(pgn: int, data: bytes, source: int = 27) -> bytes:
    return (
        b"2026-11-29T08:00:00.125Z,2,%d,%d,255,%d," % (pgn, source, len(data))
        + data.hex(",").encode()
    )


def test_the_frames_of_a_fast_packet_are_assembled_and_stamped_by_the_last_one() -> None:
    decoded = decode_file(NMEA2000, fix_frames())
    position = decoded.channels["/position/27.gnss"]
    np.testing.assert_allclose(position.values, [[54.0, 10.0, 12.0]])
    assert position.received_ns[0] == pytest.approx(1.7e18 + 6e6, abs=2000)
    assert decoded.counts.accepted == {"129029 of 27": 1}


def test_frames_of_several_senders_may_alternate() -> None:
    pairs = zip(fix_frames(source=1), fix_frames(source=2), strict=True)
    decoded = decode_file(NMEA2000, [frame for pair in pairs for frame in pair])
    assert {"/position/1.gnss", "/position/2.gnss"} <= set(decoded.channels)


def test_a_fast_packet_that_lacks_a_frame_gives_nothing() -> None:
    decoded = decode_file(NMEA2000, fix_frames()[:3] + fix_frames()[4:])
    assert decoded.channels == {}
    assert decoded.counts.rejected == {"part of an incomplete fast packet": len(fix_frames()) - 1}


def test_small_stamps_of_candump_stop_no_live_stream() -> None:
    frame = candump(127251, bytes.fromhex("00 00 00 00 01 ff ff ff"), time=12.5)
    assert decode_live(NMEA2000, [frame]).values("/yaw_rate/27") == [0.524288]


def test_a_line_with_a_whole_fast_packet_is_not_assembled_again() -> None:
    assert "/position/27.gnss" in decode_file(NMEA2000, [canboat(129029, FIX)]).channels


def test_lines_with_single_frames_of_canboat_are_assembled() -> None:
    frames = _canboat.fast_packet_fragment(0, FIX)
    lines = [canboat(129029, frame) for frame in frames]
    assert "/position/27.gnss" in decode_file(NMEA2000, lines).channels


def test_sources_and_instances_are_kept_apart() -> None:
    lines = [
        candump(127245, struct.pack("<BBhhH", instance, 0xFF, 0x7FFF, angle, 0xFFFF), source)
        for source, instance, angle in ((14, 0, 100), (14, 1, 200), (26, 0, 300))
    ]
    decoded = decode_file(NMEA2000, lines)
    values = {topic: channel.values[0] for topic, channel in decoded.channels.items()}
    assert values == pytest.approx({"/rudder/14": 0.01, "/rudder/14.1": 0.02, "/rudder/26": 0.03})


def test_what_is_not_decoded_or_without_a_value_is_counted_as_unused() -> None:
    lines = [
        candump(60928, bytes(8)),
        candump(127251, bytes.fromhex("ffffffff7fffffff")),
        candump(130306, bytes.fromhex("ff00010001f9ffff")),
    ]
    decoded = decode_file(NMEA2000, lines)
    assert decoded.channels == {}
    assert decoded.counts.unused == {
        "60928": 1,
        "127251 without a value": 1,
        "130306 without a value": 1,
    }


def test_a_datagram_of_a_gateway_may_hold_several_lines() -> None:
    line = b"17:33:21.107 R 09F1121B FF 10 27 FF 7F FF 7F FC\r\n"
    decoded = decode_live(NMEA2000, [b"half a line", line + line, line])
    channel = decoded.channels["/heading/27"]
    assert channel.received_ns.tolist() == [10**8, 10**8, 2 * 10**8]
    assert decoded.counts.rejected == {"line of no known format": 1}


def test_a_stated_format_is_used() -> None:
    line = b"17:33:21.107 R 09F1121B FF 10 27 FF 7F FF 7F FC"
    decoded = decode_live(NMEA2000, [line], "--line-format", "candump")
    assert decoded.counts.rejected == {"malformed line": 1}


def test_a_file_of_no_known_format_is_refused_with_the_known_ones() -> None:
    with pytest.raises(LogError, match=r"none of the first 1 lines.*canboat, candump"):
        decode_file(NMEA2000, [b"$HEHDT,123.4,T*12"])


def test_raw_lines_of_a_file_are_decoded_again_with_its_options() -> None:
    lines = [b"# format=FAST", canboat(129029, FIX)]
    decoded = decode_live(NMEA2000, lines, "--start", "2026-11-29")
    assert decoded.channels["/position/27.gnss"].received_ns.tolist() == [10**8]
    assert decoded.counts.rejected == {}


def test_a_start_is_a_date() -> None:
    with pytest.raises(UsageError, match="takes a date"):
        decode_file(NMEA2000, [b"17:33:21.107 R 09F1121B FF"], "--start", "29.11.2026")


def test_a_start_dates_the_stamps() -> None:
    line = b"08:00:00.000 R 09F1121B FF 10 27 FF 7F FF 7F FC"
    decoded = decode_file(NMEA2000, [line], "--start", "1970-01-03")
    assert decoded.channels["/heading/27"].received_ns[0] == (2 * 24 + 8) * 3600 * 10**9


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_where_batches_are_cut_changes_no_sample(size: int) -> None:
    lines = [line for n in range(20) for line in fix_frames(n % 8)]
    decoded = decode_file(NMEA2000, lines, size=size)
    whole = decode_file(NMEA2000, lines)
    assert {t: c.values.tobytes() for t, c in decoded.channels.items()} == {
        t: c.values.tobytes() for t, c in whole.channels.items()
    }


def test_our_values_are_those_of_the_librarys_own_decoder() -> None:
    library = NMEA2000Decoder(units="si")
    rng = np.random.default_rng(1)
    for _ in range(200):
        data = rng.bytes(8)
        line = candump(127251, data)
        message = library.decode(line.decode())
        rate = message.get_field_by_id("rate").value
        values = decode_file(NMEA2000, [line]).values("/yaw_rate/27")
        assert values == ([] if rate is None else [rate])


def _system_time(secs: float, utc_secs: float) -> bytes:
    days, clock = divmod(utc_secs, 86_400)
    data = struct.pack("<BBHI", 0xFF, 0xF0, int(days), round(clock * 10_000))
    return candump(126992, data, time=secs)


def test_the_latency_of_a_receiver_is_noted_and_a_late_one_warned_about() -> None:
    lines = [_system_time(1.7e9 + n + 0.4, 1.7e9 + n) for n in range(100)]
    decoded = decode_file(NMEA2000, lines)
    assert decoded.values("/gnss_time/27")[0] == pytest.approx(1.7e9)
    assert decoded.counts.notes["latency_s.27.126992"].startswith("0.400 ")
    [warning] = decoded.counts.warnings
    assert warning == (
        "address 27: reception minus GNSS time is 126992 0.40 s: "
        "the receiver is late; with --time gnss its samples have its own time"
    )


def _receiver(seconds: int, latency: float) -> list[bytes]:
    """Return the frames of a receiver with a fix each second and five rapid positions."""
    lines = []
    for n in range(seconds):
        days, clock = divmod(1.7e9 + n, 86_400)
        fix = FIX[:1] + struct.pack("<HI", int(days), round(clock * 10_000)) + FIX[7:]
        frames = _canboat.fast_packet_fragment(n % 8, fix)
        lines += [candump(129029, frame, time=1.7e9 + n + latency) for frame in frames]
        for k in range(5):
            data = struct.pack("<ii", 540_000_000, 100_000_000)
            lines.append(candump(129025, data, time=1.7e9 + n + latency + 0.2 * k))
            lines.append(candump(127250, bytes.fromhex("ff1027ff7fff7ffc"), time=1.7e9 + n))
    return lines


def test_gnss_time_is_the_time_of_measurement_of_a_receivers_messages_on_request() -> None:
    lines = _receiver(20, 0.4)
    received, applied = decode_file(NMEA2000, lines), decode_file(NMEA2000, lines, "--time", "gnss")
    fix, rapid = applied.channels["/position/27.gnss"], applied.channels["/position/27"]
    start_ns = 1_700_000_000 * 10**9
    assert fix.measured_ns.tolist() == [start_ns + n * 10**9 for n in range(20)]
    np.testing.assert_allclose(rapid.received_ns - rapid.measured_ns, 0.4e9, atol=2000)
    for topic, channel in received.channels.items():
        assert channel.measured_ns.tolist() == channel.received_ns.tolist()
        assert applied.channels[topic].received_ns.tolist() == channel.received_ns.tolist()
        assert applied.channels[topic].values.tobytes() == channel.values.tobytes()
    for topic in ("/heading/27", "/gnss_time/27.gnss"):
        channel = applied.channels[topic]
        assert channel.measured_ns.tolist() == channel.received_ns.tolist()
    assert received.counts.accepted == applied.counts.accepted


@pytest.mark.parametrize("size", [1, 13])
def test_where_batches_are_cut_changes_no_time_of_measurement(size: int) -> None:
    lines = _receiver(12, 0.4)
    cut = decode_file(NMEA2000, lines, "--time", "gnss", size=size)
    whole = decode_file(NMEA2000, lines, "--time", "gnss")
    assert {t: c.measured_ns.tolist() for t, c in cut.channels.items()} == {
        t: c.measured_ns.tolist() for t, c in whole.channels.items()
    }


def test_a_rollover_of_the_gps_week_is_corrected_with_a_warning() -> None:
    lines = [_system_time(1.7e9 + n, 1.7e9 + n - 1024 * 7 * 86_400) for n in range(3)]
    decoded = decode_file(NMEA2000, lines)
    assert decoded.values("/gnss_time/27") == [pytest.approx(1.7e9 + n, abs=1e-3) for n in range(3)]
    assert "1024 weeks early" in decoded.counts.warnings[0]


def test_frames_of_a_second_bus_are_not_mixed_with_those_of_the_first() -> None:
    line = candump(127250, bytes.fromhex("ff1027ff7fff7ffc"))
    other = candump(127250, bytes.fromhex("ff204eff7fff7ffc")).replace(b"can0", b"can1")
    decoded = decode_file(NMEA2000, [line, other, other, line])
    assert decoded.values("/heading/27") == [pytest.approx(1.0)] * 2
    assert decoded.counts.rejected == {"frame of another bus": 2}
    assert len(decoded.counts.warnings) == 1
    assert "record each bus apart" in decoded.counts.warnings[0]


def test_another_device_at_an_address_is_warned_about() -> None:
    names = [b"\x01" * 8, b"\x01" * 8, b"\x02" * 8, b"\x02" * 8]
    decoded = decode_file(NMEA2000, [candump(60928, name) for name in names])
    assert decoded.counts.warnings == ("address 27 is that of another device from here on",)


def test_no_damaged_frame_raises_an_exception_and_every_line_is_counted() -> None:
    lines = fix_frames() + [
        candump(pgn, bytes(range(8))) for pgn in (127245, 127250, 128259, 129025, 129026, 130306)
    ]
    packets = list(damaged(lines, 20_000, seed=2))
    decoded = decode_live(NMEA2000, packets, "--line-format", "candump")
    counts = decoded.counts
    counted = sum(sum(c.values()) for c in (counts.accepted, counts.rejected, counts.unused))
    lines_of_packets = sum(len(packet_lines(p)) for p in packets)
    assert counted == lines_of_packets
    assert counts.rejected["malformed line"] > 1000
    assert len(counts.rejected) < 12


def _resident_bytes() -> int:
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("the memory of the process is read from /proc")
    return int(statm.read_text().split()[1]) * 4096


def test_a_flood_of_first_frames_needs_bounded_memory() -> None:
    first = [
        candump(pgn, bytes([sequence << 5, 223]) + b"123456", source)
        for pgn in (*FAST_PGNS, 126720, 126996, 130820)
        for source in range(254)
        for sequence in range(8)
    ]
    decoder = NMEA2000.make_decoder(options_of(NMEA2000))
    decode(live_batches(first), decoder)
    before = _resident_bytes()
    for _ in range(20):
        decode(live_batches(first), decoder)
    assert _resident_bytes() - before < 10e6
    assert len(decoder.counts.unused) == 3
