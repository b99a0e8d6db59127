"""Four recordings of R/V Nathaniel B. Palmer's instruments, joined to one log by a trial file."""

from pathlib import Path

import numpy as np
import pytest
from places import RECORDINGS

from shiplog import TrialLog, read
from shiplog.cli.main import main
from shiplog.types import FloatArray

NBP = RECORDINGS / "openrvdas"
TRIAL = """
[[source]]
name = "gyro"
format = "nmea0183"
address = "{folder}/NBP1406_gyr1.txt"
[[source]]
name = "seapath"
format = "nmea0183"
address = "{folder}/NBP1406_s330.txt"
[[source]]
name = "pcode"
format = "nmea0183"
address = "{folder}/NBP1406_PCOD.txt"
[[source]]
name = "weather"
format = "csv-lines"
address = "{folder}/NBP1406_mwx1.txt"
layout = "weather.toml"
"""
WEATHER = """
[[line]]
begins = "SUS"
source = "starboard"
fields = 9
[line.apparent_wind_angle]
column = 3
unit = "deg"
[line.apparent_wind_speed]
column = 4
unit = "m/s"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the log of the four files, `nbp.mcap`."""
    if not NBP.is_dir():
        pytest.skip(f"the recordings are not there: {NBP}")
    folder = tmp_path_factory.mktemp("nbp")
    (folder / "trial.toml").write_text(TRIAL.format(folder=NBP), encoding="utf-8")
    (folder / "weather.toml").write_text(WEATHER, encoding="utf-8")
    arguments = ["record", str(folder / "trial.toml"), "-o", str(folder / "nbp.mcap")]
    assert main(arguments) == 0
    return folder


@pytest.fixture(scope="module")
def log(folder: Path) -> TrialLog:
    return read(folder / "nbp.mcap")


def test_the_log_has_all_sources_at_their_rates_and_no_disorder(log: TrialLog) -> None:
    assert log.warnings == ()
    samples = {channel.topic: len(channel) for channel in log}
    assert samples["/heading/gyro.HE"] == 5000
    assert samples["/heading/seapath.IN"] == 625
    assert samples["/position/seapath.IN"] == 625
    assert samples["/position/pcode.GP"] == 1000
    assert samples["/apparent_wind_speed/weather.starboard"] == 1667
    spans = {c.topic: (c.measured_ns[-1] - c.measured_ns[0]) * 1e-9 for c in log}
    assert spans["/heading/gyro.HE"] == pytest.approx(1000.0, abs=1.0)
    assert log.duration_secs == pytest.approx(1667.0, abs=1.0)  # of the weather file


def test_the_two_headings_agree_within_three_tenths_of_a_degree(log: TrialLog) -> None:
    assert abs(np.median(_heading_differences_deg(log, 0.0))) < 0.05
    # the filter of the gyro lags by 1.2 s, in which the ship yaws up to 0.6 deg in the swell
    assert np.quantile(np.abs(_heading_differences_deg(log, 1.2)), 0.95) < 0.3


def _heading_differences_deg(log: TrialLog, lag_secs: float) -> FloatArray:
    """Return the Seapath's heading minus that of the gyro, advanced by its lag, in deg."""
    gyro, seapath = log["heading/gyro.HE"], log["heading/seapath.IN"]
    times = gyro.measured_ns - lag_secs * 1e9
    known = np.interp(seapath.measured_ns, times, np.unwrap(gyro.values))
    return np.degrees(np.angle(np.exp(1j * (seapath.values - known))))[5:-5]


def test_the_rollover_of_the_week_of_one_receiver_is_corrected_and_an_event(log: TrialLog) -> None:
    texts = [event.text for event in log.events if event.source == "pcode"]
    assert any("1024 weeks early" in text and "2014-08-01" in text for text in texts)
    for source in ("pcode.GP", "seapath.IN"):
        times = log[f"gnss_time/{source}"].values
        assert times[0] == pytest.approx(1_406_851_200, abs=2)  # 2014-08-01T00:00:00Z


def test_the_positions_of_the_two_receivers_agree_within_their_antennas(log: TrialLog) -> None:
    fixes = [log[f"position/{source}"] for source in ("seapath.IN", "pcode.GP")]
    end_ns = min(int(channel.measured_ns[-1]) for channel in fixes)
    ends = np.array(
        [[np.interp(end_ns, c.measured_ns, c.values[:, k]) for k in (0, 1)] for c in fixes]
    )
    north, east = np.diff(np.radians(ends), axis=0)[0] * 6371e3
    assert np.hypot(north, east * np.cos(np.radians(22))) < 60.0


def test_a_replay_names_what_is_missing_and_what_can_be_derived(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(folder / "nbp.mcap")]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "no channel 'yaw_rate'" in error
    assert "--derive yaw_rate" in error


def test_the_yaw_rate_is_derived_from_a_heading_marked_and_with_its_noise(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["convert", "nbp.mcap", "derived.mcap", "--derive", "yaw_rate"]
    assert (
        main([*arguments[:1], *(str(folder / name) for name in arguments[1:3]), *arguments[3:]])
        == 0
    )
    assert "yaw_rate: derived from /heading/gyro.HE, noise" in capsys.readouterr().err
    derived = read(folder / "derived.mcap")["yaw_rate"]
    assert derived.source == "derived.gyro.HE"
    assert derived.metadata["derived_from"] == "/heading/gyro.HE"
    heading = read(folder / "nbp.mcap")["heading/gyro.HE"]
    turned = np.unwrap(heading.values)[-1] - heading.values[0]
    secs = np.diff(derived.measured_ns) * 1e-9
    assert np.sum(derived.values[:-1] * secs) == pytest.approx(turned, abs=np.radians(0.2))
