"""The whole replay: against a straightforward one, and its cost as the log grows."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

from shiplog import TrialLog

from .bench import VESSEL, Bench, share_note
from .filters import require_filterpy
from .logs import NAMES, RATE_HZ, require_disk_space, write_repeated
from .measure import Comparison, Limit, Process, SkippedError, run

MAX_MEMORY_BYTES = 1.5 * 2**30  # resident, however long the log
MAX_GROWTH_EXPONENT = 1.05  # of time over length
MIN_PEER_SECS = 205.0  # of the log for the straightforward replay, whose windows are 200 s
STEADY_HOURS = 24.0  # from this length on the start of Python hardly counts


def replay_lines(bench: Bench, stages: dict[str, float]) -> list[Comparison]:
    """Return the comparisons of the whole replay.

    Our review is reduced to what a screen shows unless ``--full`` is given; the peer's holds every
    sample. Both are compared with it.

    Parameters
    ----------
    bench
        The log.
    stages
        Filled with the seconds that the peer spends in each stage.
    """
    peer = _StraightforwardPeer(bench, stages)
    out = bench.folder / "ours.rrd"
    note = "; ".join(filter(None, ("ours a whole process", share_note(bench.share))))
    return [
        Comparison(
            "the whole `replay`, to .rrd",
            "mcap, filterpy, pinv and rr.log, the straightforward way",
            lambda: replay_process(bench.path, out).secs,
            peer.secs,
            Limit(at_least=100),
            note=note,
            verify=require_filterpy,
        ),
        Comparison(
            "the same with --full, every sample drawn",
            "the same",
            lambda: replay_process(bench.path, out, "--full").secs,
            peer.repeated_secs,
            note=note,
            verify=require_filterpy,
        ),
    ]


def replay_process(log: Path, out: Path, *options: str) -> Process:
    """Run `shiplog replay` as a process."""
    return run([sys.executable, "-m", "shiplog", "replay", str(log), "-o", str(out), *options])


class _StraightforwardPeer:
    """The straightforward replay; its rounds are kept, as it takes too long to be repeated."""

    def __init__(self, bench: Bench, stages: dict[str, float]) -> None:
        self._bench, self._stages = bench, stages
        self._rounds: list[float] = []

    def secs(self) -> float:
        """Run it, and return the seconds it takes for the whole log."""
        from .straightforward import straightforward_replay  # noqa: PLC0415 - needs filterpy

        bench = self._bench
        if bench.peer_secs < MIN_PEER_SECS:
            raise SkippedError(f"the peer needs at least {MIN_PEER_SECS:g} s of the log")
        minutes = None if bench.share > 0.999 else bench.peer_secs / 60
        result = straightforward_replay(
            bench.path, bench.folder / "theirs.rrd", VESSEL.paper_coefficients, minutes
        )
        self._stages.update({name: stage.scaled_secs for name, stage in result.stages.items()})
        self._rounds.append(result.scaled_secs)
        return result.scaled_secs

    def repeated_secs(self) -> float:
        """Return one of the rounds measured so far, in turn."""
        self._rounds.append(self._rounds.pop(0))
        return self._rounds[-1]


@dataclass(frozen=True)
class ReplayCost:
    """The cost of replaying a log of one length.

    Attributes
    ----------
    hours, messages, log_bytes
        The length and size of the log.
    secs
        The time of the process; None if skipped.
    peak_bytes
        Its peak of resident memory; None if the system does not report it.
    review_bytes
        The size of the review.
    skipped
        The reason if it was not measured.
    """

    hours: float
    messages: int
    log_bytes: int = 0
    secs: float | None = None
    peak_bytes: int | None = None
    review_bytes: int = 0
    skipped: str = ""


@dataclass(frozen=True)
class Growth:
    """How the cost of a replay grows with the length of the log.

    Attributes
    ----------
    costs
        For each length.
    exponent
        Of time over length, the slope on a log-log scale; None with fewer than two lengths.
    fitted_hours
        The lengths that the exponent was fitted to.
    exponent_met
        Whether it is within its limit; None without two lengths of a day or more.
    memory_met
        Whether the memory of every length is; None where it was not measured.
    """

    costs: tuple[ReplayCost, ...]
    exponent: float | None
    fitted_hours: tuple[float, ...]
    exponent_met: bool | None
    memory_met: bool | None


def measure_growth(day: TrialLog, hours: Sequence[float], folder: Path, rounds: int) -> Growth:
    """Replay logs of several lengths, each in a process of its own.

    Parameters
    ----------
    day
        The trial that the logs repeat.
    hours
        The lengths.
    folder
        Where a log and its review are written; they are deleted afterwards.
    rounds
        How often logs up to a day are replayed; longer ones are replayed once.
    """
    costs = tuple(_cost(day, h, folder, rounds) for h in sorted(set(hours)))
    measured = [(cost.hours, cost.secs) for cost in costs if cost.secs is not None]
    steady = [pair for pair in measured if pair[0] >= STEADY_HOURS]
    fitted = steady if len(steady) > 1 else measured
    exponent = None
    if len(fitted) > 1:
        log_hours, log_secs = np.log(np.array(fitted)).T
        exponent = float(np.polyfit(log_hours, log_secs, 1)[0])
    judged = exponent if len(steady) > 1 else None
    peaks = [cost.peak_bytes for cost in costs if cost.peak_bytes is not None]
    return Growth(
        costs,
        exponent,
        tuple(h for h, _ in fitted),
        exponent_met=None if judged is None else judged <= MAX_GROWTH_EXPONENT,
        memory_met=max(peaks) <= MAX_MEMORY_BYTES if peaks else None,
    )


def _cost(day: TrialLog, hours: float, folder: Path, rounds: int) -> ReplayCost:
    messages = round(hours * 3600 * RATE_HZ) * len(NAMES)
    log, out = folder / "long.mcap", folder / "long.rrd"
    try:
        require_disk_space(folder, hours)
        write_repeated(day, hours, log)
        times = rounds if hours <= STEADY_HOURS else 1
        runs = [replay_process(log, out) for _ in range(times)]
    except SkippedError as reason:
        return ReplayCost(hours, messages, skipped=str(reason))
    else:
        peaks = [r.peak_bytes for r in runs if r.peak_bytes is not None]
        return ReplayCost(
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
