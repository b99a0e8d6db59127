"""Tests of recorders.streams.stream_options, with the options of the format of numbers."""

import pytest
from number_format import NUMBERS

from recorders.streams.stream_options import options_text, parse_options, parse_options_text
from shiplog.errors import UsageError


def test_keys_and_values_are_parsed_as_options() -> None:
    options = parse_options(NUMBERS, {"start": 5.5, "fast": True}, "source 'a'")
    assert (options.start, options.step, options.fast) == (5.5, 0.1, True)


def test_a_false_flag_is_not_given() -> None:
    assert not parse_options(NUMBERS, {"fast": False}, "source 'a'").fast


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"strat": 5.5}, "source 'a': unknown key 'strat'.*did you mean 'start'"),
        ({"start": "noon"}, "source 'a': .*invalid float value: 'noon'"),
        ({"fast": "yes"}, "source 'a': .*ignored explicit argument"),
    ],
)
def test_a_wrong_option_is_a_usage_error(given: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_options(NUMBERS, given, "source 'a'")


def test_the_text_of_options_gives_the_same_options_again() -> None:
    options = parse_options(NUMBERS, {"start": -5.5, "fast": True}, "a")
    text = options_text(NUMBERS, options)
    assert text == "--start=-5.5 --fast"
    assert parse_options_text(NUMBERS, text, "a") == options


def test_default_options_have_no_text() -> None:
    assert options_text(NUMBERS, parse_options(NUMBERS, {}, "a")) == ""


def test_a_text_of_other_options_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match=r"options of a: unrecognized arguments: --other"):
        parse_options_text(NUMBERS, "--other", "options of a")
