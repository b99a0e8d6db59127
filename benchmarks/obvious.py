"""The whole replay as one would write it first: `python -m benchmarks.obvious LOG OUT.rrd`.

mcap's reader into lists, numpy's interpolation onto a clock, filterpy sample by sample, a
disturbance observer sample by sample, `np.linalg.pinv` in every window of the paper's regression,
and `rr.log` of every value of every sample: the series that our own review shows, under the same
names. A day's log takes it half an hour and more; `--minutes` stops it after so many of the log,
and each stage's time is then scaled by how many messages, samples, windows or values it would have
had of all.
"""

import argparse
import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import exp, pi
from pathlib import Path

import numpy as np
import rerun as rr
from mcap.reader import make_reader
from scipy.linalg import expm

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals
from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray

from .bench import VESSEL
from .textbook import Filtered
from .with_filterpy import filter_in_filterpy

DT = 0.1
WINDOW = 2000  # samples: 200 s
STRIDE = 10  # samples from one window to the next: a second, as ours
YAW_FREQUENCY, SURGE_FREQUENCY = 0.05, 0.02  # rad/s, of the observers
DEGREES, KNOTS = 180 / pi, 3600 / 1852


@dataclass
class Stage:
    """What a stage took, and how much of its work it did."""

    secs: float
    done: int
    whole: int

    @property
    def scaled_secs(self) -> float:
        """What all of it would take."""
        return self.secs * self.whole / max(self.done, 1)


@dataclass
class Replay:
    """What was found, and what it took."""

    signals: Signals
    filtered: Filtered
    disturbance: FloatArray  # (n, 2) of yaw and surge
    coefficients: FloatArray  # (windows, 9)
    stds: FloatArray  # of the same
    stages: dict[str, Stage] = field(default_factory=dict)

    @property
    def scaled_secs(self) -> float:
        """What the whole log would take."""
        return sum(stage.scaled_secs for stage in self.stages.values())


def replay(path: Path, out: Path, c: Coefficients, minutes: float | None = None) -> Replay:
    """Read, filter, observe, identify, log; only the first minutes of the log if that is said."""
    stages: dict[str, Stage] = {}
    with _stage(stages, "read") as stage:
        stage.whole, end = _extent(path, minutes)
        columns = read_columns(path, end)
        stage.done = sum(len(values) for _, values in columns.values())
    part = stage.done / stage.whole
    with _stage(stages, "one clock") as stage:
        signals = on_one_clock(columns)
        stage.done = len(signals)
    whole = stage.whole = round(len(signals) / part)
    noise = noise_of(signals)
    with _stage(stages, "filter") as stage:
        filtered = filter_in_filterpy(signals, c, noise)
        stage.done, stage.whole = len(signals), whole
    with _stage(stages, "disturbance") as stage:
        disturbance = observe(signals, c)
        stage.done, stage.whole = len(signals), whole
    with _stage(stages, "coefficients") as stage:
        coefficients, stds = identify(signals, filtered.states, c)
        stage.done, stage.whole = len(coefficients), windows_of(whole)
    found = Replay(signals, filtered, disturbance, coefficients, stds, stages)
    with _stage(stages, "review") as stage:
        per_sample = log_all(found, out)
        each = coefficients.shape[1]
        stage.done = len(signals) * per_sample + len(coefficients) * each
        stage.whole = whole * per_sample + windows_of(whole) * each
    return found


def read_columns(path: Path, end_ns: int | None) -> dict[str, tuple[list[float], list[float]]]:
    """Times in s and values of each channel."""
    columns: dict[str, tuple[list[float], list[float]]] = {}
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(ending_before=end_ns):
            name = channel.topic.split("/")[1]
            times, values = columns.setdefault(name, ([], []))
            times.append(message.publish_time * 1e-9)
            values.append(struct.unpack_from("<d", message.data, 1)[0])
    return columns


def on_one_clock(columns: dict[str, tuple[list[float], list[float]]]) -> Signals:
    """Interpolated onto the same times, ten a second."""
    start = max(times[0] for times, _ in columns.values())
    end = min(times[-1] for times, _ in columns.values())
    at = start + DT * np.arange(round((end - start) / DT) + 1)
    values = {name: np.interp(at, times, values) for name, (times, values) in columns.items()}
    return Signals(round(start * 1e9), DT, values)


def noise_of(signals: Signals) -> NoiseModel:
    """White noise shows in the third differences; the paper's ratio."""
    outputs = np.column_stack((signals["yaw_rate"], signals["speed"]))
    stds = np.std(np.diff(outputs, 3, axis=0), axis=0) / np.sqrt(20)
    return NoiseModel(stds, np.full(2, 0.01 / 400))


def observe(signals: Signals, c: Coefficients) -> FloatArray:
    """Two observers with Butterworth poles, of a constant yaw moment and a constant surge force."""
    w_seen, v_seen = signals["yaw_rate"], signals["speed"]
    delta, n = signals["rudder"], signals["rpm"]
    rms, usual = float(np.sqrt(np.mean(w_seen**2))), float(np.median(v_seen))
    turning = c.b1 + 2 * c.b2 * rms + 3 * c.b3 * rms**2
    yaw = gain(np.array([[0.0, 1.0, 0.0], [turning, c.a, 1.0], [0.0] * 3]), YAW_FREQUENCY)
    surge = gain(np.array([[2 * c.g * usual, 1.0], [0.0, 0.0]]), SURGE_FREQUENCY)
    found = np.empty((len(signals), 2))
    w, w_dot, moment, v, force = w_seen[0], 0.0, 0.0, v_seen[0], 0.0
    for k in range(len(signals)):
        error = w_seen[k] - w
        stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w
        w_dot += (yaw[1] + (stiffness - turning) * DT) * error
        w += yaw[0] * error
        moment += yaw[2] * error
        error = v_seen[k] - v
        v, force = v + surge[0] * error, force + surge[1] * error
        found[k] = moment, force
        # a step of Heun's, the disturbances constant
        ahead = min(k + 1, len(signals) - 1)
        rate = (delta[ahead] - delta[k]) / DT
        w_ddot, v_dot = accelerations(c, w, w_dot, v, delta[k], rate, n[k])
        w_ddot, v_dot = w_ddot + moment, v_dot + force
        w_end, w_dot_end, v_end = w + DT * w_dot, w_dot + DT * w_ddot, v + DT * v_dot
        w_ddot_end, v_dot_end = accelerations(
            c, w_end, w_dot_end, v_end, delta[ahead], rate, n[ahead]
        )
        w += DT * (w_dot + w_dot_end) / 2
        w_dot += DT * (w_ddot + w_ddot_end + moment) / 2
        v += DT * (v_dot + v_dot_end + force) / 2
    return found


def gain(A: FloatArray, frequency: float) -> FloatArray:
    """The correction that puts the observer's poles on a Butterworth circle, by Ackermann.

    The first state is what is measured.
    """
    order = len(A)
    poles = frequency * np.exp(1j * pi * (2 * np.arange(order) + order + 1) / (2 * order))
    wanted = np.poly(np.exp(poles * DT)).real
    F = expm(A * DT)
    powers = [np.linalg.matrix_power(F, k) for k in range(order + 1)]
    polynomial = sum(a * power for a, power in zip(wanted[::-1], powers, strict=True))
    observability = np.array([power[0] for power in powers[:order]])
    placed = polynomial @ np.linalg.inv(observability)[:, -1]
    return np.linalg.solve(F, placed)


def accelerations(
    c: Coefficients, w: float, w_dot: float, v: float, delta: float, delta_dot: float, n: float
) -> tuple[float, float]:
    """w'' and v' of the model."""
    ks = c.alpha1 * v + c.alpha2 * n * exp(-c.alpha3 * v)
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w * w * w
    return hull + ks * (c.d * delta + c.e * delta_dot), c.f * w * w + c.g * v * v + c.h * n


def identify(
    signals: Signals, states: FloatArray, c: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Burylin's eq. (7) in every window: six coefficients of yaw, three of surge, and their stds.

    As in the paper, w'' and v' are the filter's.
    """
    w, w_dot, w_ddot, v, v_dot = states.T
    delta, n = signals["rudder"], signals["rpm"]
    ks = c.alpha1 * v + c.alpha2 * n * np.exp(-c.alpha3 * v)
    ks_delta_dot = ks * np.gradient(delta, DT)
    yaw = np.column_stack((w_dot, w, w * np.abs(w), w**3, ks * delta, ks_delta_dot))
    surge = np.column_stack((w**2, v**2, n))
    count = windows_of(len(w))
    values, stds = np.empty((count, 9)), np.empty((count, 9))
    for k in range(count):
        window = slice(STRIDE * k, STRIDE * k + WINDOW)
        values[k, :6], stds[k, :6] = least_squares(yaw[window], w_ddot[window])
        values[k, 6:], stds[k, 6:] = least_squares(surge[window], v_dot[window])
    return values, stds


def windows_of(samples: int) -> int:
    """How many windows fit."""
    return max(0, (samples - WINDOW) // STRIDE + 1)


def least_squares(X: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients, and their standard deviations by the residuals."""
    inverse = np.linalg.pinv(X)
    values = inverse @ y
    residual = y - X @ values
    variance = residual @ residual / (len(y) - X.shape[1])
    return values, np.sqrt(variance * np.sum(inverse**2, axis=1))


def log_all(found: Replay, out: Path) -> int:
    """Every value of every sample; how many values a sample, the coefficients not counted."""
    signals, (states, stds, innovations, innovation_stds) = found.signals, found.filtered
    heading = np.cumsum(states[:, 0]) * DT
    north = np.cumsum(states[:, 3] * np.cos(heading)) * DT
    east = np.cumsum(states[:, 3] * np.sin(heading)) * DT
    recording = rr.RecordingStream("obvious replay")
    recording.save(out)
    for k, t in enumerate(signals.time_secs):
        recording.set_time("time", duration=t)
        recording.set_time("stamp", timestamp=signals.start_ns * 1e-9 + t)
        for name, i, scale, thousandths in (
            ("yaw_rate", 0, DEGREES, 1e3 * DEGREES),
            ("speed", 3, KNOTS, 1e3),
        ):
            output = 0 if i == 0 else 1
            value, spread = states[k, i] * scale, 2 * stds[k, i] * scale
            banded = [value + spread, value - spread, value]
            normalised = innovations[k, output] / innovation_stds[k, output]
            kind = "yaw" if i == 0 else "surge"
            recording.log(f"{name}/measured", rr.Scalars(signals[name][k] * scale))
            recording.log(f"{name}/state", rr.Scalars(banded))
            disturbance = found.disturbance[k, output] * thousandths
            recording.log(f"disturbance_{kind}/estimate", rr.Scalars(disturbance))
            recording.log(f"innovation_{name}/normalised", rr.Scalars(normalised))
        recording.log("rudder/measured", rr.Scalars(signals["rudder"][k] * DEGREES))
        recording.log("rpm/measured", rr.Scalars(signals["rpm"][k]))
        recording.log("track/now", rr.Points2D([[east[k], -north[k]]]))
        window, within = divmod(k - WINDOW + 1, STRIDE)
        if window >= 0 and within == 0:
            log_coefficients(recording, found.coefficients[window], found.stds[window])
    recording.log("track/line", rr.LineStrips2D([np.column_stack((east, -north))]), static=True)
    recording.flush()
    recording.disconnect()
    return 11


def log_coefficients(recording: rr.RecordingStream, values: FloatArray, stds: FloatArray) -> None:
    """Each with its band."""
    names = ("a", "b1", "b2", "b3", "d", "e", "f", "g", "h")
    for name, value, std in zip(names, values, stds, strict=True):
        banded = [value + 2 * std, value - 2 * std, value]
        recording.log(f"coefficient_{name}/per_window", rr.Scalars(banded))


def _extent(path: Path, minutes: float | None) -> tuple[int, int | None]:
    """How many messages there are in all, and when the last is to be read."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        raise SystemExit(f"a log without a summary: {path}")
    told = summary.statistics
    end = None if minutes is None else told.message_start_time + round(minutes * 60e9)
    return told.message_count, end


@contextmanager
def _stage(stages: dict[str, Stage], name: str) -> Iterator[Stage]:
    stage = stages[name] = Stage(0.0, 1, 1)
    start = time.perf_counter()
    yield stage
    stage.secs = time.perf_counter() - start


def main() -> None:
    """Replay a log and say what each stage took."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.obvious", description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--minutes", type=float, help="of the log (default: all of it)")
    arguments = parser.parse_args()
    found = replay(arguments.log, arguments.out, VESSEL.paper_coefficients, arguments.minutes)
    for name, stage in found.stages.items():
        share = f"{stage.done} of {stage.whole}"
        print(f"{name}: {stage.secs:.3g} s for {share}, {stage.scaled_secs:.4g} s for all")
    print(f"in all: {found.scaled_secs:.4g} s")


if __name__ == "__main__":
    main()
