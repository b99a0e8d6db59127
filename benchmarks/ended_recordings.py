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
from shiplog.interrupts import stopped_by_signals
from shiplog.mcap import open_chunk

from .forked_trials import fork

RATE_HZ = 100
MAX_SECS = 3.0  # from the begin of the reception to the end
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
        running = [
            _start(folder / f"{number.name}{index}.mcap", has_small_chunks=index % 2 == 1)
            for index in range(begin, min(begin + ENDED_TOGETHER, moments))
        ]
        started = time.monotonic()
        ends = sorted(chance.uniform(0.0, MAX_SECS) for _ in running)
        ended = []
        for end, (child, path, opened_ns) in zip(ends, running, strict=True):
            time.sleep(max(0.0, started + end - time.monotonic()))
            os.kill(child, number)
            ended.append((child, path, opened_ns, time.time_ns()))
        for child, path, *span_ns in ended:
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            try:
                lost.append(_lost_secs(path, span_ns, code, number))
            except Exception as error:  # noqa: BLE001 - whatever it is, the file is not as it must be
                secs = (span_ns[1] - span_ns[0]) * 1e-9
                failures.append(f"{path.name}, {number.name} after {secs:.3f} s: {error!r}")
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
    """A transport that sends consecutive numbers, `RATE_HZ` a second, and reports its begin."""

    address, lost = "a steady sensor", 0

    def __init__(
        self, clock: ReceptionClock, first: int, on_open: Callable[[], None] = lambda: None
    ) -> None:
        self._clock, self._first, self._count, self._on_open = clock, first, 0, on_open

    def open(self) -> None:
        self._start = time.monotonic()
        self._on_open()

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


def _start(path: Path, *, has_small_chunks: bool) -> tuple[int, Path, int]:
    """Start a recording, and return its process id, its log, and when its reception began, ns."""
    reader, writer = os.pipe()

    def work() -> int:
        if has_small_chunks:
            vars(open_chunk)["MAX_MCAP_CHUNK_BYTES"] = SMALL_MCAP_CHUNK_BYTES
        return _record_live(path, on_open=lambda: os.close(writer))

    child = fork(work)
    os.close(writer)
    os.read(reader, 1)
    os.close(reader)
    return child, path, time.time_ns()


def _record_live(
    path: Path,
    first: int = 0,
    *,
    on_open: Callable[[], None] = lambda: None,
    on_chunk: Callable[[int], None] = lambda _: None,
) -> int:
    clock = ReceptionClock()
    live = LiveStream(_Steady(clock, first, on_open), clock, "sensor")
    stream = StreamSource("sensor", "numbers", waiting_packets(live), _Numbers(), keep_raw=True)
    source = LiveSource([LiveInput(live, stream)], clock)
    with stopped_by_signals(source.stop):  # as the command does
        record(source, path, overwrites=False, on_chunk=on_chunk)
    return 0


def _record_when_closed(path: Path, first: int, reader: int, writer: int) -> int:
    """Record for a moment, from when no process can write to a pipe any more."""
    os.close(writer)
    os.read(reader, 1)
    try:
        return _record_live(path, first, on_chunk=_end_pair)
    except ShiplogError:
        return REFUSED


def _lost_secs(path: Path, span_ns: Sequence[int], code: int, number: signal.Signals) -> float:
    """Return how much of the end of a recording is missing, s; `span_ns` is its begin and end."""
    part = path.with_name(path.name + ".part")
    if number == signal.SIGKILL:
        path, part = part, path
    elif code != 0:
        raise ValueError(f"exit code {code}")
    else:
        _require_finished(path)
    if part.exists():
        raise ValueError(f"there is a file {part.name}")
    last_ns, ended_ns = span_ns
    for channel in read(path).channels:  # there is none before the first flush
        np.testing.assert_array_equal(channel.values, np.arange(len(channel)))
        last_ns = int(channel.received_ns[-1])
    return max(0.0, float(ended_ns - last_ns) * 1e-9)  # a signal ends it at its next batch


def _require_finished(path: Path) -> None:
    log = read(path)
    if log.warnings or log.data_lost:
        raise ValueError("; ".join(log.warnings))
