"""Tests of recorders.nmea0183.environment_sentences; the expected values are computed by hand."""

from math import isnan, radians

import pytest
from sentences import decoded

KN = 1852 / 3600


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (
            "IIMWV,142.0,R,006.1,N,A",
            {"/apparent_wind_angle/II": radians(142), "/apparent_wind_speed/II": 6.1 * KN},
        ),
        (
            "02MWV,327.6,R,36,K",
            {"/apparent_wind_angle/02": radians(327.6), "/apparent_wind_speed/02": 10.0},
        ),
        (
            "IIMWV,313,T,08.16,M,A",
            {"/true_wind_angle/II": radians(313), "/wind_speed/II.MWV": 8.16},
        ),
        ("IIMWV,,T,100,S,A", {"/wind_speed/II.MWV": 44.704}),  # statute miles per hour
        ("IIMWV,,,,,V", {}),
        (
            "IIVWR,039,L,08.10,N,04.17,M,,",
            {"/apparent_wind_angle/II.VWR": radians(-39), "/apparent_wind_speed/II.VWR": 8.1 * KN},
        ),
        (
            "IIVWT,039,L,08.10,N,04.17,M,,",
            {"/true_wind_angle/II.VWT": radians(-39), "/wind_speed/II.VWT": 8.1 * KN},
        ),
        (
            "WIMWD,302.0,T,290.0,M,,N,7.5,M",
            {"/wind_direction/WI": radians(302), "/wind_speed/WI": 7.5},
        ),
        ("IIDBT,034.25,f,010.44,M,005.64,F", {"/depth/II.below_transducer": 10.44}),
        ("IIDBT,10.0,f,,M,,F", {"/depth/II.below_transducer": 3.048}),
        ("23DBS,01.9,f,0.58,M,00.3,F", {"/depth/23": 0.58}),
        ("SDDBK,,f,,M,10.0,F", {"/depth/SD.below_keel": 18.288}),
        ("SDDPT,10.0,1.5,100", {"/depth/SD": 11.5}),
        ("SDDPT,10.0,-2.0,100", {"/depth/SD.below_keel": 8.0}),
        ("SDDPT,10.0,,100", {"/depth/SD.below_transducer": 10.0}),
        ("WIMTW,7.66,C", {"/water_temperature/WI": 7.66}),
    ],
)
def test_a_sentence_has_these_values(body: str, expected: dict[str, float]) -> None:
    values = {topic: value for topic, [value] in decoded(body).items()}
    assert values == pytest.approx(expected, abs=1e-12)


def test_an_invalid_wind_is_not_measured() -> None:
    values = decoded("IIMWV,142.0,R,006.1,N,V")
    assert len(values) == 2
    assert all(isinstance(value, float) and isnan(value) for [value] in values.values())
