"""A clock that stood still is named; the times of the other clock are used where there are any."""

from pathlib import Path

import numpy as np
import pytest
from mcap.records import Channel
from places import HOSTILE_CASES

from shiplog.cli.main import main
from shiplog.mcap.clock_repair import MessageColumns
from shiplog.mcap.contents import McapContents, SampleBlock
from shiplog.mcap.still_clocks import replace_still_times
from shiplog.mcap.times_check import TimesCheck

DATE = 1_700_000_000_000_000_000
CLOCK = DATE + np.arange(100) * 1_000_000_000
STILL = np.full(100, DATE)


def columns(topic: str, received: np.ndarray, measured: np.ndarray) -> MessageColumns:
    values = np.zeros((len(received), 1))
    return MessageColumns(topic, np.arange(len(received)), received, measured, values)


@pytest.mark.parametrize("measured", [CLOCK, np.where(np.arange(100) < 99, DATE, DATE + 1)])
def test_times_that_change_at_all_are_unchanged(measured: np.ndarray) -> None:
    original = columns("/rpm/a", STILL, measured)
    result, warnings = replace_still_times({1: original})
    assert result[1] is original
    assert warnings == []


@pytest.mark.parametrize(
    ("received", "measured"),
    [(CLOCK[:99], STILL[:99]), (DATE + np.arange(100), STILL)],
    ids=["few samples", "received within a second"],
)
def test_samples_that_may_have_come_at_once_are_of_no_still_clock(
    received: np.ndarray, measured: np.ndarray
) -> None:
    original = columns("/rpm/a", received, measured)
    assert replace_still_times({1: original}) == ({1: original}, [])


def test_times_of_measurement_that_stand_still_are_those_of_reception() -> None:
    result, (warning,) = replace_still_times({1: columns("/rpm/a", CLOCK, STILL)})
    np.testing.assert_array_equal(result[1].measured_ns, CLOCK)
    assert warning.startswith(
        "/rpm/a: all 100 samples have one time of measurement, 2023-11-14 22:13:20; "
        "their times of reception are used"
    )


def test_channels_without_any_time_are_named_in_one_warning() -> None:
    still = {1: columns("/rpm/a", STILL, STILL), 2: columns("/speed/a", STILL, STILL)}
    result, (warning,) = replace_still_times(still)
    assert result == still
    assert warning.startswith("/rpm/a, /speed/a: all samples have one time of measurement")
    assert "nothing that depends on the time can be computed" in warning


@pytest.mark.parametrize(("measured", "expected"), [(STILL, True), (CLOCK, False)])
def test_a_clock_that_stood_still_is_found_chunk_by_chunk(
    measured: np.ndarray, expected: bool
) -> None:
    contents = McapContents(channels={1: Channel(1, "/rpm/a", "protobuf", {}, 1)})
    check = TimesCheck()
    for rows in (slice(0, 6), slice(6, 100)):
        check.add({1: [SampleBlock(measured[rows], measured[rows], [], rows.start, 0)]}, contents)
    assert check.any_stood_still() is expected


def test_each_verb_warns_of_a_log_whose_times_are_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = HOSTILE_CASES / "t_all_same.mcap"
    if not path.exists():
        pytest.skip(f"no {path.name} beside the project")
    for code, arguments in (
        (0, ["info"]),
        (0, ["convert", str(tmp_path / "a.csv")]),
        (1, ["replay"]),
    ):
        assert main([arguments[0], str(path), *arguments[1:]]) == code
        assert "as of a clock that stood still; nothing" in capsys.readouterr().err
