"""Tests of recorders.trial.trial_file: what it holds, and all faults at once."""

from pathlib import Path

import pytest

from recorders.trial.trial_file import load_trial_file
from shiplog.errors import UsageError

pytestmark = pytest.mark.usefixtures("numbers")

FULL = """
[output]
file = "trial.mcap"
rotate_minutes = 60
flush_secs = 0.5
[vessel]
file = "table1"
[conditions]
draught_forward = 8.0
draught_aft = 8.5
loading = "ballast"
beaufort = 3
[[source]]
name = "gyro"
format = "numbers"
address = "udp://127.0.0.1:10110"
[[source]]
name = "log-1"
format = "numbers"
address = "log.txt"
raw = true
start = 5.5
fast = true
"""


def _load(text: str):  # noqa: ANN202 - of the function under test
    Path("trial.toml").write_text(text, encoding="utf-8")
    return load_trial_file("trial.toml")


def test_a_trial_file_has_sources_conditions_vessel_and_output() -> None:
    trial = _load(FULL)
    assert [(s.name, s.address, s.keep_raw) for s in trial.sources] == [
        ("gyro", "udp://127.0.0.1:10110", None),
        ("log-1", "log.txt", True),
    ]
    assert trial.sources[1].options.start == 5.5
    assert trial.sources[1].options.fast
    assert not trial.sources[0].options.fast
    assert trial.output == Path("trial.mcap")
    assert trial.rotate_minutes == 60.0
    assert trial.rotate_megabytes is None
    assert (trial.flush_secs, trial.fsync_secs) == (0.5, None)
    assert trial.vessel == "table1"
    assert dict(trial.conditions) == {
        "draught_forward": 8.0,
        "draught_aft": 8.5,
        "loading": "ballast",
        "beaufort": 3,
    }


def test_the_smallest_trial_file_is_one_source() -> None:
    trial = _load('[[source]]\nname = "a"\nformat = "numbers"\naddress = "tcp://127.0.0.1:1"\n')
    assert trial.output is None
    assert trial.vessel is None


def test_all_faults_are_reported_at_once_with_the_nearest_names() -> None:
    text = """
    [outputs]
    file = "x.mcap"
    [conditions]
    draft_aft = 8.5
    beaufort = 17
    loading = 3
    [vessel]
    [[source]]
    name = "a b"
    format = "nubmers"
    address = "udp://127.0.0.1:1"
    [[source]]
    format = "numbers"
    raw = "yes"
    strat = 3
    [[source]]
    name = "c"
    format = "numbers"
    address = "c.txt"
    start = "noon"
    [[source]]
    name = "c"
    format = "numbers"
    address = "d.txt"
    [[source]]
    name = "e"
    format = "numbers"
    address = "udp://127.0.0.1"
    """
    with pytest.raises(UsageError) as caught:
        _load(text)
    message = str(caught.value)
    assert "\n" not in message
    for expected in (
        "unknown key 'outputs'; did you mean 'output'",
        "unknown key 'draft_aft' in [conditions]; did you mean 'draught_aft'",
        "conditions.beaufort must be a number from 0 to 12",
        "conditions.loading must be a text in one line",
        "source 1.name may have letters",
        "no format 'nubmers'; did you mean 'numbers'",
        "source 2.name must be a text",
        "source 2.address must be a text",
        "source 2.raw must be true or false",
        "source 2: unknown key 'strat'; did you mean 'start'",
        "source 'e': host or port is missing",
        "source 'c': argument --start: invalid float value: 'noon'",
        "trial.toml",
    ):
        assert expected.replace("; did", ", did") in message.replace("; did", ", did"), message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"at least one \[\[source\]\] is needed"),
        ("source = 1", r"at least one \[\[source\]\] is needed"),
        ("source = [1]", r"source 1 must be a section \[\[source\]\]"),
        ("[output", "not a TOML file"),
        ("output = 1", r"\[output\] must be a section"),
        ("[output]\nrotate_minutes = -1", "rotate_minutes must be a positive number"),
        ("[output]\nrotate_minutes = true", "rotate_minutes must be a positive number"),
        ("[output]\nfsync_secs = 0", "fsync_secs must be a positive number"),
        ("[output]\nrotate_megabytes = inf", "rotate_megabytes must be a positive number"),
        ("[conditions]\nwater_depth = nan", "water_depth must be a number from 0 to 12000 m"),
        ('[conditions]\nplace = "a\\u001bb"', "place must be a text in one line"),
        (
            "[conditions]\ntrim = 0.5\ndraught_aft = 8\ndraught_forward = 8.5",
            "trim 0.5 m contradicts the draughts, whose difference aft minus forward is -0.5 m",
        ),
        (
            '[[source]]\nname = "operator"\nformat = "numbers"\naddress = "a.txt"',
            "source 1.name 'operator' is that of events",
        ),
        ("[vessel]\nfile = 1", "vessel.file must be a text"),
        ("a" * 1_000_001, "too long for a trial file"),
    ],
)
def test_a_wrong_trial_file_is_a_usage_error(text: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        _load(text)


def test_two_sources_of_one_name_are_refused() -> None:
    source = '[[source]]\nname = "a"\nformat = "numbers"\naddress = "x"\n'
    with pytest.raises(UsageError, match="two sources are named 'a'"):
        _load(2 * source)


def test_a_missing_trial_file_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="cannot read the trial file"):
        load_trial_file("none.toml")
