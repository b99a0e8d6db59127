"""Texts of options as values."""

import pytest

from shiplog.cli.options import assigned_numbers, assigned_texts
from shiplog.errors import UsageError


def test_assignments_are_names_with_values() -> None:
    assert assigned_numbers(["T3=0.5", "a=-1e-3"], "--fix", "T3=0.5") == {"T3": 0.5, "a": -1e-3}
    assert assigned_texts(["speed=doppler"], "--source", "speed=log") == {"speed": "doppler"}


@pytest.mark.parametrize("text", ["T3", "T3=", "T3=half", "=x", "a=b=c"])
def test_other_texts_are_rejected_with_the_option_and_an_example(text: str) -> None:
    with pytest.raises(UsageError, match=r"--fix takes NAME=\w+, such as T3=0\.5, not"):
        assigned_numbers([text], "--fix", "T3=0.5")


@pytest.mark.parametrize("text", ["speed", "speed=", "=log", "a=b=c"])
def test_other_pairs_are_rejected_with_the_option_and_an_example(text: str) -> None:
    with pytest.raises(UsageError, match="--source takes NAME=VALUE, such as speed=log"):
        assigned_texts([text], "--source", "speed=log")
