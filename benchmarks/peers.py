"""shiplog's work, and the same done the obvious way."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer

from analysis.design import discretise, pseudo_input_matrices
from analysis.kalman import Noise, filter_states
from analysis.sliding import identify
from analysis.weak_form import weak_form
from shiplog import LogWriter, Signals, TrialLog, load_vessel, read, resample
from shiplog.schema import encode, schema_for

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


@dataclass(frozen=True)
class Bench:
    """What is worked on."""

    log: TrialLog
    path: Path
    folder: Path

    @property
    def signals(self) -> Signals:
        """The log on one clock."""
        return resample(self.log, channels=NAMES)


@dataclass(frozen=True)
class Comparison:
    """One line: our work, the peer's, and how much of the work the peer was given."""

    work: str
    named: str
    ours: Callable[[Bench], object]
    peer: Callable[[Bench], object]
    held_to: float
    share: float = 1.0  # by which the peer's time is multiplied


def read_ours(bench: Bench) -> object:
    """By columns, checksums on."""
    return read(bench.path)


def read_mcap(bench: Bench) -> object:
    """One message after the other."""
    values: dict[str, list[float]] = {}
    with bench.path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            (value,) = struct.unpack_from("<d", message.data, 1)
            values.setdefault(channel.topic, []).append(value)
    return values


def inflate_only(bench: Bench) -> object:
    """What zstd alone takes: no reader can be faster."""
    inflater, total, data = zstandard.ZstdDecompressor(), 0, memoryview(bench.path.read_bytes())
    with bench.path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    for index in summary.chunk_indexes if summary else ():
        end = index.chunk_start_offset + index.chunk_length
        body = data[end - index.compressed_size : end]
        total += len(inflater.decompress(body, index.uncompressed_size))
    return total


def write_ours(bench: Bench) -> object:
    """By columns."""
    with LogWriter(bench.folder / "ours.mcap") as writer:
        writer.write(*bench.log)
    return None


def write_mcap(bench: Bench) -> object:
    """One message after the other, in the order of reception."""
    with (bench.folder / "theirs.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        scalar = schema_for(())
        schema_id = writer.register_schema(scalar.name, "protobuf", scalar.descriptor_set)
        messages = []
        for channel in bench.log:
            channel_id = writer.register_channel(channel.topic, "protobuf", schema_id)
            stamps = zip(channel.received_ns.tolist(), channel.measured_ns.tolist(), strict=True)
            messages += [
                (received, channel_id, measured, data)
                for (received, measured), data in zip(stamps, encode(channel), strict=True)
            ]
        messages.sort(key=lambda message: message[0])
        for received, channel_id, measured, data in messages:
            writer.add_message(channel_id, received, data, measured)
        writer.finish()
    return None


_MODEL = load_vessel("table1")[0].coefficients
_NOISE = Noise(np.array([8e-5, 0.12]), np.full(2, 2.5e-5))
LOOP_STEPS = 20_000  # of the numpy loop: enough to time, not enough to wait for


def filter_ours(bench: Bench) -> object:
    """Compiled."""
    return filter_states(bench.signals, _MODEL, _NOISE)


def filter_numpy(bench: Bench) -> object:
    """The linear part of the same filter as it is written in a textbook."""
    signals = bench.signals
    A, _ = pseudo_input_matrices(_MODEL, 1.0)
    r = _NOISE.measurement_std**2
    F, Q = discretise(A, np.diag(np.repeat(2.5e-5 * r * 0.1, (3, 2))), 0.1)
    C, R = np.eye(5)[[0, 3]], np.diag(r)
    x, P = np.zeros(5), np.eye(5)
    measured = np.column_stack([signals["yaw_rate"], signals["speed"]])
    steps = _steps(bench)
    for y in measured[:steps]:
        S = C @ P @ C.T + R
        K = P @ C.T @ np.linalg.inv(S)
        x = x + K @ (y - C @ x)
        P = (np.eye(5) - K @ C) @ P
        x, P = F @ x, F @ P @ F.T + Q
    return x


def windows_ours(bench: Bench) -> object:
    """Rows in weak form, and every window, its errors too."""
    return [identify(rows) for rows in weak_form(bench.signals, _MODEL)]


def windows_pinv(bench: Bench) -> object:
    """A pseudo-inverse for each window of 200 s at 10 Hz, once a second, as the paper has it."""
    X = np.random.default_rng(0).normal(size=(2000 + 10 * PINV_WINDOWS, 9))
    for k in range(PINV_WINDOWS):
        window = X[10 * k : 10 * k + 2000]
        np.linalg.pinv(window[:, :6])
        np.linalg.pinv(window[:, 6:])
    return bench


PINV_WINDOWS = 300


def _steps(bench: Bench) -> int:
    return min(LOOP_STEPS, len(bench.log["yaw_rate"]))


def comparisons(samples: int) -> tuple[Comparison, ...]:
    """The lines of the table for a log of so many samples a channel."""
    loop = samples / min(LOOP_STEPS, samples)
    windows = samples / 10 / PINV_WINDOWS
    return (
        Comparison("read to arrays", "mcap's reader", read_ours, read_mcap, 80),
        Comparison("read to arrays", "zstd alone", read_ours, inflate_only, 0.4),
        Comparison("write", "mcap's writer", write_ours, write_mcap, 8),
        Comparison("Kalman filter", "a numpy loop", filter_ours, filter_numpy, 15, loop),
        Comparison("sliding windows", "pinv a window", windows_ours, windows_pinv, 60, windows),
    )
