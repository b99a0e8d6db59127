from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from shiplog import Channel, LogFile, TrialLog, UsageError, open_log, write
from shiplog.types import concatenate_channels, is_sorted

SEC = 10**9
MIDNIGHT = 1_777_593_600  # s of 2026-05-01T00:00:00Z
Opener = Callable[[int, int], TrialLog | LogFile]


@pytest.fixture(params=["memory", "file"])
def opened(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Opener:
    """Make a log of one sample a second, in memory or in its file, from its start and duration."""

    def make(start_secs: int, duration_secs: int) -> TrialLog | LogFile:
        times = (start_secs + np.arange(duration_secs + 1)) * SEC
        ramp = np.arange(len(times)) * 1.0
        channels = (
            Channel("speed", "log", "m/s", times, times, ramp),
            Channel("rpm", "shaft", "rpm", times[::10], times[::10], ramp[::10]),
        )
        log = TrialLog("run.mcap", channels)
        if request.param == "memory":
            return log
        write(log, tmp_path / "run.mcap")
        monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 5)
        monkeypatch.setattr("shiplog.mcap.stream.FILE_CHUNK_SAMPLES", 7)
        return open_log(tmp_path / "run.mcap")

    return make


def seconds(log: TrialLog | LogFile) -> list[int]:
    """Return the first and the last value of the speed, which are the log's seconds."""
    values = np.concatenate([chunk[0].values for chunk in log.chunks()])
    assert np.all(np.diff(values) == 1)
    return [int(values[0]), int(values[-1])]


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        (None, None, [0, 600]),
        (120, None, [120, 600]),
        (None, 120, [0, 119]),
        (120, 560, [120, 559]),
        (120.5, 121.5, [121, 121]),
        (-30, None, [570, 600]),
        (None, -30, [0, 569]),
        (-60, -30, [540, 569]),
        ("00:02:00", "00:03", [120, 179]),
        ("02:02:00+02:00", None, [120, 600]),
        ("2026-05-01T00:02:00Z", "2026-05-01 00:03:00", [120, 179]),
        ("2026-04-30T22:02:00-02:00", -1, [120, 598]),
        ("2026-05-01", 10, [0, 9]),
        ("30", "-30", [30, 569]),
        (0, 1e6, [0, 600]),
    ],
)
def test_a_log_is_cut_at_relative_and_absolute_times(
    opened: Opener, start: float | str | None, end: float | str | None, expected: list[int]
) -> None:
    assert seconds(opened(MIDNIGHT, 600).between(start, end)) == expected


def test_the_bounds_are_in_the_name_and_the_metadata(opened: Opener) -> None:
    part = opened(MIDNIGHT, 600).between(120, -30)
    assert part.name == "run.mcap (120 to 570 s)"
    assert part.metadata["cut"] == (
        "2026-05-01T00:02:00Z to 2026-05-01T00:09:30Z of run.mcap, "
        "600.0 s, from 2026-05-01T00:00:00Z to 2026-05-01T00:10:00Z"
    )
    list(part.chunks())
    assert part.name == "run.mcap (120 to 570 s)"
    assert part.select_sources({"speed": "log"}).name == part.name


def test_a_part_is_cut_again_relative_to_its_own_start(opened: Opener) -> None:
    part = opened(MIDNIGHT, 600).between(120, 360).between(10, 20)
    assert seconds(part) == [130, 139]
    assert part.name == "run.mcap (120 to 360 s) (10 to 20 s)"


def test_a_time_of_day_after_midnight_is_of_the_next_day(opened: Opener) -> None:
    assert seconds(opened(MIDNIGHT - 60, 600).between("23:59:30", "00:01:00")) == [30, 119]


@pytest.mark.parametrize(
    ("start_secs", "start", "end", "expected"),
    [
        (-600, "23:55", "00:30", [300, 900]),
        (-600, "23:30", "00:02", [0, 719]),
        (300, "23:55", "00:10", [0, 299]),
        (-1200, "23:45", "00:30", [300, 900]),
    ],
)
def test_a_time_of_day_outside_of_the_log_is_that_nearest_to_it(
    opened: Opener, start_secs: int, start: str, end: str, expected: list[int]
) -> None:
    assert seconds(opened(MIDNIGHT + start_secs, 900).between(start, end)) == expected


def test_a_time_of_day_that_occurs_twice_needs_its_date(opened: Opener) -> None:
    with pytest.raises(UsageError, match=r"on 2 days of the log; add the date, such as 2026-05-01"):
        opened(MIDNIGHT - 60, 86_400 + 120).between("00:00:30")


@pytest.mark.parametrize(
    ("start", "end"),
    [(700, None), (None, 0), (200, 100), (-700, -650), ("12:00", None), (None, "2025-01-01"),
     (5.2, 5.8)],
)  # fmt: skip
def test_an_empty_cut_is_an_error_that_states_the_span(
    opened: Opener, start: float | str | None, end: float | str | None
) -> None:
    span = r"run.mcap has 600.0 s, from 2026-05-01T00:00:00Z to 2026-05-01T00:10:00Z"
    with pytest.raises(UsageError, match=span):
        opened(MIDNIGHT, 600).between(start, end)


@pytest.mark.parametrize("bound", ["soon", "12:61", "nan", "1e999", "", "2026-13-01", "1:2:3"])
def test_a_bound_that_is_no_time_is_rejected_with_examples(bound: str) -> None:
    with pytest.raises(UsageError, match=r"no time: .*12:04:30"):
        TrialLog("run.mcap", ()).between(bound)


def test_samples_out_of_order_are_cut_by_their_measured_time() -> None:
    received = np.arange(6) * SEC
    measured = np.array([0, 3, 1, 4, 2, 5]) * SEC
    channel = Channel("speed", "log", "m/s", measured, received, measured / SEC)
    part = TrialLog("run.mcap", (channel,)).between(1, 4)
    assert part["speed"].values.tolist() == [3, 1, 2]


def _inputs(log: TrialLog | LogFile) -> dict[str, list[tuple[int, float]]]:
    """Return the seconds and the values of the inputs; their times of reception are in order."""
    parts: dict[str, list[Channel]] = {}
    for chunk in log.chunks():
        for channel in chunk:
            parts.setdefault(channel.name, []).append(channel)
    whole = {name: concatenate_channels(channels) for name, channels in parts.items()}
    assert all(is_sorted(channel.received_ns) for channel in whole.values())
    return {
        name: list(zip((c.measured_ns // SEC).tolist(), c.values.tolist(), strict=True))
        for name, c in whole.items()
        if name != "speed"
    }


@pytest.fixture(params=["memory", "file"])
def on_change(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> TrialLog | LogFile:
    """Return a log whose inputs are written on change; one value is missing."""

    def channel(name: str, secs: list[int], values: list[float], unit: str) -> Channel:
        times = np.array(secs) * SEC
        return Channel(name, "bridge", unit, times, times + SEC // 10, np.array(values))

    every = list(range(301))
    log = TrialLog(
        "run.mcap",
        (
            channel("speed", every, [1.0] * 301, "m/s"),
            channel("rudder", [0, 70, 100, 150, 250], [0.1, 0.2, np.nan, -0.2, -0.1], "rad"),
            channel("rpm", [0, 300], [80.0, 80.0], "rpm"),
            channel("rudder_order", [0, 90], [0.0, 0.1], "rad"),
        ),
    )
    if request.param == "memory":
        return log
    write(log, tmp_path / "run.mcap")
    monkeypatch.setattr("shiplog.mcap.stream.MAX_SAMPLES_IN_MEMORY", 5)
    monkeypatch.setattr("shiplog.mcap.stream.FILE_CHUNK_SAMPLES", 7)
    return open_log(tmp_path / "run.mcap")


@pytest.mark.parametrize(
    ("start", "end", "rudder", "rpm"),
    [
        (120, None, [(120, 0.2), (150, -0.2), (250, -0.1)], [(120, 80.0), (300, 80.0)]),
        (120, 140, [(120, 0.2)], [(120, 80.0)]),
        (149, 200, [(150, -0.2)], [(149, 80.0)]),
        (148, 200, [(148, 0.2), (150, -0.2)], [(148, 80.0)]),
        (70, 80, [(70, 0.2)], [(70, 80.0)]),
        (270, None, [(270, -0.1)], [(270, 80.0), (300, 80.0)]),
        (None, 60, [(0, 0.1)], [(0, 80.0)]),
    ],
)
def test_an_input_written_on_change_keeps_its_value_at_the_start_of_a_cut(
    on_change: TrialLog | LogFile,
    start: float | None,
    end: float | None,
    rudder: list[tuple[int, float]],
    rpm: list[tuple[int, float]],
) -> None:
    inputs = _inputs(on_change.between(start, end))
    assert inputs["rudder"] == rudder
    assert inputs["rpm"] == rpm
    assert all(at < 100 for at, _ in inputs["rudder_order"])  # a measured value is not repeated


def test_an_input_keeps_its_value_in_a_part_that_is_cut_again(
    on_change: TrialLog | LogFile,
) -> None:
    inputs = _inputs(on_change.between(80, 290).between(20, 40))
    assert inputs["rudder"][0] == (100, 0.2)
    assert inputs["rpm"] == [(100, 80.0)]
