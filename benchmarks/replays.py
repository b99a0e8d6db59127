"""The whole of `replay`: against the obvious one, and as the log grows."""

import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

from shiplog import TrialLog

from .bench import VESSEL, Bench, said_share
from .filters import require_filterpy
from .logs import NAMES, RATE_HZ, require_room, write_repeated
from .measure import Line, Process, SkippedError, holds, run

MOST_MEMORY = 1.5 * 2**30  # bytes, resident, however long the log
STEEPEST = 1.05  # exponent of time over length
FEWEST_SECS = 240.0  # of the log for the obvious replay, whose windows are 200 s
STEADY_HOURS = 24.0  # from here on the start of Python is no part of the time worth telling


def lines(bench: Bench, stages: dict[str, float]) -> list[Line]:
    """The whole replay; what each stage takes the peer is put into `stages`.

    Our review is thinned to what a screen can show unless it is told not to; the peer's is whole.
    Both are compared with it.
    """
    peer = _Obvious(bench, stages)
    out = bench.folder / "ours.rrd"
    note = "; ".join(filter(None, ("ours a whole process", said_share(bench.share))))
    return [
        Line(
            "the whole `replay`, to .rrd",
            "mcap, filterpy, pinv and rr.log, written the obvious way",
            lambda: replay_process(bench.path, out).secs,
            peer.secs,
            at_least=100,
            note=note,
            same=require_filterpy,
        ),
        Line(
            "the same with --full, every sample drawn",
            "the same",
            lambda: replay_process(bench.path, out, "--full").secs,
            peer.again,
            note=note,
            same=require_filterpy,
        ),
    ]


def replay_process(log: Path, out: Path, *options: str) -> Process:
    """`shiplog replay` as it is called."""
    return run([sys.executable, "-m", "shiplog", "replay", str(log), "-o", str(out), *options])


class _Obvious:
    """The obvious replay, and what it took in the rounds so far: it is too long to be repeated."""

    def __init__(self, bench: Bench, stages: dict[str, float]) -> None:
        self._bench, self._stages = bench, stages
        self._rounds: list[float] = []

    def secs(self) -> float:
        from .obvious import replay  # noqa: PLC0415 - filterpy may not be installed

        bench = self._bench
        if bench.peer_secs < FEWEST_SECS:
            raise SkippedError(f"the peer needs {FEWEST_SECS / 60:g} min of the log at the least")
        minutes = None if bench.share > 0.999 else bench.peer_secs / 60
        found = replay(bench.path, bench.folder / "theirs.rrd", VESSEL.paper_coefficients, minutes)
        self._stages.update({name: stage.scaled_secs for name, stage in found.stages.items()})
        self._rounds.append(found.scaled_secs)
        return found.scaled_secs

    def again(self) -> float:
        """One of the rounds that were measured already, in turn."""
        self._rounds.append(self._rounds.pop(0))
        return self._rounds[-1]


@dataclass(frozen=True)
class Length:
    """What a log of one length took."""

    hours: float
    messages: int
    log_bytes: int = 0
    secs: float | None = None
    peak_bytes: int | None = None
    review_bytes: int = 0
    skipped: str = ""


@dataclass(frozen=True)
class Growth:
    """How a replay's cost grows with the length of the log."""

    lengths: tuple[Length, ...]
    exponent: float | None  # of time over length, fitted on log-log
    fitted_hours: tuple[float, ...]  # to these
    exponent_met: bool | None  # None where fewer than two lengths of a day or more were measured
    memory_met: bool | None  # of every length measured


def growth(day: TrialLog, hours: list[float], folder: Path, rounds: int) -> Growth:
    """Replay logs of so many hours, each in a process of its own."""
    lengths = tuple(_length(day, h, folder, rounds) for h in sorted(set(hours)))
    measured = [(x.hours, x.secs) for x in lengths if x.secs is not None]
    steady = [pair for pair in measured if pair[0] >= STEADY_HOURS]
    fitted = steady if len(steady) > 1 else measured
    exponent = None
    if len(fitted) > 1:
        log_hours, log_secs = np.log(np.array(fitted)).T
        exponent = float(np.polyfit(log_hours, log_secs, 1)[0])
    judged = exponent if len(steady) > 1 else None
    peaks = [x.peak_bytes for x in lengths if x.peak_bytes is not None]
    return Growth(
        lengths,
        exponent,
        tuple(h for h, _ in fitted),
        holds(judged, None, STEEPEST) if judged is not None else None,
        holds(max(peaks), None, MOST_MEMORY) if peaks else None,
    )


def _length(day: TrialLog, hours: float, folder: Path, rounds: int) -> Length:
    messages = round(hours * 3600 * RATE_HZ) * len(NAMES)
    log, out = folder / "long.mcap", folder / "long.rrd"
    try:
        require_room(folder, hours)
        write_repeated(day, hours, log)
        times = rounds if hours <= STEADY_HOURS else 1
        runs = [replay_process(log, out) for _ in range(times)]
    except SkippedError as reason:
        return Length(hours, messages, skipped=str(reason))
    else:
        peaks = [r.peak_bytes for r in runs if r.peak_bytes is not None]
        return Length(
            hours,
            messages,
            log.stat().st_size,
            median(r.secs for r in runs),
            max(peaks) if peaks else None,
            out.stat().st_size,
        )
    finally:
        for path in (log, out):
            path.unlink(missing_ok=True)
