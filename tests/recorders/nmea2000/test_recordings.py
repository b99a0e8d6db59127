"""The recordings of NMEA 2000 networks, recorded to logs and read back."""

from pathlib import Path

import numpy as np
import pytest
from decoded_streams import file_batches, file_lines, options_of

import shiplog
from recorders.nmea2000.cli import NMEA2000
from recorders.record import record
from recorders.streams.counts import StreamCounts
from recorders.streams.stream_source import StreamSource
from shiplog import Channel
from shiplog.errors import LogError

Channels = dict[str, Channel]


def _record(path: Path, log: Path, *options: str) -> tuple[Channels, StreamCounts]:
    opened = NMEA2000.open_file(
        file_batches(file_lines(path), 1000), options_of(NMEA2000, *options)
    )
    source = StreamSource("bus", "nmea2000", opened.batches, opened.decoder, origin=path.name)
    record(source, log)
    return {c.topic: c for c in shiplog.read(log).channels}, opened.decoder.counts


def _rates(log: Channels, name: str) -> dict[str, float]:
    """Return the mean rate of each source of a channel, Hz."""
    return {
        channel.source: round(
            (len(channel.values) - 1) * 1e9 / float(np.ptp(channel.received_ns)), 1
        )
        for channel in log.values()
        if channel.name == name
    }


def test_susteranna_has_three_yaw_rates_and_one_engine(recordings: Path, tmp_path: Path) -> None:
    file = recordings / "nmea2000" / "susteranna-actisense-serial.raw"
    log, counts = _record(file, tmp_path / "s.mcap")
    assert counts.rejected == {"message without data": 2}
    assert _rates(log, "yaw_rate") == {"15": 20.2, "17": 10.1, "128": 10.1}
    means = {c.source: c.values.mean() for c in log.values() if c.name == "yaw_rate"}
    assert means["128"] - means["15"] == pytest.approx(0.0109, abs=1e-4)  # rad/s: they disagree
    rpm = log["/rpm/16"].values
    assert (len(rpm), rpm.min(), rpm.max()) == (314, pytest.approx(781.25), pytest.approx(818.5))
    assert _rates(log, "rudder") == {"26": 8.3}
    assert {c.source for c in log.values() if c.name == "speed"} == {"8", "19", "20"}


def test_triton_has_five_speeds_of_which_three_are_stuck(recordings: Path, tmp_path: Path) -> None:
    log, counts = _record(recordings / "nmea2000" / "triton-engine-setup.all", tmp_path / "t.mcap")
    assert counts.rejected == {}
    speeds = {c.source: c.values for c in log.values() if c.name == "speed"}
    assert {source for source, values in speeds.items() if not values.any()} == {"33", "34", "36"}
    assert set(speeds) == {"33", "34", "35", "36", "38"}
    assert _rates(log, "yaw_rate") == {"27": 20.0, "52": 10.0}
    assert _rates(log, "rudder") == {"0": 7.9, "19": 7.9}
    assert log["/heading/52"].values.size == 261  # true; that of 27 is magnetic
    assert log["/magnetic_heading/27"].values.size == 521


def test_gnss_time_of_triton_is_applied_where_it_is_that_of_the_fix(
    recordings: Path, tmp_path: Path
) -> None:
    """Address 23 states the last full second of a clock that is out of step with its messages.

    Against the positions of 52, its own spread by 1.1 m at the stated times and by 0.6 m at those
    of reception.
    """
    file = recordings / "nmea2000" / "triton-engine-setup.all"
    log, counts = _record(file, tmp_path / "t.mcap", "--time", "gnss")
    fix, rapid = log["/position/52.gnss"], log["/position/52"]
    assert set(np.diff(fix.measured_ns).tolist()) == {10**9}
    assert set((fix.measured_ns % 10**9).tolist()) == {200_000_000}
    assert np.ptp(rapid.received_ns - rapid.measured_ns) == 0
    late = log["/position/23.gnss"]
    assert late.measured_ns.tolist() == late.received_ns.tolist()
    assert len(counts.warnings) == 1
    assert "23 129029: GNSS time steps by 2.00 s within 1.01 s" in counts.warnings[0]


def test_latencies_of_susteranna_are_applied_without_a_step_of_any_clock(
    recordings: Path, tmp_path: Path
) -> None:
    file = recordings / "nmea2000" / "susteranna-actisense-serial.raw"
    _record(file, tmp_path / "s.mcap", "--time", "gnss")
    log = shiplog.read(tmp_path / "s.mcap")
    latencies = {
        source: np.unique(
            log[f"position/{source}"].received_ns - log[f"position/{source}"].measured_ns
        )
        for source in ("0", "18", "127")
    }
    assert {s: (v * 1e-9).round(3).tolist() for s, v in latencies.items()} == {
        "0": [0.0],  # its time stands still for four seconds
        "18": [0.963],
        "127": [0.517],
    }
    assert not [text for text in log.warnings if "clock of the sensor" in text]


def test_furuno_turns_without_a_rudder(recordings: Path, tmp_path: Path) -> None:
    file = recordings / "nmea2000" / "furuno-130842-wide-turn.raw"
    log, counts = _record(file, tmp_path / "f.mcap")
    assert counts.rejected == {}
    assert _rates(log, "yaw_rate") == {"27": 20.0, "52": 10.0}
    assert _rates(log, "speed") == {"35": 5.0}
    assert {c.name for c in log.values()} == {
        "yaw_rate", "speed", "pitch", "roll", "heave", "position", "speed_over_ground",
        "course_over_ground",
    }  # fmt: skip


def test_the_yaw_rate_of_furuno_turns_its_course(recordings: Path, tmp_path: Path) -> None:
    """The course over ground, of another sensor, is the independent reference of the sign."""
    file = recordings / "nmea2000" / "furuno-130842-wide-turn.raw"
    log, _ = _record(file, tmp_path / "f.mcap")
    rate, course = log["/yaw_rate/27"], log["/course_over_ground/25"]
    secs = (rate.received_ns - rate.received_ns[0]) * 1e-9
    turned = np.trapezoid(rate.values, secs)
    course_change = np.unwrap(course.values)[-1] - course.values[0]
    assert course_change > np.pi
    assert turned == pytest.approx(course_change, rel=0.05)


def test_the_stamps_of_raymarine_are_refused(recordings: Path, tmp_path: Path) -> None:
    file = recordings / "nmea2000" / "raymarine-ev1.raw"
    with pytest.raises(LogError, match="no times of reception"):
        _record(file, tmp_path / "r.mcap")
    assert not list(tmp_path.iterdir())


def test_ikonvert_is_dated_by_its_start(recordings: Path, tmp_path: Path) -> None:
    file = recordings / "nmea2000" / "ikonvert.log"
    log, counts = _record(file, tmp_path / "i.mcap", "--start", "2018-10-19T16:30:00Z")
    assert counts.rejected == {"malformed line": 24}
    heading = log["/magnetic_heading/3"]
    assert len(heading.values) == 2846
    gaps = np.diff(heading.received_ns) * 1e-9
    assert np.median(gaps) == pytest.approx(0.1, abs=0.002)  # also where they print "482.37"
    assert gaps.min() > 0
    assert log["/yaw_rate/3"].values.size == 2852
    assert "/position/2" not in log  # no fix all the time


def test_ikonvert_without_a_start_begins_in_1970_with_a_warning(
    recordings: Path, tmp_path: Path
) -> None:
    log, counts = _record(recordings / "nmea2000" / "ikonvert.log", tmp_path / "i.mcap")
    assert log["/yaw_rate/3"].received_ns[0] == 481_735_000_000
    assert "state its date by --start" in counts.warnings[0]


def test_the_frames_of_actisense_have_none_of_our_channels(
    recordings: Path, tmp_path: Path
) -> None:
    file = recordings / "nmea2000" / "actisense-522.candump.log"
    _, counts = _record(file, tmp_path / "a.mcap")
    assert (counts.rejected, counts.accepted) == ({}, {})
    assert sum(counts.unused.values()) == 106
