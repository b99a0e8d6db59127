"""Tests of recorders.simulated.printed_sentences, and of the sample recording made by it."""

import argparse
import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pynmea2
import pytest

from analysis import analyse
from recorders.nmea0183.sentence_stream import NMEA0183
from recorders.record import record
from recorders.simulated.printed_sentences import DATUM, printed_sentences
from recorders.simulated.simulate import SimulatedTrial
from recorders.streams.reception_clock import ReceptionClock
from recorders.trial.open_source import StreamRequest, open_streams
from shiplog import TrialLog, read
from shiplog.geodesy.local_frame import LocalFrame
from shiplog.geodesy.positions import positions_of

SAMPLE_DATA = Path(__file__).parents[3] / "sample_data"
SAMPLE = SAMPLE_DATA / "ship.nmea"
VESSEL = SAMPLE_DATA / "vessels" / "table1.toml"
pytestmark = pytest.mark.xdist_group("printed_sentences")

# half of the last printed digit: deg/min, deg, 1/min, knots
RESOLUTION = {
    "yaw_rate": np.radians(0.05 / 60),
    "rudder": np.radians(0.05),
    "rpm": 0.05,
    "speed": 0.005 * 1852 / 3600,
    "heading": np.radians(0.005),
}


@pytest.fixture(scope="module")
def make() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_sample_data", SAMPLE_DATA / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def trial(make: ModuleType) -> SimulatedTrial:
    result: SimulatedTrial = make.ship_trial()
    return result


def _recorded(path: Path, folder: Path) -> TrialLog:
    parser = argparse.ArgumentParser()
    NMEA0183.configure(parser)
    request = StreamRequest("ship", NMEA0183, str(path), parser.parse_args([]))
    text = VESSEL.read_text(encoding="utf-8")
    record(open_streams([request], ReceptionClock(), vessel_toml=text), folder / "ship.mcap")
    return read(folder / "ship.mcap")


def test_the_sample_is_what_make_writes_and_small(make: ModuleType, tmp_path: Path) -> None:
    make.write_sentences(tmp_path / "ship.nmea")
    assert (tmp_path / "ship.nmea").read_bytes() == SAMPLE.read_bytes()
    assert SAMPLE.stat().st_size < 400_000


def test_each_sentence_is_valid_for_pynmea2_and_in_order(trial: SimulatedTrial) -> None:
    times, lines = zip(*printed_sentences(trial), strict=True)
    assert list(times) == sorted(times)
    for line in lines:
        pynmea2.parse(line, check=True)


def test_the_recorded_sample_holds_the_trial_within_the_printed_resolution(
    trial: SimulatedTrial, tmp_path: Path
) -> None:
    log = _recorded(SAMPLE, tmp_path)
    for channel in trial.channels:
        decoded = log[channel.name]
        assert len(decoded) == len(channel)
        assert np.all(np.abs(decoded.received_ns - channel.received_ns) < 1_000_000)
        if channel.name != "position":
            error = decoded.values - channel.values
            if channel.name == "heading":
                error = np.angle(np.exp(1j * error))
            assert np.max(np.abs(error)) <= RESOLUTION[channel.name] * (1 + 1e-6)
    fixes = log["position"]
    local = LocalFrame(DATUM, geographic=True).north_east(positions_of(fixes.fields, fixes.values))
    expected = next(c for c in trial.channels if c.name == "position").values
    assert np.max(np.abs(local - expected)) < 0.02


@pytest.mark.parametrize("stamped", [True, False])
def test_its_replay_agrees_with_the_true_motion(
    trial: SimulatedTrial, tmp_path: Path, stamped: bool
) -> None:
    path = SAMPLE
    if not stamped:  # as most loggers write: times then follow from the receiver's sentences
        path = tmp_path / "plain.nmea"
        lines = SAMPLE.read_bytes().splitlines(keepends=True)
        path.write_bytes(b"".join(line.partition(b" ")[2] for line in lines))
    result = analyse(_recorded(path, tmp_path))
    truth = trial.truth()
    states = result.estimates.states
    assert np.all(np.isfinite(states))
    times = result.signals.timestamps_ns
    true_rate = np.interp(times, truth["yaw_rate"].measured_ns, truth["yaw_rate"].values)
    true_speed = np.interp(times, truth["speed"].measured_ns, truth["speed"].values)
    settled = slice(len(times) // 10, None)
    rate_error = np.degrees(states[:, 0] - true_rate)[settled]
    speed_error = (states[:, 3] - true_speed)[settled]
    assert np.sqrt(np.mean(rate_error**2)) < (0.005 if stamped else 0.01)
    assert np.sqrt(np.mean(speed_error**2)) < 0.1
    coefficient = result.findings.yaw.coefficients["d"]
    assert coefficient.value == pytest.approx(1.333e-4, rel=0.05)
