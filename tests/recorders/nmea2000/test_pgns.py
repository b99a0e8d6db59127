"""Tests of recorders.nmea2000.pgns: payloads computed by hand from the published resolutions."""

import struct
from math import isnan, radians

import pytest

from recorders.nmea2000.canboat_library import FrameError, fields
from recorders.nmea2000.pgns import READINGS, Reading

NA = 0xFF


def _read(pgn: int, form: str, *values: int) -> dict[tuple[str, str], object]:
    """Return the readings of a payload, packed without padding, that are available."""
    readings: list[Reading] = READINGS[pgn](fields(pgn, struct.pack("<" + form, *values)))
    return {(r.channel, r.part): r.value for r in readings if r.value is not None}


def test_heading_is_true_or_magnetic_by_its_reference() -> None:
    heading = round(radians(123.4) / 1e-4)
    true = _read(127250, "BHhhB", NA, heading, 0x7FFF, 0x7FFF, 0xFC)
    magnetic = _read(127250, "BHhhB", NA, heading, 0x7FFF, 0x7FFF, 0xFD)
    assert true == {("heading", ""): pytest.approx(heading * 1e-4)}
    assert magnetic == {("magnetic_heading", ""): pytest.approx(heading * 1e-4)}


def test_a_heading_without_reference_is_none() -> None:
    assert _read(127250, "BHhhB", NA, 1000, 0x7FFF, 0x7FFF, 0xFF) == {}


def test_yaw_rate_is_positive_to_starboard_in_steps_of_1_over_32_microradian() -> None:
    assert _read(127251, "Bi3B", 0, 320_000, NA, NA, NA)["yaw_rate", ""] == pytest.approx(0.01)
    assert _read(127251, "Bi3B", 0, -320_000, NA, NA, NA)["yaw_rate", ""] == pytest.approx(-0.01)


@pytest.mark.parametrize("code", [0x7FFFFFFF, 0x7FFFFFFE, 0x7FFFFFFD])
def test_codes_for_not_available_and_faulty_are_not_measured(code: int) -> None:
    assert _read(127251, "Bi3B", 0, code, NA, NA, NA) == {}


def test_rudder_order_and_position_are_kept_apart_and_signed() -> None:
    read = _read(127245, "BBhhH", 0, 0xF8, -1745, 873, 0xFFFF)
    assert read == {
        ("rudder_order", ""): pytest.approx(-0.1745),
        ("rudder", ""): pytest.approx(0.0873),
    }


@pytest.mark.parametrize(
    ("instance", "part"), [(0, ""), (1, "1"), (251, "251"), (252, ""), (NA, "")]
)
def test_the_instance_names_the_second_rudder(instance: int, part: str) -> None:
    assert _read(127245, "BBhhH", instance, 0xFF, 0x7FFF, 100, 0xFFFF) == {
        ("rudder", part): pytest.approx(0.01)
    }


def test_engine_speed_is_in_revolutions_per_minute() -> None:
    read = _read(127488, "BHHbH", 1, 3200, 0xFFFF, 0x7F, 0xFFFF)
    assert read == {("rpm", "1"): pytest.approx(800.0)}


def test_speed_through_water_and_over_ground_are_never_mixed() -> None:
    read = _read(128259, "BHHBB", NA, 514, 618, 0, 0xFF)
    assert read["speed", ""] == pytest.approx(5.14)
    assert read["speed_over_ground", "log"] == pytest.approx(6.18)


def test_a_speed_with_an_unpublished_direction_is_rejected() -> None:
    with pytest.raises(FrameError, match="direction"):
        _read(128259, "BHHBB", NA, 514, 618, 0, 0xF3)


def test_attitude_has_pitch_and_roll_and_no_heading() -> None:
    read = _read(127257, "BhhhB", NA, 9000, 200, -300, NA)
    assert read == {("pitch", ""): pytest.approx(0.02), ("roll", ""): pytest.approx(-0.03)}


def test_a_position_south_and_west_has_negative_degrees() -> None:
    latitude, longitude, altitude = _read(129025, "ii", -220_018_183, -179_393_000)["position", ""]  # type: ignore[misc]
    assert (latitude, longitude) == pytest.approx((-22.0018183, -17.9393))
    assert isnan(altitude)


def test_a_position_outside_of_the_globe_is_rejected() -> None:
    with pytest.raises(FrameError, match="globe"):
        _read(129025, "ii", 910_000_000, 0)


def test_a_fix_has_position_time_quality_satellites_and_dilution() -> None:
    day, tenth_ms = 20_000, 432_000_000  # noon
    head = struct.pack("<BHI", NA, day, tenth_ms)
    place = struct.pack("<qqq", 54 * 10**16, 10 * 10**16, 12 * 10**6)
    tail = struct.pack("<BBBhhiB", 0x10, 0xFC, 9, 80, 120, 0, 0)
    read = {
        (r.channel, r.part): r.value
        for r in READINGS[129029](fields(129029, head + place + tail))
        if r.value is not None
    }
    assert read["position", "gnss"] == pytest.approx((54.0, 10.0, 12.0))
    assert read["gnss_time", "gnss"] == 20_000 * 86_400 + 43_200
    assert (read["fix_quality", ""], read["satellites", ""]) == (1, 9)
    assert read["hdop", ""] == pytest.approx(0.8)


def test_without_a_fix_there_is_no_position() -> None:
    place = struct.pack("<qqq", 0, 0, 0)
    data = struct.pack("<BHI", NA, 0xFFFF, 0xFFFFFFFF) + place + struct.pack("<BBB", 0, 0xFC, 0)
    readings = READINGS[129029](fields(129029, data))
    assert {r.channel for r in readings if r.value is not None} == {"fix_quality", "satellites"}


def test_a_course_relative_to_magnetic_north_is_no_course() -> None:
    assert _read(129026, "BBHHH", NA, 0xFC, 15708, 500, 0xFFFF) == {
        ("speed_over_ground", ""): pytest.approx(5.0),
        ("course_over_ground", ""): pytest.approx(1.5708),
    }
    assert _read(129026, "BBHHH", NA, 0xFD, 15708, 500, 0xFFFF) == {
        ("speed_over_ground", ""): pytest.approx(5.0)
    }


@pytest.mark.parametrize(
    ("reference", "channels", "part"),
    [
        (0, ("wind_speed", "wind_direction"), ""),
        (1, (), ""),  # from magnetic north
        (2, ("apparent_wind_speed", "apparent_wind_angle"), ""),
        (3, ("wind_speed", "true_wind_angle"), "ground"),
        (4, ("wind_speed", "true_wind_angle"), "water"),
    ],
)
def test_wind_is_true_or_apparent_by_its_reference(
    reference: int, channels: tuple[str, ...], part: str
) -> None:
    read = _read(130306, "BHHB2B", NA, 750, 7854, 0xF8 | reference, NA, NA)
    values = zip(channels, (7.5, 0.7854), strict=False)
    assert read == {(channel, part): pytest.approx(value) for channel, value in values}


@pytest.mark.parametrize(
    ("offset_mm", "part", "depth"),
    [(0, "", 12.34), (1500, "surface", 13.84), (-2000, "keel", 10.34)],
)
def test_the_offset_of_a_depth_is_added(offset_mm: int, part: str, depth: float) -> None:
    read = _read(128267, "BIhB", NA, 1234, offset_mm, NA)
    assert read == {("depth", part): pytest.approx(depth)}


def test_time_of_a_local_clock_is_no_gnss_time() -> None:
    gps = _read(126992, "BBHI", NA, 0xF0, 20_000, 10_000)
    crystal = _read(126992, "BBHI", NA, 0xF5, 20_000, 10_000)
    assert gps == {("gnss_time", ""): 20_000 * 86_400 + 1}
    assert crystal == {}


def test_depth_variation_and_heave_are_in_si_units() -> None:
    assert _read(128267, "BIhB", NA, 1234, 0x7FFF, NA)["depth", ""] == pytest.approx(12.34)
    assert _read(127258, "BBHhH", NA, 0xF8, 0xFFFF, -175, 0xFFFF) == {
        ("magnetic_variation", ""): pytest.approx(-0.0175)
    }
    assert _read(127252, "BhB4B", NA, -55, *[NA] * 5) == {("heave", ""): pytest.approx(-0.55)}


def test_temperatures_are_of_the_sea_or_the_outside_air_only() -> None:
    sea = _read(130312, "BBBHHB", NA, 0, 0, 28_815, 0xFFFF, NA)
    engine = _read(130312, "BBBHHB", NA, 0, 3, 36_315, 0xFFFF, NA)
    assert sea == {("water_temperature", ""): pytest.approx(15.0)}
    assert engine == {}
    read = _read(130311, "BBHhH", NA, 0x41, 29_315, 15_000, 1013)
    assert read["air_temperature", "environment"] == pytest.approx(20.0)
    assert read["humidity", "environment"] == pytest.approx(0.6)
    assert read["air_pressure", "environment"] == pytest.approx(101_300)
    assert _read(130314, "BBBiB", NA, 0, 0, 1_013_250, NA) == {
        ("air_pressure", ""): pytest.approx(101_325.0)
    }


@pytest.mark.parametrize("pgn", sorted(READINGS))
@pytest.mark.parametrize("length", range(9))
def test_a_message_cut_short_has_no_value_behind_its_end(pgn: int, length: int) -> None:
    values = fields(pgn, bytes(length))
    readings = READINGS[pgn](values) if values else []
    assert length or not any(reading.value is not None for reading in readings)
