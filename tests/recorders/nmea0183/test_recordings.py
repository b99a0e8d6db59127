"""What real recordings yield: rates, sources, rejected lines, and the way to a replay."""

import argparse
from pathlib import Path

import numpy as np
import pynmea2
import pynmeagps
import pytest

from analysis import analyse
from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.record import record
from recorders.streams.reception_clock import ReceptionClock
from recorders.trial.open_source import StreamRequest, open_streams
from recorders.trial.recorded_source import RecordedSource
from shiplog import TrialLog, read
from shiplog.errors import LogError

DATA = Path(__file__).parents[4] / "shared" / "data"
NMEA, NBP = DATA / "nmea0183", DATA / "openrvdas"
ROB, PLAKA = NMEA / "rob-2025-11-20.nmea", NMEA / "plaka.log"
N2KD = NMEA / "n2kd-183-merrimac.log"
REASON = "the recordings are not in ../shared/data"
pytestmark = pytest.mark.skipif(not NMEA.is_dir() or not NBP.is_dir(), reason=REASON)
NEEDS = "a replay needs yaw_rate, speed, rudder, rpm"


class Recorded:
    """A recording as a log, with the counts of its streams."""

    def __init__(self, folder: Path, *paths: Path, options: tuple[str, ...] = ()) -> None:
        parser = argparse.ArgumentParser()
        NMEA0183.configure(parser)
        parsed = parser.parse_args(options)
        requests = [StreamRequest(p.stem, NMEA0183, str(p), parsed, keep_raw=False) for p in paths]
        source = open_streams(requests, ReceptionClock())
        assert isinstance(source, RecordedSource)
        path = folder / "trial.mcap"
        record(source, path)
        self.counts = [stream.decoder.counts for stream in source.streams]
        self.log: TrialLog = read(path)

    @property
    def samples(self) -> dict[str, int]:
        """The number of samples by topic."""
        return {channel.topic: len(channel) for channel in self.log.channels}


def test_rob_yields_rate_of_turn_rudder_and_two_logs_and_misses_only_the_revolutions(
    tmp_path: Path,
) -> None:
    recorded = Recorded(tmp_path, ROB)
    [counts] = recorded.counts
    assert counts.rejected == {"no checksum": 2}  # one of them of AIS, cut
    assert counts.unused == {
        "VWVLW": 387, "!AIVDM": 429, "PLCJE8FC8": 727, "PLCJ": 726, "PSMDNC": 82,
    }  # fmt: skip
    samples = recorded.samples
    for topic, count in {
        "/yaw_rate/TI": 7730,
        "/rudder/AG": 3861,
        "/speed/VW": 387,
        "/speed/VD.VBW": 772,
        "/magnetic_heading/HC": 7734,
        "/heading/HC.HDG": 3868,  # half of the sentences have a variation
        "/position/GP.RMC": 768,
        "/pitch/YX": 4247,
        "/air_temperature/WI": 724,
    }.items():
        assert samples[topic] == count
    rudder = recorded.log["rudder"]
    secs = (rudder.measured_ns[-1] - rudder.measured_ns[0]) * 1e-9
    assert len(rudder) / secs == pytest.approx(10, rel=0.05)
    assert secs == pytest.approx(6.5 * 60, rel=0.02)
    assert counts.warnings[1].startswith(
        "magnetic_heading of HC alternates by 1.6 deg: two devices"
    )
    with pytest.raises(LogError, match=rf"no channel 'rpm'.*{NEEDS}"):
        analyse(recorded.log)


def test_plaka_yields_speeds_wind_depth_and_positions_and_asks_for_its_date(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path, PLAKA)
    [counts] = recorded.counts
    assert counts.rejected == {}
    assert counts.unused["IIHDT without a value"] == 14_500
    assert counts.unused["IIHDM without a value"] == 7250
    assert counts.warnings == (
        "no time stamps: times are those of GPZDA, interpolated by the order of lines",
        "GPZDA has no date: counted from 1970-01-01; state it with --date",
    )
    assert recorded.samples == {
        "/speed/II": 7250,
        "/course_over_ground/II": 7250,
        "/speed_over_ground/II": 7250,
        "/apparent_wind_angle/II": 3617,
        "/true_wind_angle/II": 3618,
        "/true_wind_angle/II.VWT": 7235,
        "/apparent_wind_speed/II": 3617,
        "/wind_speed/II.MWV": 3618,
        "/wind_speed/II.VWT": 7235,
        "/wind_speed/II": 7235,
        "/depth/II.below_transducer": 7250,
        "/position/GP.GLL": 7250,
    }
    speed = recorded.log["speed"]
    assert (speed.measured_ns[-1] - speed.measured_ns[0]) * 1e-9 == pytest.approx(14_846, abs=3)
    with pytest.raises(LogError, match=rf"no channel 'yaw_rate'.*{NEEDS}"):
        analyse(recorded.log)


def test_n2kd_has_no_time_and_is_read_with_an_interval(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"the file has no time.*--interval.*: .*n2kd-183"):
        Recorded(tmp_path, N2KD)
    recorded = Recorded(tmp_path, N2KD, options=("--interval", "0.2"))
    assert recorded.counts[0].rejected == {}
    assert recorded.samples == {
        "/apparent_wind_angle/02": 122,
        "/apparent_wind_speed/02": 122,
        "/apparent_wind_angle/24": 25,
        "/apparent_wind_speed/24": 25,
        "/magnetic_heading/04.HDM": 247,
        "/magnetic_heading/24": 123,
        "/magnetic_variation/24": 123,
        "/heading/24.HDG": 123,
        "/depth/23": 13,
        "/depth/05.below_transducer": 11,
    }


def test_the_weather_of_the_palmer_is_not_nmea_and_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no sample could be decoded"):
        Recorded(tmp_path, NBP / "NBP1406_mwx1.txt")


def test_three_loggers_of_the_palmer_give_one_log_with_headings_that_agree(tmp_path: Path) -> None:
    paths = [NBP / f"NBP1406_{name}.txt" for name in ("gyr1", "s330", "PCOD")]
    recorded = Recorded(tmp_path, *paths)
    assert all(counts.rejected == {} for counts in recorded.counts)
    samples = recorded.samples
    assert samples["/heading/HE"] == 5000
    assert samples["/heading/IN"] == samples["/heading/PSXN"] == samples["/roll/PSXN"] == 625
    assert samples["/position/IN"] == 625
    assert samples["/position/GP"] == 1000
    gyro, seapath = recorded.log["/heading/HE"], recorded.log["/heading/IN"]
    compared = np.interp(seapath.measured_ns, gyro.measured_ns, np.unwrap(gyro.values))
    difference_deg = np.degrees(np.abs(compared - np.unwrap(seapath.values)))
    assert np.median(difference_deg) < 0.3
    warnings = recorded.counts[2].warnings
    assert any("1994-12-16 is 1024 weeks early" in text for text in warnings)
    assert any("GGA 1.02 s, GLL 1.02 s, RMC 1.08 s" in text for text in warnings)
    times = recorded.log["/gnss_time/GP"]
    assert times.values[0] == 1_406_851_200.0  # 2014-08-01
    with pytest.raises(LogError, match=rf"no channel 'yaw_rate'.*{NEEDS}"):
        analyse(recorded.log)


def test_gnss_time_of_the_late_receiver_is_the_time_of_measurement_on_request(
    tmp_path: Path,
) -> None:
    recorded = Recorded(tmp_path, NBP / "NBP1406_PCOD.txt", options=("--time", "gnss"))
    fixes = recorded.log["/position/GP"]
    latency = (fixes.received_ns - fixes.measured_ns) * 1e-9
    assert np.median(latency) == pytest.approx(1.016, abs=0.002)
    steps = np.diff(fixes.measured_ns)
    assert np.count_nonzero(steps != 10**9) < 10


def test_positions_and_headings_are_those_of_two_parsers(tmp_path: Path) -> None:
    lines = [line.split(" ", 1)[1] for line in (NBP / "NBP1406_s330.txt").read_text().splitlines()]
    log = Recorded(tmp_path, NBP / "NBP1406_s330.txt").log
    gga = [line for line in lines if line.startswith("$INGGA")]
    theirs = [pynmea2.parse(line) for line in gga]
    fixes = log["/position/IN"].values
    np.testing.assert_allclose(fixes[:, 0], [each.latitude for each in theirs], atol=1e-9)
    np.testing.assert_allclose(fixes[:, 1], [each.longitude for each in theirs], atol=1e-9)
    others = [pynmeagps.NMEAReader.parse(line) for line in lines if line.startswith("$INHDT")]
    headings = np.degrees(log["/heading/IN"].values)
    np.testing.assert_allclose(headings, [each.headingT for each in others], atol=1e-9)
