"""Times, ratios and what is held: medians of rounds in which ours and the peer take turns."""

import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median

CHILD = Path(__file__).with_name("child.py")
LIBRARIES = ("numpy", "scipy", "numba", "mcap", "zstandard", "rerun-sdk", "filterpy")


class SkippedError(Exception):
    """A line that cannot be measured here; it says why."""


@dataclass(frozen=True)
class Line:
    """One comparison. `ours` and `peer` do the work and return the seconds that all of it takes."""

    work: str
    against: str
    ours: Callable[[], float]
    peer: Callable[[], float]
    at_least: float | None = None  # how many times as fast as the peer
    at_most: float | None = None  # or how many times the peer's time
    note: str = ""  # such as on which share of the log the peer was timed
    same: Callable[[], None] | None = None  # first; raises where the two do not find the same


@dataclass(frozen=True)
class Result:
    """What came out of a line."""

    work: str
    against: str
    ours_secs: float | None
    peer_secs: float | None
    ratio: float | None  # peer over ours; ours over peer where `at_most` is what is asked
    at_least: float | None
    at_most: float | None
    met: bool | None  # None where nothing is asked, or nothing was measured
    note: str
    rounds: tuple[tuple[float, float], ...] = ()
    skipped: str = ""  # why there is no ratio


def timed(work: Callable[[], object], scale: float = 1.0) -> Callable[[], float]:
    """Do the work and tell the seconds it took, `scale` times them if it was but a share."""

    def measured() -> float:
        start = time.perf_counter()
        work()
        return (time.perf_counter() - start) * scale

    return measured


def compare(line: Line, rounds: int, *, judged: bool = True) -> Result:
    """Check that both find the same, then let them take turns; the median of the ratios.

    It is held to what is asked if it is to be judged.
    """
    try:
        if line.same is not None:
            line.same()
        line.ours()  # compile, and fill the disk's cache
        times = tuple((line.ours(), line.peer()) for _ in range(rounds))
    except SkippedError as reason:
        return Result(
            line.work, line.against, None, None, None, line.at_least, line.at_most, None,
            line.note, skipped=str(reason),
        )  # fmt: skip
    if line.at_most is None:
        ratio = median(peer / ours for ours, peer in times)
    else:
        ratio = median(ours / peer for ours, peer in times)
    return Result(
        line.work,
        line.against,
        median(ours for ours, _ in times),
        median(peer for _, peer in times),
        ratio,
        line.at_least,
        line.at_most,
        holds(ratio, line.at_least, line.at_most) if judged else None,
        line.note,
        times,
    )


def holds(value: float, at_least: float | None, at_most: float | None) -> bool | None:
    """Whether a bound is kept; None where there is none."""
    if at_least is None and at_most is None:
        return None
    return (at_least is None or value >= at_least) and (at_most is None or value <= at_most)


@dataclass(frozen=True)
class Process:
    """A command that was run to its end."""

    secs: float
    peak_bytes: int | None  # of resident memory; None where the system does not tell


def run(command: list[str]) -> Process:
    """Run a command; `SkippedError` with its last words where it fails.

    A small process of its own starts it and waits for it: a child's peak is counted from that of
    the process it was forked from, and this one is large.
    """
    done = subprocess.run(
        [sys.executable, str(CHILD), *command], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SkippedError(f"{' '.join(command[1:4])} failed: {_last_line(done.stderr)}")
    said = json.loads(done.stdout.splitlines()[-1])
    return Process(said["secs"], said["peak_bytes"])


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["it does not say why"])[-1]


def machine() -> dict[str, str]:
    """What it all ran on."""
    said = {
        "processor": _processor(),
        "cores": str(_cores()),
        "memory": _memory(),
        "system": _system(),
        "threads of BLAS": os.environ["OPENBLAS_NUM_THREADS"],
        "python": platform.python_version(),
    }
    for name in LIBRARIES:
        try:
            said[name] = version(name)
        except PackageNotFoundError:
            said[name] = "not installed"
    return said


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
