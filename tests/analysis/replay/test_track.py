from dataclasses import replace

import numpy as np
import pytest

from analysis.replay.track import Track, Tracker
from recorders.simulated.simulate import SimulatedTrial
from shiplog import Channel, Signals, TrialLog, resample
from shiplog.checks.log_stats import compute_log_stats
from shiplog.geodesy.ellipsoid import chord, geodesic
from shiplog.resampling import Clock


def tracked(
    log: TrialLog, signals: Signals, yaw_rate: np.ndarray, speed: np.ndarray
) -> tuple[Track, str]:
    found = compute_log_stats(log)
    channels = {name: found[name] for name in signals.values if name in found}
    clock = Clock(signals.start_ns, signals.dt_secs, len(signals), channels)
    tracking = Tracker(clock, found.get("position"))
    tracking.add_raw(log.channels)
    return tracking.step(signals, yaw_rate, speed), tracking.origin


def test_recorded_positions_are_the_track(zigzag: SimulatedTrial, zigzag_log: TrialLog) -> None:
    signals = resample(zigzag_log, channels=("yaw_rate", "heading"))
    track, origin = tracked(zigzag_log, signals, signals["yaw_rate"], signals["yaw_rate"])
    assert origin == "recorded positions"
    truth = zigzag.trajectory.at(np.arange(501.0))["position"]
    assert np.column_stack((track.north, track.east)) == pytest.approx(truth, abs=1e-6)


def test_without_positions_the_track_is_dead_reckoned(zigzag: SimulatedTrial) -> None:
    channels = tuple(c for c in zigzag.channels if c.name != "position")
    for missing, by in ((), "heading"), (("heading",), "yaw rate"):
        log = TrialLog("x", tuple(c for c in channels if c.name not in missing))
        names = ("yaw_rate", "rudder", *(() if missing else ("heading",)))
        signals = resample(log, channels=names)
        truth = zigzag.trajectory.at(signals.time_secs)
        track, origin = tracked(log, signals, truth["yaw_rate"], truth["speed"])
        assert by in origin
        away = np.hypot(track.north - truth["position"][:, 0], track.east - truth["position"][:, 1])
        assert away.max() < 5  # m, of four kilometres


def test_the_yaw_rate_bridges_a_gap_of_the_compass(zigzag: SimulatedTrial) -> None:
    log = TrialLog("x", tuple(c for c in zigzag.channels if c.name != "position"))
    signals = resample(log, channels=("yaw_rate", "rudder", "heading"))
    truth = zigzag.trajectory.at(signals.time_secs)
    for silent in (slice(0, 2000), slice(1000, 4000), slice(2500, None), slice(None)):
        heading = signals["heading"].copy()
        heading[silent] = np.nan
        partly = Signals(0, signals.dt_secs, dict(signals.values) | {"heading": heading})
        track, _ = tracked(log, partly, truth["yaw_rate"], truth["speed"])
        away = np.hypot(track.north - truth["position"][:, 0], track.east - truth["position"][:, 1])
        assert away.max() < 10


def test_positions_that_were_never_measured_are_no_track(zigzag_log: TrialLog) -> None:
    blank = tuple(
        replace(c, values=c.values * np.nan) if c.name == "position" else c for c in zigzag_log
    )
    signals = resample(zigzag_log, channels=("yaw_rate", "heading"))
    rate = signals["yaw_rate"]
    _, origin = tracked(TrialLog("x", blank), signals, rate, np.full(len(rate), 8.0))
    assert "dead reckoning" in origin


def test_positions_on_the_globe_become_metres() -> None:
    stamps = np.arange(3) * 10**9
    values = np.array([[60.0, 10.0, 0.0], [60.001, 10.0, 0.0], [60.001, 10.002, 0.0]])
    fix = Channel(
        "position", "gnss", "deg", stamps, stamps, values, ("latitude", "longitude", "altitude")
    )
    signals = Signals(0, 1.0, {"yaw_rate": np.zeros(3)})
    track, _ = tracked(TrialLog("x", (fix,)), signals, np.zeros(3), np.zeros(3))
    arc, _ = geodesic(60.0, 10.0, np.array([60.001]), np.array([10.0]))
    parallel = chord(values[1:2, 0], values[1:2, 1], values[2:, 0], values[2:, 1])
    assert track.north == pytest.approx([0, arc[0], arc[0]], abs=0.01)
    assert track.east == pytest.approx([0, 0, parallel[0]], abs=0.01)


def test_after_a_long_compass_gap_the_yaw_rate_is_integrated_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And no more instants than that gap are held."""
    monkeypatch.setattr("analysis.replay.track.MAX_COMPASS_GAP", 100)
    count = 1000
    heading = np.full(count, np.nan)
    heading[[10, 60, 700]] = 0.0, 0.5, 2.0
    signals = Signals(0, 1.0, {"yaw_rate": np.zeros(count), "heading": heading})
    stamps = np.arange(count) * 10**9
    compass = Channel("heading", "a", "rad", stamps, stamps, heading)
    channels = {"heading": compute_log_stats(TrialLog("x", (compass,)))["heading"]}
    tracks = {}
    for size in (1, 50, count):
        tracking = Tracker(Clock(0, 1.0, count, channels), None)
        held, parts = 0, []
        for start in range(0, count, size):
            part = signals.part(start, start + size)
            track = tracking.step(part, np.zeros(len(part)), np.ones(len(part)))
            parts.append(track)
            held = max(held, start + len(part) - sum(len(p.north) for p in parts))
        assert held <= 101 or size == count
        tracks[size] = np.concatenate([np.column_stack((p.north, p.east)) for p in parts])
    steps = np.diff(tracks[1], axis=0)
    sailed = np.arctan2(steps[:, 1], steps[:, 0])
    assert sailed[[5, 34, 650, 900]] == pytest.approx([0.0, 0.25, 0.5, 2.0], abs=0.01)
    for size in (50, count):
        assert np.array_equal(tracks[1], tracks[size])
