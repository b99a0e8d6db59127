"""Live recordings of 100 messages a second that are ended at random moments, or started twice."""

import os
import signal
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from recorders.record import record
from recorders.streams.counts import StreamCounts
from recorders.streams.packets import Packet
from recorders.streams.reception_clock import ReceptionClock
from recorders.streams.sample_buffer import SampleBuffer
from recorders.streams.stream_source import StreamSource
from recorders.transports.live_stream import LiveStream
from recorders.trial.live_source import LiveInput, LiveSource, waiting_packets
from shiplog import ShiplogError, read
from shiplog.mcap import open_chunk

from .forked_trials import fork

RATE_HZ = 100
FIRST_END_SECS, LAST_END_SECS = 0.4, 3.4  # after the start of a recording
ENDED_TOGETHER = 20
SMALL_MCAP_CHUNK_BYTES = 4096  # closed about every half second
REFUSED = 7  # exit code of the recorder that found the name taken
PAIR_SAMPLES = 20  # after which each of two recorders on one name ends


def end_recordings(
    number: signal.Signals, moments: int, folder: Path, seed: int = 1
) -> tuple[list[float], list[str]]:
    """Send a signal to live recordings at random moments.

    In every other recording the MCAP chunks are small, so that many are complete at its end.

    Parameters
    ----------
    number
        The signal; SIGKILL leaves an unfinished file, any other one a finished one.
    moments
        The number of recordings.
    folder
        Where they are made.
    seed
        Of the moments.

    Returns
    -------
    lost_secs, failures
        (n,) how much of the end of the recordings is missing, s, of those that can be read; and
        what is wrong with the others.
    """
    chance = np.random.default_rng(seed)
    lost, failures = [], []
    for begin in range(0, moments, ENDED_TOGETHER):
        running = []
        for index in range(begin, min(begin + ENDED_TOGETHER, moments)):
            path = folder / f"{number.name}{index}.mcap"
            child = fork(partial(_record_live, path, has_small_chunks=index % 2 == 1))
            running.append((child, path))
        started = time.monotonic()
        ends = sorted(chance.uniform(FIRST_END_SECS, LAST_END_SECS) for _ in running)
        ended = []
        for end, (child, path) in zip(ends, running, strict=True):
            time.sleep(max(0.0, started + end - time.monotonic()))
            os.kill(child, number)
            ended.append((child, path, time.time_ns(), end))
        for child, path, ended_ns, end in ended:
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            try:
                lost.append(_lost_secs(path, ended_ns, code, number))
            except Exception as error:  # noqa: BLE001 - whatever it is, the file is not as it must be
                failures.append(f"{path.name}, {number.name} after {end:.3f} s: {error!r}")
    failures += [f"{secs:.3f} s were lost by {number.name}" for secs in lost if secs > 1.0]
    return lost, failures


def start_together(pairs: int, folder: Path) -> list[str]:
    """Start two live recorders on one name at the same time.

    Returns
    -------
    failures
        One for each pair of which not exactly one recorder has made the log, or the log is not that
        of the one that reports it.
    """
    failures = []
    for pair in range(pairs):
        path = folder / f"pair{pair}.mcap"
        reader, writer = os.pipe()
        children = [
            fork(partial(_record_when_closed, path, 1000 * i, reader, writer)) for i in (1, 2)
        ]
        os.close(reader)
        os.close(writer)  # both go on
        codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
        if sorted(codes) != [0, REFUSED]:
            failures.append(f"{path.name}: the exit codes of the recorders are {codes}")
            continue
        try:
            rpm = read(path)["rpm"].values
            first = 1000 * (1 + codes.index(0))
            np.testing.assert_array_equal(rpm, first + np.arange(len(rpm)))
            _require_finished(path)
        except Exception as error:  # noqa: BLE001 - whatever it is, the file is not as it must be
            failures.append(f"{path.name}: {error!r}")
    return failures


class _Steady:
    """A transport that sends consecutive numbers, `RATE_HZ` a second."""

    address, lost = "a steady sensor", 0

    def __init__(self, clock: ReceptionClock, first: int) -> None:
        self._clock, self._first, self._count = clock, first, 0

    def open(self) -> None:
        self._start = time.monotonic()

    def receive(self, timeout_secs: float) -> list[Packet]:
        time.sleep(max(0.0, min(timeout_secs, self._due() - time.monotonic())))
        packets = []
        while self._due() <= time.monotonic():
            packets.append(Packet(b"%d" % (self._first + self._count), self._clock.now_ns()))
            self._count += 1
        return packets

    def close(self) -> None:
        pass

    def _due(self) -> float:
        return self._start + self._count / RATE_HZ


class _Numbers:
    """A decoder of numbers, as revolutions."""

    def __init__(self) -> None:
        self.counts = StreamCounts()

    def decode(self, batch: Sequence[Packet], samples: SampleBuffer) -> None:
        for packet in batch:
            samples.add("rpm", "sensor", float(packet.data), packet.received_ns)
            self.counts.accept("number")

    def finish(self, samples: SampleBuffer) -> None:
        pass


def _end_pair(samples: int) -> None:
    if samples >= PAIR_SAMPLES:
        os.kill(os.getpid(), signal.SIGINT)


def _record_live(
    path: Path,
    first: int = 0,
    *,
    has_small_chunks: bool = False,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> int:
    if has_small_chunks:
        vars(open_chunk)["MAX_MCAP_CHUNK_BYTES"] = SMALL_MCAP_CHUNK_BYTES  # in this process
    clock = ReceptionClock()
    live = LiveStream(_Steady(clock, first), clock, "sensor")
    stream = StreamSource("sensor", "numbers", waiting_packets(live), _Numbers(), keep_raw=True)
    record(LiveSource([LiveInput(live, stream)], clock), path, overwrites=False, on_chunk=on_chunk)
    return 0


def _record_when_closed(path: Path, first: int, reader: int, writer: int) -> int:
    """Record for a moment, from when no process can write to a pipe any more."""
    os.close(writer)
    os.read(reader, 1)
    try:
        return _record_live(path, first, on_chunk=_end_pair)
    except ShiplogError:
        return REFUSED


def _lost_secs(path: Path, ended_ns: int, code: int, number: signal.Signals) -> float:
    """Return how much of the end of a recording is missing, s."""
    part = path.with_name(path.name + ".part")
    if number == signal.SIGKILL:
        path, part = part, path
    elif code != 0:
        raise ValueError(f"exit code {code}")
    else:
        _require_finished(path)
    if part.exists():
        raise ValueError(f"there is a file {part.name}")
    rpm = read(path)["rpm"]
    np.testing.assert_array_equal(rpm.values, np.arange(len(rpm)))
    return float(ended_ns - int(rpm.received_ns[-1])) * 1e-9


def _require_finished(path: Path) -> None:
    log = read(path)
    if log.warnings or log.data_lost:
        raise ValueError("; ".join(log.warnings))
