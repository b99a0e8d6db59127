"""Tests of recorders.signalk: deltas to channels, with values as the specification states them."""

import json
from math import isnan, nan

import numpy as np
import pytest
from decoded_streams import damaged, decode_file, decode_live

from recorders.signalk.cli import SIGNALK
from recorders.signalk.signalk_paths import TARGETS
from shiplog.errors import LogError
from shiplog.units import CATALOGUE

TIME = "2026-11-29T08:00:00.250Z"
TIME_NS = 1_795_939_200_250_000_000


def delta(
    *values: tuple[str, object], source: str = "n2k.204", time: str = TIME, **more: object
) -> bytes:
    pairs = [{"path": path, "value": value} for path, value in values]
    update = {"$source": source, "timestamp": time, "values": pairs}
    return json.dumps({"updates": [update]} | more).encode()


def test_the_paths_of_the_four_channels_of_a_replay_are_read_in_our_units() -> None:
    line = delta(
        ("navigation.rateOfTurn", 0.01),
        ("navigation.speedThroughWater", 5.14),
        ("steering.rudderAngle", -0.0873),
        ("propulsion.port.revolutions", 2.5),
    )
    decoded = decode_file(SIGNALK, [line])
    assert {topic: c.values.tolist() for topic, c in decoded.channels.items()} == {
        "/yaw_rate/n2k.204": [0.01],
        "/speed/n2k.204": [5.14],
        "/rudder/n2k.204": [-0.0873],
        "/rpm/n2k.204.port": [150.0],
    }


def test_every_path_has_a_channel_of_the_catalogue() -> None:
    assert {target.channel for target in TARGETS.values()} <= set(CATALOGUE)


def test_positions_attitudes_times_and_temperatures_are_read() -> None:
    line = delta(
        ("navigation.position", {"latitude": -22.5, "longitude": -17.9, "altitude": 3.0}),
        ("navigation.attitude", {"roll": 0.05, "pitch": None, "yaw": 1.2}),
        ("navigation.datetime", "1970-01-02T00:00:00.5Z"),
        ("environment.water.temperature", 288.15),
    )
    decoded = decode_file(SIGNALK, [line])
    np.testing.assert_array_equal(
        decoded.channels["/position/n2k.204"].values, [[-22.5, -17.9, 3.0]]
    )
    assert decoded.values("/roll/n2k.204") == [0.05]
    assert "/pitch/n2k.204" not in decoded.channels
    assert decoded.values("/gnss_time/n2k.204") == [86400.5]
    assert decoded.values("/water_temperature/n2k.204") == [pytest.approx(15.0)]


def test_a_position_without_altitude_has_none() -> None:
    line = delta(("navigation.position", {"latitude": 54, "longitude": 10}))
    assert isnan(decode_file(SIGNALK, [line]).channels["/position/n2k.204"].values[0, 2])


def test_each_update_of_a_file_has_its_own_time_and_source() -> None:
    updates: list[dict[str, object]] = [
        {
            "source": {"label": "ais", "type": "NMEA0183", "talker": "GP"},
            "timestamp": "1970-01-01T00:00:01Z",
            "values": [{"path": "navigation.speedOverGround", "value": 4}],
        },
        {
            "source": {"label": "n2k", "type": "NMEA2000", "src": "35", "pgn": 128259},
            "timestamp": "1970-01-01T00:00:03Z",
            "values": [{"path": "navigation.speedThroughWater", "value": 5}],
        },
    ]
    decoded = decode_file(SIGNALK, [json.dumps({"updates": updates}).encode()])
    ground, water = (
        decoded.channels[topic] for topic in ("/speed_over_ground/ais.GP", "/speed/n2k.35")
    )
    assert ground.measured_ns.tolist() == [10**9]
    assert water.measured_ns.tolist() == [3 * 10**9]
    assert water.received_ns.tolist() == [10**9]


def test_what_is_received_live_has_the_time_of_reception() -> None:
    decoded = decode_live(SIGNALK, [b"", delta(("navigation.headingTrue", 1.0))])
    channel = decoded.channels["/heading/n2k.204"]
    assert channel.measured_ns.tolist() == channel.received_ns.tolist() == [10**8]


def test_stamps_before_the_deltas_are_their_times_of_reception() -> None:
    lines = [
        b"2026-11-29T08:00:0%dZ " % n + delta(("navigation.headingTrue", 1.0)) for n in range(3)
    ]
    channel = decode_file(SIGNALK, lines).channels["/heading/n2k.204"]
    assert (channel.measured_ns - (TIME_NS - 250_000_000)).tolist() == [0, 10**9, 2 * 10**9]


def _timed(n: int) -> bytes:
    """Return a delta of a receiver with a fix and its time, and one of its other sensors."""
    fix = ("navigation.position", {"latitude": 54, "longitude": 10})
    time = f"2026-11-29T08:00:{n:02d}Z"
    stamp = f"2026-11-29T08:00:{n:02d}.300Z"
    values = [fix, ("navigation.datetime", time), ("navigation.headingTrue", 1.0)]
    return delta(*values, time=stamp)


@pytest.mark.parametrize("stamped", [True, False])
def test_gnss_time_is_the_time_of_measurement_of_a_receivers_values_on_request(
    stamped: bool,
) -> None:
    stamps = [b"2026-11-29T08:00:%02d.300Z " % n if stamped else b"" for n in range(20)]
    lines = [stamp + _timed(n) for n, stamp in enumerate(stamps)]
    decoded = decode_file(SIGNALK, lines, "--time", "gnss")
    seconds = [TIME_NS - 250_000_000 + n * 10**9 for n in range(20)]
    assert decoded.channels["/position/n2k.204"].measured_ns.tolist() == seconds
    heading = decoded.channels["/heading/n2k.204"]
    assert heading.measured_ns.tolist() == [ns + 300_000_000 for ns in seconds]
    assert decoded.values("/gnss_time/n2k.204") == [ns * 1e-9 for ns in seconds]


def test_the_latency_of_a_receiver_is_noted_and_a_late_one_warned_about() -> None:
    lines = [b"2026-11-29T08:00:%02d.300Z " % n + _timed(n) for n in range(20)]
    counts = decode_file(SIGNALK, lines).counts
    assert counts.notes["latency_s.n2k.204.navigation.datetime"].startswith("0.300 ")
    assert "the receiver is late; with --time gnss" in counts.warnings[0]


def test_other_ships_are_not_recorded() -> None:
    mine = "vessels.urn:mrn:imo:mmsi:230029970"
    lines = [
        delta(("navigation.speedOverGround", 9.0), context="vessels.urn:mrn:imo:mmsi:211000000"),
        delta(("navigation.speedOverGround", 4.0), context=mine),
        delta(("navigation.speedOverGround", 5.0), context="vessels.self"),
    ]
    greeting = json.dumps({"self": mine, "version": "1.0", "timestamp": TIME}).encode()
    topic = "/speed_over_ground/n2k.204"
    assert decode_file(SIGNALK, lines).values(topic) == [5.0]
    assert decode_file(SIGNALK, [greeting, *lines]).values(topic) == [4.0, 5.0]
    assert decode_file(SIGNALK, lines, "--self", mine).values(topic) == [4.0, 5.0]


def test_a_log_of_unknown_ships_names_them() -> None:
    line = delta(("navigation.speedOverGround", 9.0), context="vessels.urn:mrn:imo:mmsi:211000000")
    counts = decode_file(SIGNALK, [line]).counts
    assert "state which of these it is by --self: vessels.urn" in counts.warnings[0]


def test_other_paths_and_missing_values_are_counted_as_unused() -> None:
    line = delta(("navigation.log", 1e6), ("navigation.headingTrue", None), ("\x1b[31m", 1))
    counts = decode_file(SIGNALK, [line]).counts
    assert counts.unused == {"navigation.log": 1, "navigation.headingTrue": 1, "_31m": 1}


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"{", "line is no JSON"),
        (b"[1]", "line is no JSON object"),
        (b"[" * 4000, "line is no JSON"),
        (b"\xff\xfe", "line is no JSON"),
        (b'{"updates": 1}', "updates or values are no list"),
        (b'{"updates": [1]}', "update is no object"),
        (delta(("navigation.headingTrue", "north")), "value is no number"),
        (delta(("navigation.headingTrue", True)), "value is no number"),
        (delta(("navigation.headingTrue", nan)), "value is no finite number"),
        (delta(("navigation.headingTrue", 10**400)), "value is no finite number"),
        (delta(("navigation.position", 1)), "position is no object"),
        (
            delta(("navigation.position", {"latitude": 91, "longitude": 0})),
            "position outside of the globe",
        ),
        (delta(("navigation.datetime", "noon")), "time stamp is no date and time with a zone"),
        (b'{"updates": [{"values": [{"value": 1}]}]}', "value without a path"),
        (b" " * 4096, "line of more than 4096 bytes"),
    ],
)
def test_what_is_wrong_is_rejected_under_its_reason(line: bytes, reason: str) -> None:
    assert decode_live(SIGNALK, [line]).counts.rejected == {reason: 1}


@pytest.mark.parametrize("context", [[], {}, 5, None, True])
def test_a_context_that_is_no_text_is_rejected(context: object) -> None:
    counts = decode_live(SIGNALK, [delta(("navigation.rateOfTurn", 0.01), context=context)]).counts
    assert counts.rejected == {"context is no text": 1}


def test_a_wrong_update_does_not_reject_the_others_and_each_is_counted() -> None:
    value = {"path": "navigation.rateOfTurn", "value": 0.01}
    updates = [5, {"values": [value]}, {"values": 7}, {"values": []}, {"values": [value, value]}]
    lines = [json.dumps({"updates": each}).encode() for each in (updates, [])]
    counts = decode_live(SIGNALK, lines).counts
    assert counts.accepted == {"navigation.rateOfTurn": 3}
    assert counts.unused == {"update without a value": 1, "delta without a value": 1}
    assert counts.rejected == {"update is no object": 1, "updates or values are no list": 1}


def test_a_value_that_is_infinite_in_our_unit_is_rejected() -> None:
    decoded = decode_live(SIGNALK, [delta(("propulsion.port.revolutions", 1e308))])
    assert decoded.channels == {}
    assert decoded.counts.rejected == {"value is no finite number": 1}


def test_of_an_object_all_values_are_read_or_none() -> None:
    decoded = decode_live(SIGNALK, [delta(("navigation.attitude", {"roll": 0.1, "pitch": "x"}))])
    assert decoded.channels == {}
    assert decoded.counts.rejected == {"value is no number": 1}


def test_a_flood_of_greetings_names_few_own_ships() -> None:
    greetings = [json.dumps({"self": f"urn:{n}"}).encode() for n in range(1000)]
    turn = ("navigation.rateOfTurn", 0.01)
    deltas = [delta(turn, context=f"vessels.urn:{n}") for n in (0, 999)]
    counts = decode_live(SIGNALK, [*greetings, *deltas]).counts
    assert counts.accepted == {"navigation.rateOfTurn": 1}
    assert counts.unused == {"no delta": 1000, "delta of another ship": 1}


@pytest.mark.parametrize("time", ["9999-12-31T00:00:00Z", "1950-01-01T00:00:00Z"])
def test_times_that_no_log_can_hold_are_rejected(time: str) -> None:
    turn = ("navigation.rateOfTurn", 0.01)
    decoded = decode_file(SIGNALK, [delta(turn), delta(turn, time=time), delta(turn)])
    assert decoded.channels["/yaw_rate/n2k.204"].received_ns.tolist() == [TIME_NS, TIME_NS]
    assert decoded.counts.rejected == {"time stamp outside of the years 1970 to 2261": 1}


def test_a_file_without_times_is_refused() -> None:
    line = b'{"updates": [{"values": [{"path": "navigation.headingTrue", "value": 1}]}]}'
    with pytest.raises(LogError, match="no delta has a time"):
        decode_file(SIGNALK, [line])


def test_a_file_of_another_format_is_refused() -> None:
    with pytest.raises(LogError, match="none of the first 2 lines is a delta of Signal K"):
        decode_file(SIGNALK, [b"$HEHDT,218.53,T*12"] * 2)


def test_names_of_sources_fit_a_topic() -> None:
    lines = [
        delta(("navigation.headingTrue", 1.0), source=source)
        for source in ("/../etc/\x1b[0m", "", "x" * 500)
    ]
    topics = set(decode_file(SIGNALK, lines).channels)
    assert topics == {"/heading/etc_0m", "/heading/signalk", "/heading/" + "x" * 64}


def test_no_damaged_delta_raises_an_exception() -> None:
    lines = [
        delta(("navigation.headingTrue", 1.0), ("navigation.attitude", {"roll": 0.1})),
        delta(("navigation.position", {"latitude": 54, "longitude": 10}), context="vessels.self"),
    ]
    packets = list(damaged(lines, 20_000, seed=3))
    counts = decode_live(SIGNALK, packets).counts
    assert counts.rejected["line is no JSON"] > 5000
    assert sum(counts.accepted.values()) > 500
    assert len(counts.rejected) < 16


def test_a_flood_of_sources_needs_bounded_memory() -> None:
    lines = [
        delta(("navigation.headingTrue", 1.0), (f"path.{n}", 1), source=f"s{n}", context=context)
        for n in range(1000)
        for context in ("vessels.self", f"vessels.{n}")
    ]
    decoded = decode_live(SIGNALK, lines)
    assert len(decoded.channels) == 256
    assert len(decoded.counts.unused) <= 257
