"""The header of a table may come from anybody: a value of a wrong type is an error of one line."""

import json

import pytest

from shiplog.errors import LogError
from shiplog.tables.table_header import read_header

CHANNEL = {"name": "yaw_rate", "source": "g", "unit": "rad/s", "fields": [], "metadata": {}}
EVENT = {"time_ns": 1, "text": "execute", "source": "operator", "level": "info"}
WRONG = (5, 1.5, None, True, [], {}, [5], {"a": 5}, "x\ud800", 10**30)


def error_of(*lines: str) -> str:
    with pytest.raises(LogError) as caught:
        read_header("a.csv", list(lines))
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 400
    assert "a.csv" in message
    return message


def test_a_vessel_that_is_no_text_is_an_error() -> None:
    assert "vessel must be a text, not 5" in error_of("vessel 5")


def test_two_channels_of_one_topic_are_an_error() -> None:
    line = f"channel {json.dumps(CHANNEL)}"
    assert "a second channel /yaw_rate/g" in error_of(line, line)


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("key", ["channel", "event"])
def test_a_value_of_a_wrong_type_is_an_error_at_each_key(key: str, wrong: object) -> None:
    entry = CHANNEL if key == "channel" else EVENT
    accepted = {"fields": [[]], "metadata": [{}], "time_ns": [5]}
    for name in entry:
        if type(wrong) is bool or wrong not in accepted.get(name, []):
            error_of(f"{key} {json.dumps(entry | {name: wrong})}")


@pytest.mark.parametrize(
    "line",
    [
        "metadata 5",
        "metadata []",
        'metadata {"a": 1}',
        "channel []",
        "event 1",
        "vessel " + "[" * 5000,
        'vessel "\\ud800"',
        "vessel",
        "",
        f"event {json.dumps(EVENT | {'time_ns': -1})}",
        f"event {json.dumps(EVENT | {'level': 'loud'})}",
        f"channel {json.dumps(CHANNEL | {'further': 1})}",
        "metadata " + "9" * 5000,
    ],
)
def test_a_line_that_is_malformed_is_an_error(line: str) -> None:
    error_of(line)
