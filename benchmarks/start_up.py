"""The start of a replay: the process with and without a cache of compiled loops."""

import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from .bench import Bench
from .measure import Comparison, Limit, SkippedError, processor_secs, run

SAMPLE = Path(__file__).resolve().parents[1] / "sample_data" / "zigzag_20_20.mcap"
REPLAY = "`shiplog replay` of 10 min"


def start_up_lines(bench: Bench) -> list[Comparison]:
    """Return the comparisons of a replay of the ten-minute sample log, as whole processes."""
    out = str(bench.folder / "start_up.rrd")
    command = [sys.executable, "-m", "shiplog", "replay", str(SAMPLE), "-o", out]

    return [
        Comparison(
            f"{REPLAY}, to .rrd",
            '`python -c "import numba, rerun"`',
            partial(processor_secs, command),
            partial(processor_secs, [sys.executable, "-c", "import numba, rerun"]),
            Limit(at_most=2.0),
            note="processor time of whole processes, loops in the cache",
        ),
        Comparison(
            f"{REPLAY}, first run on a machine",
            "a later run",
            lambda: first_run_secs(command, bench.folder),
            partial(wall_secs, command),
            Limit(at_most_secs=12.0),
            note="whole processes; limit for two quiet cores",
            verify=_skip_compilation if bench.short else None,
            warm_up=False,
        ),
    ]


def wall_secs(command: list[str]) -> float:
    """Return the seconds of a command by the clock on the wall."""
    return run(command).secs


def first_run_secs(command: list[str], folder: Path) -> float:
    """Return the seconds of a command that finds an empty cache of compiled loops.

    Parameters
    ----------
    command
        A program and its arguments.
    folder
        Where the cache is made; it is deleted afterwards.
    """
    with TemporaryDirectory(prefix="empty-cache-", dir=folder) as cache:
        return run(command, {"NUMBA_CACHE_DIR": cache}).secs


def _skip_compilation() -> None:
    raise SkippedError("compiles all loops, up to a minute; measured without --short")
