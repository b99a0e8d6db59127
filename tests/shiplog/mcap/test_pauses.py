"""Tests of pauses of all channels: found alike however a log is cut, and judged by the motion."""

from collections.abc import Sequence

import numpy as np
import pytest

from shiplog import Channel
from shiplog.mcap.pauses import Pauses
from shiplog.units import GEOGRAPHIC

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
SPEED = 6.0  # m/s


def trial(
    gap_secs: float, passed_secs: float, turn_rate: float = 0.0, *, geographic: bool = False
) -> list[Channel]:
    """Return 200 s of a ship under way, with a gap of the clock in which some time passed."""
    channels = []
    for name, unit, interval in (
        ("position", "deg" if geographic else "m", 1.0), ("heading", "rad", 0.1),
        ("yaw_rate", "rad/s", 0.1), ("speed", "m/s", 0.2),
    ):  # fmt: skip
        clock = np.arange(0.0, 200.0, interval)
        true = clock + np.where(clock >= 100.0, passed_secs, 0.0)
        times = START + ((clock + np.where(clock >= 100.0, gap_secs, 0.0)) * SECOND).astype(int)
        heading = turn_rate * true
        north = SPEED * true if not turn_rate else SPEED / turn_rate * np.sin(heading)
        east = 0 * true if not turn_rate else SPEED / turn_rate * (1 - np.cos(heading))
        values, fields = {
            "position": (np.column_stack([north, east]), ("north", "east")),
            "heading": (heading, ()),
            "yaw_rate": (np.full(len(true), turn_rate), ()),
            "speed": (np.full(len(true), SPEED), ()),
        }[name]
        if geographic and name == "position":
            degrees = 60 + north / 111_412, 20 + east / 55_800, np.full(len(north), np.nan)
            values, fields = np.column_stack(degrees), GEOGRAPHIC
        channels.append(Channel(name, "test", unit, times, times, values, fields))
    return channels


def warnings_of(channels: Sequence[Channel]) -> list[str]:
    pauses = Pauses()
    pauses.add(channels)
    return pauses.warnings()


@pytest.mark.parametrize("geographic", [False, True])
def test_a_gap_in_which_the_ship_did_not_move_is_a_clock_set_forward(*, geographic: bool) -> None:
    (warning,) = warnings_of(trial(3600.0, 0.0, geographic=geographic))
    assert warning.startswith("times: all channels have no samples for 3600.0 s, 99.9 s after")
    assert "clock of the recorder was probably set forward, a whole number of hours" in warning
    assert "less likely it paused" in warning


@pytest.mark.parametrize("geographic", [False, True])
def test_a_gap_in_which_the_ship_went_on_is_a_pause(*, geographic: bool) -> None:
    (warning,) = warnings_of(trial(90.0, 90.0, geographic=geographic))
    assert "the recorder paused, as the ship moved 546 m meanwhile" in warning
    assert "forward" not in warning


@pytest.mark.parametrize("case", ["no fixes", "frozen fix", "circle", "no fix after", "at rest"])
def test_a_gap_that_the_motion_does_not_explain_has_both_causes(case: str) -> None:
    channels = trial(600.0, 600.0, 2 * np.pi / 620 if case == "circle" else 0.0)
    position = channels[0]
    if case == "no fixes":
        channels = channels[1:]
    elif case == "frozen fix":
        values = np.broadcast_to(position.values[0], position.values.shape)
        channels[0] = Channel("position", "test", "m", position.measured_ns, position.received_ns,
                              values, position.fields)  # fmt: skip
    elif case == "no fix after":
        channels[0] = position.part(0, 100)
    elif case == "at rest":
        speed = channels[3]
        channels[3] = Channel("speed", "test", "m/s", speed.measured_ns, speed.received_ns,
                              np.zeros(len(speed)))  # fmt: skip
    (warning,) = warnings_of(channels)
    assert "the recorder paused, or its clock was set forward: times were not changed" in warning


def test_a_slow_channel_hides_no_pause_of_an_hour() -> None:
    channels = trial(3600.0, 0.0)[1:]
    at = START + np.concatenate([np.arange(-20, 1), np.arange(7, 12)]) * 600 * SECOND
    channels.append(Channel("draught", "test", "m", at, at, np.ones(len(at))))
    assert len(warnings_of(channels)) == 1


def test_a_sample_of_any_channel_within_the_gap_shows_that_the_recorder_went_on() -> None:
    channels = trial(20.0, 20.0)
    at = START + np.arange(0, 220, 7) * SECOND
    assert warnings_of([*channels, Channel("depth", "test", "m", at, at, np.ones(len(at)))]) == []


@pytest.mark.parametrize("count", [2, 7, 50])
def test_pauses_are_the_same_however_the_log_is_cut(count: int) -> None:
    channels = trial(3600.0, 0.0)
    for late in trial(90.0, 90.0):
        shift = 4000 * SECOND
        channels = [
            Channel(c.name, c.source, c.unit, *(np.concatenate([a, b + shift]) for a, b in (
                (c.measured_ns, late.measured_ns), (c.received_ns, late.received_ns))),
                np.concatenate([c.values, late.values]), c.fields) if c.name == late.name else c
            for c in channels
        ]  # fmt: skip
    expected = warnings_of(channels)
    assert len(expected) == 3
    last = max(int(c.received_ns[-1]) for c in channels)
    bounds = np.linspace(START, last, count + 1).astype(np.int64)[1:-1]
    near = [START + 100 * SECOND, START + 100 * SECOND + 1, START + 3700 * SECOND]
    for edges in (bounds, np.array(near)):
        pauses = Pauses()
        rows = [[0, *np.searchsorted(c.received_ns, edges), len(c)] for c in channels]
        for part in range(len(edges) + 1):
            pauses.add([c.part(r[part], r[part + 1]) for c, r in zip(channels, rows, strict=True)])
        assert pauses.warnings() == expected


def test_a_log_of_rare_samples_has_no_pauses() -> None:
    at = START + np.arange(5000) * 60 * SECOND
    channels = [Channel(name, "test", "m/s", at, at, np.ones(5000)) for name in ("speed", "sway")]
    assert warnings_of(channels) == []
