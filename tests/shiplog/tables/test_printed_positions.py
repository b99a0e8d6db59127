"""Printed positions: degrees and minutes, hemispheres and signs."""

import numpy as np
import pytest

from shiplog.tables.printed_positions import PositionTextError, looks_packed, parse_degrees

FORMS = ["5412.345N", "54 12.345 N", "54°12.345'N", "54°12'20.7\"N", "N 54 12.345", "54.20575"]


@pytest.mark.parametrize("text", [*FORMS, "n54.20575"])
def test_one_latitude_in_many_forms(text: str) -> None:
    packed = looks_packed([text], "latitude")
    assert parse_degrees([text], "latitude", None, packed=packed) == pytest.approx(54.20575)


def test_south_and_west_are_negative() -> None:
    assert parse_degrees(["00030.0W"], "longitude", None, packed=True).tolist() == [-0.5]
    assert parse_degrees(["3330"], "latitude", ["S"], packed=True).tolist() == [-33.5]
    assert parse_degrees(["-33.5", ""], "latitude", None, packed=False)[0] == -33.5


def test_small_numbers_with_an_exponent_are_degrees() -> None:
    texts = ["-8.128766703e-05", "2e-5", "1.5E+01"]
    values = parse_degrees(texts, "latitude", None, packed=False)
    assert values.tolist() == [-8.128766703e-05, 2e-5, 15.0]


def test_an_empty_cell_is_not_measured() -> None:
    values = parse_degrees(["", "1"], "latitude", None, packed=False)
    assert np.isnan(values).tolist() == [True, False]


def test_degrees_and_minutes_without_a_hemisphere_are_refused_with_the_remedy() -> None:
    with pytest.raises(PositionTextError, match=r"ddmm\.mmmm"):
        parse_degrees(["5412.345"] * 3, "latitude", None, packed=False)


def test_a_missing_fix_is_no_sign_of_degrees_and_minutes() -> None:
    assert parse_degrees(["91", "54", "54"], "latitude", None, packed=False)[0] == 91


@pytest.mark.parametrize("text", ["54E", "-54N", "5475.0N", "N54S", "x", "54 75 N"])
def test_a_contradiction_is_refused(text: str) -> None:
    with pytest.raises(PositionTextError):
        parse_degrees([text], "latitude", None, packed=looks_packed([text], "latitude"))
