"""Tests of recorders.csv_lines: lines of values to channels."""

import csv
from math import isnan, radians
from pathlib import Path

import numpy as np
import pytest
from decoded_streams import (
    Decoded,
    damaged,
    decode,
    decode_file,
    decode_live,
    file_lines,
    live_batches,
)
from places import LAYOUTS, SAMPLE_DATA

from recorders.csv_lines.cli import CSV_LINES
from recorders.csv_lines.csv_decoder import CsvDecoder
from recorders.csv_lines.device import parse_device
from recorders.streams.packets import packet_lines
from shiplog.errors import LogError, UsageError

WEATHER = LAYOUTS / "weather_lines.toml"
WIND = b"WIND,A,325,009.91,M,60,0D"
PALMER = """
[[line]]
begins = "SUS"
fields = 9
checksum = true
where = { 5 = "M", 8 = "60" }
[line.apparent_wind_angle]
column = 3
unit = "deg"
[line.apparent_wind_speed]
column = 4
unit = "m/s"
[[line]]
begins = "MET"
fields = 11
[line.air_temperature]
column = 4
unit = "degC"
[line.humidity]
column = 5
unit = "%"
[line.air_pressure]
column = 11
unit = "hPa"
"""
POSITIONS = """
delimiter = ";"
[[line]]
source = "plotter"
[line.position]
latitude = 1
north_south = 2
longitude = 3
east_west = 4
altitude = 5
unit = "ddmm.mmmm"
[line.rudder]
column = 6
unit = "deg"
sign = -1
[line.rpm.port]
column = 7
unit = "rpm"
"""


def decoded(text: str, *lines: bytes) -> Decoded:
    return decode(live_batches(lines), CsvDecoder(parse_device(text, "device.toml")))


def test_lines_over_a_live_stream_are_decoded_in_si_units() -> None:
    lines = [WIND + b"\r\n" + WIND, b"AIR,19.1,63.9,1013.2"]
    result = decode_live(CSV_LINES, lines, "--layout", str(WEATHER))
    angle = result.channels["/apparent_wind_angle/anemometer"]
    assert angle.values.tolist() == pytest.approx([radians(325)] * 2)
    assert angle.received_ns.tolist() == [0, 0]
    assert result.values("/apparent_wind_speed/anemometer") == pytest.approx([9.91] * 2)
    assert result.values("/air_temperature/weather") == [19.1]
    assert result.values("/humidity/weather") == pytest.approx([0.639])
    assert result.values("/air_pressure/weather") == pytest.approx([101_320.0])


def test_the_example_is_read_with_its_stamps_and_a_status_is_rejected() -> None:
    lines = file_lines(SAMPLE_DATA / "weather_lines.txt")
    result = decode_file(CSV_LINES, lines, "--layout", str(WEATHER))
    wind = result.channels["/apparent_wind_speed/anemometer"]
    assert len(wind.values) + sum(result.counts.rejected.values()) == 20
    assert np.diff(wind.received_ns).min() == 10**9
    assert result.counts.accepted == {"WIND": 19, "AIR": 5}


def test_positions_have_hemispheres_minutes_and_signs() -> None:
    result = decoded(POSITIONS, b"2230.5;S;01756.36;W;12.5;-10;95", b"5400;N;1000;E;;;")
    fixes = result.channels["/position/plotter"].values
    np.testing.assert_allclose(fixes[0], [-(22 + 30.5 / 60), -(17 + 56.36 / 60), 12.5])
    assert isnan(fixes[1, 2])
    assert result.values("/rudder/plotter") == pytest.approx([radians(10)])
    assert result.values("/rpm/plotter.port") == [95.0]


def test_two_receivers_in_one_line_are_two_sources() -> None:
    text = """
[[line]]
source = "plotter"
[line.position.bow]
latitude = 1
longitude = 2
unit = "deg"
[line.position.stern]
latitude = 3
longitude = 4
unit = "deg"
"""
    channels = decoded(text, b"54.0,10.0,53.5,9.5").channels
    assert channels["/position/plotter.bow"].values[0, :2].tolist() == [54.0, 10.0]
    assert channels["/position/plotter.stern"].values[0, :2].tolist() == [53.5, 9.5]


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (WIND[:-1] + b"C", "wrong checksum"),
        (b"WIND,A,326,009.91,M,60,0D", "wrong checksum"),
        (b"WIND,A,325,009.91,M,60", "wrong number of fields"),
        (b"WIND,A,325,009.91,N,60,0E", "unit or status is not that of a valid line"),
        (b"AIR,1_9,63.9,1013.2", "field is no number"),
        (b"AIR,inf,63.9,1013.2", "field is no number"),
        (b"AIR,19.1,x,1013.2", "field is no number"),
        (b"AIR,19.1,63.9,1e308", "field is no number"),  # infinite in Pa
        (b"AIR\xff,19.1,63.9,1013.2", "characters that are not ASCII"),
    ],
)
def test_what_is_wrong_is_rejected_under_its_reason(line: bytes, reason: str) -> None:
    counts = decode_live(CSV_LINES, [line], "--layout", str(WEATHER)).counts
    assert counts.rejected == {reason: 1}


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"9100;N;1000;E;;0;0", "position outside of the globe"),
        (b"5460;N;1000;E;;0;0", "position with 60 minutes or more"),
        (b"5400;E;1000;E;;0;0", "hemisphere is no letter N, S, E or W"),
        (b"5400;N;1000", "too few fields"),
    ],
)
def test_impossible_positions_are_rejected(line: bytes, reason: str) -> None:
    assert decoded(POSITIONS, line).counts.rejected == {reason: 1}


def test_other_lines_and_empty_fields_are_counted_as_unused() -> None:
    lines = [b"RAIN,3", b"\x1b[31m,3", b"AIR,,nan,"]
    counts = decode_live(CSV_LINES, lines, "--layout", str(WEATHER)).counts
    assert counts.unused == {"RAIN": 1, "_31m": 1, "AIR without a value": 1}


def test_a_file_without_stamps_and_a_stream_without_a_layout_are_refused() -> None:
    with pytest.raises(LogError, match="no time stamps before the lines"):
        decode_file(CSV_LINES, [WIND] * 3, "--layout", str(WEATHER))
    with pytest.raises(UsageError, match="--layout FILE"):
        decode_live(CSV_LINES, [WIND])


def test_stamps_without_a_date_are_warned_about_or_dated() -> None:
    lines = [b"08:00:00 " + WIND] * 3
    counts = decode_file(CSV_LINES, lines, "--layout", str(WEATHER)).counts
    assert "state it by --date" in counts.warnings[0]
    dated = decode_file(CSV_LINES, lines, "--layout", str(WEATHER), "--date", "1970-01-02")
    wind = dated.channels["/apparent_wind_speed/anemometer"]
    assert wind.received_ns[0] == (24 + 8) * 3600 * 10**9


def test_no_damaged_line_raises_an_exception_and_each_is_counted() -> None:
    packets = list(damaged([WIND, b"AIR,19.1,63.9,1013.2"], 20_000, seed=4))
    counts = decode_live(CSV_LINES, packets, "--layout", str(WEATHER)).counts
    counted = sum(sum(c.values()) for c in (counts.accepted, counts.rejected, counts.unused))
    assert counted == sum(len(packet_lines(packet)) for packet in packets)
    assert len(counts.rejected) <= 6
    assert len(counts.unused) <= 257


def test_the_weather_of_the_palmer_is_that_of_its_lines(recordings: Path, tmp_path: Path) -> None:
    """The reference is a plain reading of the file by column."""
    layout = tmp_path / "palmer.toml"
    layout.write_text(PALMER)
    file = recordings / "openrvdas" / "NBP1406_mwx1.txt"
    result = decode_file(CSV_LINES, file_lines(file), "--layout", str(layout))
    rows = list(csv.reader(line.split(" ")[1] for line in file.read_text().splitlines()))
    sus = np.array([[float(row[2]), float(row[3])] for row in rows if row[0] == "SUS"])
    met = np.array([[float(row[3]), float(row[10])] for row in rows if row[0] == "MET"])
    np.testing.assert_allclose(
        result.values("/apparent_wind_angle/SUS"), np.radians(sus[:, 0]), rtol=1e-12
    )
    np.testing.assert_allclose(result.values("/apparent_wind_speed/SUS"), sus[:, 1])
    np.testing.assert_allclose(result.values("/air_temperature/MET"), met[:, 0])
    np.testing.assert_allclose(result.values("/air_pressure/MET"), 100 * met[:, 1])
    assert result.counts.accepted == {"SUS": 1667, "MET": 1667}
    assert result.counts.unused == {"PUS": 1666}
    assert result.counts.rejected == {}
