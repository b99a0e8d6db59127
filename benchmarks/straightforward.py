"""The whole replay in the straightforward way, the peer of `shiplog replay`.

    python -m benchmarks.straightforward LOG OUT.rrd

mcap's reader into lists, numpy's interpolation onto one clock, filterpy and a disturbance observer
sample by sample, `np.linalg.pinv` in every window of the paper's regression, and `rr.log` of every
value of every sample: the series that our own review shows, under the same names. A log of a day
takes half an hour and more; `--minutes` reads only the first minutes, and the time of each stage is
then scaled by the number of messages, samples, windows or values in the whole log.
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
from .textbook import FilterResult
from .with_filterpy import filter_in_filterpy

DT = 0.1
WINDOW = 2000  # samples: 200 s
STRIDE = 10  # samples from one window to the next: 1 s, as ours
YAW_FREQUENCY, SURGE_FREQUENCY = 0.05, 0.02  # rad/s, of the observers' poles
DEGREES, KNOTS = 180 / pi, 3600 / 1852
SERIES_VALUES = 11  # logged for each sample, without the coefficients


@dataclass
class TimedStage:
    """The time of a stage.

    Attributes
    ----------
    secs
        The time it took.
    done
        The messages, samples, windows or values that it processed.
    whole
        Those of the whole log.
    """

    secs: float
    done: int
    whole: int

    @property
    def scaled_secs(self) -> float:
        """The time that the whole log would take, s."""
        return self.secs * self.whole / max(self.done, 1)


@dataclass
class StraightforwardReplay:
    """The results of a replay and the time of its stages.

    Attributes
    ----------
    signals
        The channels on one clock.
    filtered
        The states of the filter.
    disturbance
        (n, 2) of yaw, rad/s³, and surge, m/s².
    coefficients, stds
        (windows, 9) and their standard deviations.
    stages
        The time of each stage.
    """

    signals: Signals
    filtered: FilterResult
    disturbance: FloatArray
    coefficients: FloatArray
    stds: FloatArray
    stages: dict[str, TimedStage] = field(default_factory=dict)

    @property
    def scaled_secs(self) -> float:
        """The time that the whole log would take, s."""
        return sum(stage.scaled_secs for stage in self.stages.values())


def straightforward_replay(
    path: Path, out: Path, c: Coefficients, minutes: float | None = None
) -> StraightforwardReplay:
    """Read, resample, filter, estimate disturbances and coefficients, and log all to Rerun.

    Parameters
    ----------
    path
        The MCAP file.
    out
        The .rrd to write.
    c
        The coefficients of the paper's model.
    minutes
        Read only the first minutes of the log; all of it if None.
    """
    stages: dict[str, TimedStage] = {}
    with _stage(stages, "read") as stage:
        stage.whole, end = _extent(path, minutes)
        columns = read_columns(path, end)
        stage.done = sum(len(values) for _, values in columns.values())
    part = stage.done / stage.whole
    with _stage(stages, "resample") as stage:
        signals = resample_linearly(columns)
        stage.done = len(signals)
    whole = stage.whole = round(len(signals) / part)
    noise = white_noise_of(signals)
    with _stage(stages, "filter") as stage:
        filtered = filter_in_filterpy(signals, c, noise)
        stage.done, stage.whole = len(signals), whole
    with _stage(stages, "disturbance") as stage:
        disturbance = observe_disturbances(signals, c)
        stage.done, stage.whole = len(signals), whole
    with _stage(stages, "coefficients") as stage:
        coefficients, stds = regression_in_windows(signals, filtered.states, c)
        stage.done, stage.whole = len(coefficients), window_count(whole)
    result = StraightforwardReplay(signals, filtered, disturbance, coefficients, stds, stages)
    with _stage(stages, "review") as stage:
        log_all(result, out)
        each = coefficients.shape[1]
        stage.done = len(signals) * SERIES_VALUES + len(coefficients) * each
        stage.whole = whole * SERIES_VALUES + window_count(whole) * each
    return result


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


def resample_linearly(columns: dict[str, tuple[list[float], list[float]]]) -> Signals:
    """Interpolate all channels to the same instants, ten a second."""
    start = max(times[0] for times, _ in columns.values())
    end = min(times[-1] for times, _ in columns.values())
    at = start + DT * np.arange(round((end - start) / DT) + 1)
    values = {name: np.interp(at, times, values) for name, (times, values) in columns.items()}
    return Signals(round(start * 1e9), DT, values)


def white_noise_of(signals: Signals) -> NoiseModel:
    """Return the noise: measured from third differences, the process ratio as in the paper."""
    outputs = np.column_stack((signals["yaw_rate"], signals["speed"]))
    stds = np.std(np.diff(outputs, 3, axis=0), axis=0) / np.sqrt(20)
    return NoiseModel(stds, np.full(2, 0.01 / 400))


def observe_disturbances(signals: Signals, c: Coefficients) -> FloatArray:
    """Estimate a yaw moment and a surge force, (n, 2), by two observers with Butterworth poles.

    The observers assume both to be constant.
    """
    w_measured, v_measured = signals["yaw_rate"], signals["speed"]
    delta, n = signals["rudder"], signals["rpm"]
    rms, median_speed = float(np.sqrt(np.mean(w_measured**2))), float(np.median(v_measured))
    turning = c.b1 + 2 * c.b2 * rms + 3 * c.b3 * rms**2
    yaw = observer_gain(np.array([[0.0, 1.0, 0.0], [turning, c.a, 1.0], [0.0] * 3]), YAW_FREQUENCY)
    surge = observer_gain(np.array([[2 * c.g * median_speed, 1.0], [0.0, 0.0]]), SURGE_FREQUENCY)
    disturbance = np.empty((len(signals), 2))
    w, w_dot, moment, v, force = w_measured[0], 0.0, 0.0, v_measured[0], 0.0
    for k in range(len(signals)):
        error = w_measured[k] - w
        stiffness = c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w
        w_dot += (yaw[1] + (stiffness - turning) * DT) * error
        w += yaw[0] * error
        moment += yaw[2] * error
        error = v_measured[k] - v
        v, force = v + surge[0] * error, force + surge[1] * error
        disturbance[k] = moment, force
        # a step of Heun's method, the disturbances constant
        ahead = min(k + 1, len(signals) - 1)
        rate = (delta[ahead] - delta[k]) / DT
        w_ddot, v_dot = model_accelerations(c, w, w_dot, v, delta[k], rate, n[k])
        w_ddot, v_dot = w_ddot + moment, v_dot + force
        w_end, w_dot_end, v_end = w + DT * w_dot, w_dot + DT * w_ddot, v + DT * v_dot
        w_ddot_end, v_dot_end = model_accelerations(
            c, w_end, w_dot_end, v_end, delta[ahead], rate, n[ahead]
        )
        w += DT * (w_dot + w_dot_end) / 2
        w_dot += DT * (w_ddot + w_ddot_end + moment) / 2
        v += DT * (v_dot + v_dot_end + force) / 2
    return disturbance


def observer_gain(A: FloatArray, frequency: float) -> FloatArray:
    """Return the gain (k,) that places the observer's poles on a Butterworth circle.

    Parameters
    ----------
    A
        (k, k) continuous system; its first state is the one that is measured.
    frequency
        The radius of the circle, rad/s.

    References
    ----------
    Ackermann's formula, in discrete time.
    """
    order = len(A)
    poles = frequency * np.exp(1j * pi * (2 * np.arange(order) + order + 1) / (2 * order))
    characteristic = np.poly(np.exp(poles * DT)).real
    F = expm(A * DT)
    powers = [np.linalg.matrix_power(F, k) for k in range(order + 1)]
    polynomial = sum(a * power for a, power in zip(characteristic[::-1], powers, strict=True))
    observability = np.array([power[0] for power in powers[:order]])
    placed = polynomial @ np.linalg.inv(observability)[:, -1]
    return np.linalg.solve(F, placed)


def model_accelerations(
    c: Coefficients, w: float, w_dot: float, v: float, delta: float, delta_dot: float, n: float
) -> tuple[float, float]:
    """Return w'' and v' of the paper's model."""
    ks = c.alpha1 * v + c.alpha2 * n * exp(-c.alpha3 * v)
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w * w * w
    return hull + ks * (c.d * delta + c.e * delta_dot), c.f * w * w + c.g * v * v + c.h * n


def regression_in_windows(
    signals: Signals, states: FloatArray, c: Coefficients
) -> tuple[FloatArray, FloatArray]:
    """Solve Burylin's eq. (7) in every window, with w'' and v' from the filter as in the paper.

    Parameters
    ----------
    signals
        n samples of rudder and revolutions.
    states
        (n, 5) of the filter.
    c
        Gives the coefficients alpha1, alpha2 and alpha3.

    Returns
    -------
    values, stds
        (windows, 9): six coefficients of yaw, three of surge, and their standard deviations.
    """
    w, w_dot, w_ddot, v, v_dot = states.T
    delta, n = signals["rudder"], signals["rpm"]
    ks = c.alpha1 * v + c.alpha2 * n * np.exp(-c.alpha3 * v)
    ks_delta_dot = ks * np.gradient(delta, DT)
    yaw = np.column_stack((w_dot, w, w * np.abs(w), w**3, ks * delta, ks_delta_dot))
    surge = np.column_stack((w**2, v**2, n))
    count = window_count(len(w))
    values, stds = np.empty((count, 9)), np.empty((count, 9))
    for k in range(count):
        window = slice(STRIDE * k, STRIDE * k + WINDOW)
        values[k, :6], stds[k, :6] = pinv_least_squares(yaw[window], w_ddot[window])
        values[k, 6:], stds[k, 6:] = pinv_least_squares(surge[window], v_dot[window])
    return values, stds


def window_count(samples: int) -> int:
    """Return the number of windows in so many samples."""
    return max(0, (samples - WINDOW) // STRIDE + 1)


def pinv_least_squares(X: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients and their standard deviations, from the residuals."""
    inverse = np.linalg.pinv(X)
    values = inverse @ y
    residual = y - X @ values
    variance = residual @ residual / (len(y) - X.shape[1])
    return values, np.sqrt(variance * np.sum(inverse**2, axis=1))


def log_all(result: StraightforwardReplay, out: Path) -> None:
    """Log every value of every sample to a Rerun recording."""
    signals, (states, stds, innovations, innovation_stds) = result.signals, result.filtered
    heading = np.cumsum(states[:, 0]) * DT
    north = np.cumsum(states[:, 3] * np.cos(heading)) * DT
    east = np.cumsum(states[:, 3] * np.sin(heading)) * DT
    recording = rr.RecordingStream("straightforward replay")
    recording.save(out)
    for k, t in enumerate(signals.time_secs):
        recording.set_time("time", duration=t)
        recording.set_time("stamp", timestamp=signals.start_ns * 1e-9 + t)
        for name, i, scale, thousandths in (
            ("yaw_rate", 0, 60 * DEGREES, 1e3 * DEGREES),  # deg/min
            ("speed", 3, KNOTS, 1e3),
        ):
            output = 0 if i == 0 else 1
            value, band = states[k, i] * scale, 2 * stds[k, i] * scale
            banded = [value + band, value - band, value]
            normalised = innovations[k, output] / innovation_stds[k, output]
            kind = "yaw" if i == 0 else "surge"
            recording.log(f"{name}/measured", rr.Scalars(signals[name][k] * scale))
            recording.log(f"{name}/state", rr.Scalars(banded))
            disturbance = result.disturbance[k, output] * thousandths
            recording.log(f"disturbance_{kind}/estimate", rr.Scalars(disturbance))
            recording.log(f"innovation_{name}/normalised", rr.Scalars(normalised))
        recording.log("steering/rudder/measured", rr.Scalars(signals["rudder"][k] * DEGREES))
        recording.log("rpm/measured", rr.Scalars(signals["rpm"][k]))
        recording.log("track/now", rr.Points2D([[east[k], -north[k]]]))
        window, within = divmod(k - WINDOW + 1, STRIDE)
        if window >= 0 and within == 0:
            log_coefficients(recording, result.coefficients[window], result.stds[window])
    recording.log("track/line", rr.LineStrips2D([np.column_stack((east, -north))]), static=True)
    recording.flush()
    recording.disconnect()


def log_coefficients(recording: rr.RecordingStream, values: FloatArray, stds: FloatArray) -> None:
    """Log each coefficient of a window with its band of two standard deviations."""
    names = ("a", "b1", "b2", "b3", "d", "e", "f", "g", "h")
    for name, value, std in zip(names, values, stds, strict=True):
        banded = [value + 2 * std, value - 2 * std, value]
        recording.log(f"coefficient_{name}/per_window", rr.Scalars(banded))


def _extent(path: Path, minutes: float | None) -> tuple[int, int | None]:
    """Return the number of messages in the log, and the time at which to stop reading, ns."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        raise SystemExit(f"{path} has no summary; `shiplog convert` writes one")
    statistics = summary.statistics
    end = None if minutes is None else statistics.message_start_time + round(minutes * 60e9)
    return statistics.message_count, end


@contextmanager
def _stage(stages: dict[str, TimedStage], name: str) -> Iterator[TimedStage]:
    """Time a stage; the caller sets how much of its work was done."""
    stage = stages[name] = TimedStage(0.0, 1, 1)
    start = time.perf_counter()
    yield stage
    stage.secs = time.perf_counter() - start


def main() -> None:
    """Replay a log and print the time of each stage."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.straightforward",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("log", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--minutes", type=float, help="read only the first minutes of the log")
    arguments = parser.parse_args()
    result = straightforward_replay(
        arguments.log, arguments.out, VESSEL.paper_coefficients, arguments.minutes
    )
    for name, stage in result.stages.items():
        share = f"{stage.done} of {stage.whole}"
        print(f"{name}: {stage.secs:.3g} s for {share}, {stage.scaled_secs:.4g} s for the whole")
    print(f"total: {result.scaled_secs:.4g} s")


if __name__ == "__main__":
    main()
