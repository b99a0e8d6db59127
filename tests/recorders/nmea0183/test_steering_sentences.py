"""Tests of recorders.nmea0183.steering_sentences; the expected values are computed by hand."""

from math import isnan, radians

import pytest
from sentences import decoded, sentence

from recorders.nmea0183.sentence_decoder import SentenceDecoder
from recorders.streams.packets import Packet
from recorders.streams.sample_buffer import SampleBuffer

KN = 1852 / 3600


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        # 6 deg/min is 0.1 deg/s; negative is to port
        ("TIROT,-6.0,A", {"/yaw_rate/TI": -radians(0.1)}),
        ("TIROT,35.6", {"/yaw_rate/TI": radians(35.6 / 60)}),
        ("HEROT,,A", {}),
        # one rudder, and two
        ("AGRSA,1.26,A,,V", {"/rudder/AG": radians(1.26)}),
        (
            "IIRSA,10.5,A,-0.4,A",
            {"/rudder/II": radians(10.5), "/rudder/II.port": radians(-0.4)},
        ),
        (
            "AGROR,-5.0,A,-5.0,A,B",
            {"/rudder_order/AG": radians(-5), "/rudder_order/AG.port": radians(-5)},
        ),
        ("AGHTC,V,20.0,L,M,,,,,,,,T", {"/rudder_order/AG": radians(-20)}),
        ("AGHTD,V,5.0,R,M,,,,,,,,T,A,A,A,1", {"/rudder_order/AG": radians(5)}),
        ("AGHTC,V,,,M,,,,,,,,T", {}),
        # the example of pynmea2's tests: engine 2, 1500 1/min; and a shaft astern
        ("ECRPM,E,2,1500.0,50,A", {"/rpm/EC.engine2": 1500.0, "/propeller_pitch/EC.engine2": 0.5}),
        ("RCRPM,S,0,-71.5,,A", {"/rpm/RC.shaft0": -71.5}),
        (
            "VWVHW,205.5,T,203.0,M,6.11,N,11.31,K",
            {
                "/heading/VW.VHW": radians(205.5),
                "/magnetic_heading/VW.VHW": radians(203),
                "/speed/VW": 6.11 * KN,
            },
        ),
        ("VWVHW,,T,,M,,N,18.0,K", {"/speed/VW": 5.0}),
        (
            "VDVBW,12.3,-0.5,A,12.0,-0.9,A,,V,,V",
            {
                "/speed/VD.VBW": 12.3 * KN,
                "/sway/VD.VBW": -0.5 * KN,
                "/speed_over_ground/VD.VBW": (12.0**2 + 0.9**2) ** 0.5 * KN,
            },
        ),
        ("VDVBW,0.00,,A,,,A,,A,,A", {"/speed/VD.VBW": 0.0}),
        ("HEHDT,218.53,T", {"/heading/HE": radians(218.53)}),
        ("IIHDT,,T", {}),
        ("HETHS,77.52,A", {"/heading/HE": radians(77.52)}),
        ("HETHS,77.52,E", {"/heading/HE": radians(77.52)}),
        # Signal K's example of HDG: deviation and variation
        (
            "INHDG,180,5,W,10,W",
            {
                "/magnetic_heading/IN": radians(175),
                "/magnetic_variation/IN": radians(-10),
                "/heading/IN.HDG": radians(165),
            },
        ),
        ("HCHDG,207.00,,,,", {"/magnetic_heading/HC": radians(207)}),
        (
            "HCHDG,359.80,,,0.55,E",
            {
                "/magnetic_heading/HC": radians(359.8),
                "/magnetic_variation/HC": radians(0.55),
                "/heading/HC.HDG": radians(0.35),
            },
        ),
        ("04HDM,186.5,M", {"/magnetic_heading/04.HDM": radians(186.5)}),
    ],
)
def test_a_sentence_has_these_values(body: str, expected: dict[str, float]) -> None:
    values = {topic: value for topic, [value] in decoded(body).items()}
    assert values == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("body", "topics"),
    [
        ("TIROT,35.6,V", ["/yaw_rate/TI"]),
        ("TIROT,35.6,X", ["/yaw_rate/TI"]),
        ("AGRSA,1.26,V,,V", ["/rudder/AG"]),
        ("ECRPM,E,1,1500.0,50,V", ["/rpm/EC.engine1", "/propeller_pitch/EC.engine1"]),
        ("VDVBW,12.3,-0.5,V,,,V", ["/speed/VD.VBW", "/sway/VD.VBW"]),
        ("HETHS,77.52,M", ["/heading/HE"]),
        ("HETHS,77.52,S", ["/heading/HE"]),
        ("HETHS,77.52,V", ["/heading/HE"]),
    ],
)
def test_values_that_the_sender_marks_as_invalid_are_not_measured(
    body: str, topics: list[str]
) -> None:
    values = decoded(body)
    assert list(values) == topics
    assert all(isinstance(value, float) and isnan(value) for [value] in values.values())


@pytest.mark.parametrize(
    "body",
    [
        "TIROT,abc,A",
        "TIROT,nan,A",
        "TIROT,inf,A",
        "TIROT,1e999,A",
        "TIROT,1_0,A",
        "ECRPM,X,1,1500.0,50,A",
        "ECRPM,E,../1,1500.0,50,A",
        "ECRPM,E,99999,1500.0,50,A",
        "AGHTC,V,20.0,,M",
        "HCHDG,207.00,,,0.55,N",
    ],
)
def test_malformed_fields_are_rejected_and_give_no_value(body: str) -> None:
    decoder, samples = SentenceDecoder(), SampleBuffer()
    decoder.decode([Packet(sentence(body), 0)], samples)
    assert samples.take() == ()
    assert decoder.counts.rejected == {f"malformed field of {body[2:5]}": 1}
