"""Comparisons with a peer: both take turns in the same run, and the median of the ratios counts."""

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median

CHILD = Path(__file__).with_name("child.py")
LIBRARIES = ("numpy", "scipy", "numba", "mcap", "zstandard", "rerun-sdk", "filterpy")


class SkippedError(Exception):
    """A comparison that cannot be measured here; its message states the reason."""


@dataclass(frozen=True)
class Limit:
    """The limit that a comparison is held to; none where every field is None.

    Attributes
    ----------
    at_least
        How many times as fast as the peer.
    at_most
        Or how many times the peer's time.
    at_most_secs
        Or how many seconds of our own time.
    """

    at_least: float | None = None
    at_most: float | None = None
    at_most_secs: float | None = None

    @property
    def of_ours_over_peer(self) -> bool:
        """Whether the ratio is our time over the peer's; else it is the peer's over ours."""
        return self.at_most is not None or self.at_most_secs is not None

    def met(self, ratio: float, ours_secs: float) -> bool | None:
        """Whether the limit is kept; None if there is none.

        Examples
        --------
        >>> Limit(at_most=2.5).met(ratio=3.0, ours_secs=0.3)
        False
        """
        if self.at_least is not None:
            return ratio >= self.at_least
        if self.at_most is not None:
            return ratio <= self.at_most
        return None if self.at_most_secs is None else ours_secs <= self.at_most_secs

    def __str__(self) -> str:
        """Return such as ``at most 2.5``; empty if there is no limit."""
        if self.at_least is not None:
            return f"at least {self.at_least:g}"
        if self.at_most is not None:
            return f"at most {self.at_most:g}"
        return "" if self.at_most_secs is None else f"at most {self.at_most_secs:g} s"


NO_LIMIT = Limit()


@dataclass(frozen=True)
class Comparison:
    """A comparison of our work with a peer's: one line of the table.

    Attributes
    ----------
    work
        What is measured.
    against
        The peer.
    ours, peer
        Do the work and return the seconds that all of it takes.
    limit
        The limit that the comparison is held to.
    note
        A remark, such as on which share of the log the peer was timed.
    verify
        Called first; raises where the two results differ, or `SkippedError`.
    warm_up
        Whether our work is done once before it is timed, to compile loops and to fill the disk
        cache.
    """

    work: str
    against: str
    ours: Callable[[], float]
    peer: Callable[[], float]
    limit: Limit = NO_LIMIT
    note: str = ""
    verify: Callable[[], None] | None = None
    warm_up: bool = True


@dataclass(frozen=True)
class ComparisonResult:
    """The result of a comparison.

    Attributes
    ----------
    work, against, limit, note
        As in the `Comparison`.
    ours_secs, peer_secs
        Medians over the rounds, s; None if skipped.
    ratio
        The median ratio: peer over ours, or ours over peer where the limit is an upper one.
    met
        Whether the limit is kept; None if there is none or nothing was judged.
    rounds
        Our seconds and the peer's in each round.
    skipped
        The reason if there is no ratio.
    """

    work: str
    against: str
    limit: Limit = NO_LIMIT
    ours_secs: float | None = None
    peer_secs: float | None = None
    ratio: float | None = None
    met: bool | None = None
    note: str = ""
    rounds: tuple[tuple[float, float], ...] = ()
    skipped: str = ""


def timed(work: Callable[[], object], scale: float = 1.0) -> Callable[[], float]:
    """Return a function that does the work and returns its seconds, multiplied by `scale`.

    The scale is above one where the work is a share of the whole.
    """

    def measured() -> float:
        start = time.perf_counter()
        work()
        return (time.perf_counter() - start) * scale

    return measured


def compare_with_peer(line: Comparison, rounds: int, *, judged: bool = True) -> ComparisonResult:
    """Verify that both results agree, then time both in turn, and return the median ratio.

    Parameters
    ----------
    line
        The comparison.
    rounds
        How often each side is timed. With a single round nothing is warmed up: such a run shows
        only that the line runs.
    judged
        Whether the limit applies.
    """
    try:
        if line.verify is not None:
            line.verify()
        if line.warm_up and rounds > 1:
            line.ours()
        times = tuple((line.ours(), line.peer()) for _ in range(rounds))
    except SkippedError as reason:
        return ComparisonResult(
            line.work, line.against, line.limit, note=line.note, skipped=str(reason)
        )
    inverse = line.limit.of_ours_over_peer
    ratio = median(ours / peer if inverse else peer / ours for ours, peer in times)
    ours_secs = median(ours for ours, _ in times)
    return ComparisonResult(
        line.work,
        line.against,
        line.limit,
        ours_secs,
        peer_secs=median(peer for _, peer in times),
        ratio=ratio,
        met=line.limit.met(ratio, ours_secs) if judged else None,
        note=line.note,
        rounds=times,
    )


@dataclass(frozen=True)
class Process:
    """A finished command.

    Attributes
    ----------
    secs
        Its duration.
    processor_secs
        The processor time of it and of the processes it started; None where the system does not
        report it.
    peak_bytes
        Its peak of resident memory; None where the system does not report it.
    """

    secs: float
    processor_secs: float | None
    peak_bytes: int | None


def run(command: list[str], environment: Mapping[str, str] | None = None) -> Process:
    """Run a command to its end, with additional environment variables.

    It may keep its byte code, as an installed package does, so that no run compiles the sources of
    this project while the peer's are compiled already.

    A small process of its own starts it and waits for it: a child's peak of memory is counted from
    that of the process it was forked from, and this one is large.

    Raises
    ------
    SkippedError
        The command failed; with the last line of its stderr.
    """
    inherited = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(
        [sys.executable, str(CHILD), *command],
        env={**inherited, **(environment or {})},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise SkippedError(f"{' '.join(command[1:4])} failed: {_last_line(done.stderr)}")
    result = json.loads(done.stdout.splitlines()[-1])
    return Process(**result)


def processor_secs(command: list[str]) -> float:
    """Run a command and return its processor time, which other processes hardly change.

    Raises
    ------
    SkippedError
        The command failed, or the system does not report the time.
    """
    secs = run(command).processor_secs
    if secs is None:
        raise SkippedError("this system does not report the processor time of a process")
    return secs


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["no error message"])[-1]


def machine() -> dict[str, str]:
    """Return the machine and the versions of the libraries, by name."""
    facts = {
        "processor": _processor(),
        "cores": str(_cores()),
        "memory": _memory(),
        "system": _system(),
        "threads of BLAS": os.environ["OPENBLAS_NUM_THREADS"],
        "python": platform.python_version(),
    }
    for name in LIBRARIES:
        try:
            facts[name] = version(name)
        except PackageNotFoundError:
            facts[name] = "not installed"
    return facts


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _memory() -> str:
    try:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return "unknown"
    return f"{size / 2**30:.1f} GiB"


def _system() -> str:
    try:
        name = platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        return f"{platform.system()} {platform.release()}"
    return f"{platform.system()}, {name}"
