"""Tests of recorders.nmea0183.transducer_sentences; the expected values are computed by hand."""

from math import isnan, radians

import pytest
from sentences import decoded


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (
            "YXXDR,A,0.19,D,Pitch,A,-0.34,D,Roll",
            {"/pitch/YX": radians(0.19), "/roll/YX": radians(-0.34)},
        ),
        (
            "IIXDR,A,5.5,D,PTCH,A,-12.0,D,ROLL",
            {"/pitch/II": radians(5.5), "/roll/II": radians(-12)},
        ),
        ("IIXDR,A,3.0,D,HEEL", {"/heel/II": radians(3)}),
        ("YXXDR,D,0.19,M,Heave", {"/heave/YX": 0.19}),
        ("WIXDR,C,008.0,C,,", {"/air_temperature/WI": 8.0}),
        ("IIXDR,C,19.52,C,TempAir", {"/air_temperature/II": 19.52}),
        ("IIXDR,C,288.15,K,WaterTemp", {"/water_temperature/II": 15.0}),
        ("WIXDR,C,50.0,F,", {"/air_temperature/WI": 10.0}),
        ("IIXDR,P,1.02481,B,Barometer", {"/air_pressure/II": 102481.0}),
        ("WIXDR,P,101325,P,", {"/air_pressure/WI": 101325.0}),
        ("IIXDR,H,47.5,P,HUMIDITY", {"/humidity/II": 0.475}),
        ("IIXDR,C,90.0,C,EngineOil", {}),
        ("IIXDR,C,90.0,C,", {}),
        ("IIXDR,P,2.5,B,EngineOil", {}),
        ("IIXDR,A,,D,Roll", {}),
        ("IIXDR,A", {}),
        # Seapath: roll with port up, heave downwards
        (
            "PSXN,23,0.35,-1.74,218.26,0.58",
            {
                "/roll/PSXN": radians(0.35),
                "/pitch/PSXN": radians(-1.74),
                "/heading/PSXN": radians(218.26),
                "/heave/PSXN": -0.58,
            },
        ),
        ("PSXN,22,0.03,-0.80", {}),
    ],
)
def test_a_sentence_has_these_values(body: str, expected: dict[str, float]) -> None:
    values = {topic: value for topic, [value] in decoded(body).items()}
    assert values == pytest.approx(expected, rel=1e-9)


def test_the_quality_of_a_motion_unit_applies_to_what_follows() -> None:
    motion = "PSXN,23,0.35,-1.74,218.26,0.58"
    values = decoded("PSXN,20,1,0,0,2", motion, "PSXN,20,1,0,2,1", motion)
    assert [isnan(value) for value in values["/roll/PSXN"]] == [True, False]
    assert [isnan(value) for value in values["/heave/PSXN"]] == [True, False]
    assert [isnan(value) for value in values["/heading/PSXN"]] == [False, True]
