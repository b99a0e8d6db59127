"""Tests of recorders.nmea0183.navigation_sentences; pynmea2 is the reference of the positions."""

from math import isnan, nan, radians

import pynmea2
import pytest
from sentences import decoded, sentence

from recorders.nmea0183.sentence_decoder import SentenceDecoder
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer

KN = 1852 / 3600
GGA = "INGGA,000000.16,2200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,"
GLL = "GPGLL,6005.071,N,02332.346,E,095559,A,D"
RMC = "INRMC,000000.16,A,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,W,A"
GNS = "GNGNS,014035.00,4332.69262,S,17235.48549,E,RR,13,0.9,25.63,11.24,,"  # of a receiver's manual


@pytest.mark.parametrize(
    ("body", "topic", "altitude"),
    [
        (GGA, "/position/IN", -2.76),
        (GLL, "/position/GP.GLL", nan),
        (RMC, "/position/IN.RMC", nan),
        (GNS, "/position/GN.GNS", 25.63),
    ],
)
def test_a_position_is_that_of_pynmea2(body: str, topic: str, altitude: float) -> None:
    theirs = pynmea2.parse(sentence(body).decode())
    [fix] = decoded(body, received_ns=1_406_851_200 * 10**9)[topic]
    expected = [theirs.latitude, theirs.longitude, altitude]
    assert fix == pytest.approx(expected, abs=1e-9, nan_ok=True)


def test_fix_data_have_quality_satellites_and_dilution() -> None:
    values = decoded(GGA)
    assert values["/fix_quality/IN"] == [1]
    assert values["/satellites/IN"] == [12]
    assert values["/hdop/IN"] == [0.7]


@pytest.mark.parametrize(
    ("body", "course", "speed"),
    [
        ("INVTG,215.11,T,239.79,M,9.1,N,16.9,K,A", 215.11, 9.1 * KN),
        ("IIVTG,224.44,T,224.44,M,5.81,N,,,D", 224.44, 5.81 * KN),
        ("GPVTG,10.0,T,,M,,N,36.0,K", 10.0, 10.0),
    ],
)
def test_course_and_speed_over_ground(body: str, course: float, speed: float) -> None:
    values = decoded(body)
    assert values[f"/course_over_ground/{body[:2]}"] == pytest.approx([radians(course)])
    assert values[f"/speed_over_ground/{body[:2]}"] == pytest.approx([speed])


def test_minimum_navigation_has_course_speed_and_variation_as_its_own_source() -> None:
    values = decoded(RMC, received_ns=1_406_851_200 * 10**9)
    assert values["/course_over_ground/IN.RMC"] == pytest.approx([radians(215.11)])
    assert values["/speed_over_ground/IN.RMC"] == pytest.approx([9.1 * KN])
    assert values["/magnetic_variation/IN.RMC"] == pytest.approx([radians(-24.7)])
    assert values["/gnss_time/IN.RMC"] == [1_406_851_200.16]


@pytest.mark.parametrize(
    "body",
    [
        GGA.replace("W,1,12", "W,0,12"),
        GGA.replace("W,1,12", "W,6,12"),
        GGA.replace("W,1,12", "W,8,12"),
        GLL.replace(",A,D", ",V,D"),
        GLL.replace(",A,D", ",A,E"),
        RMC.replace(".16,A,", ".16,V,"),
        RMC.replace("W,A", "W,S"),
        GNS.replace("RR", "NN"),
        "GPVTG,10.0,T,,M,5.0,N,,K,N",
    ],
)
def test_what_is_no_fix_is_not_measured(body: str) -> None:
    values = decoded(body, received_ns=1_406_851_200 * 10**9)
    for topic in values.keys() & {
        "/position/IN", "/position/GP.GLL", "/position/IN.RMC", "/position/GN.GNS",
        "/course_over_ground/GP", "/speed_over_ground/GP",
    }:  # fmt: skip
        [value] = values[topic]
        assert isnan(value[0] if isinstance(value, list) else value)
    assert not any(topic.startswith("/gnss_time") for topic in values)


def test_empty_positions_give_no_fix() -> None:
    assert decoded("GPGGA,,,,,,0,00,99.99,,,,,,").keys() == {
        "/fix_quality/GP",
        "/satellites/GP",
        "/hdop/GP",
    }


@pytest.mark.parametrize(
    "position",
    [
        "6060.000,N,02332.346,E",
        "9000.001,N,02332.346,E",
        "6005.071,N,18000.001,E",
        "6005.071,X,02332.346,E",
        "6005.071,N,02332.346,",
        "-6005.071,N,02332.346,E",
    ],
)
def test_impossible_positions_are_rejected(position: str) -> None:
    decoder, samples = SentenceDecoder(), SampleBuffer()
    decoder.decode([Packet(sentence(f"GPGLL,{position},095559,A,D"), 0)], samples)
    assert samples.take() == ()
    assert decoder.counts.rejected == {"malformed field of GLL": 1}
