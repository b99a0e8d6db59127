"""`python -m benchmarks [--hours H] [--json FILE]`: a table of times, ratios and their medians.

Each line times shiplog and its peer in turn, several rounds, and tells the median of the ratios:
machines are noisy, ratios in one run are not.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

from .logs import as_written, day_of_trial
from .peers import Bench, comparisons

ROUNDS = 5


@dataclass(frozen=True)
class Result:
    """One line of the table."""

    work: str
    peer: str
    ours_secs: float
    peer_secs: float
    ratio: float  # the median of the rounds' ratios, peer over ours
    held_to: float


def main() -> None:
    """Measure, and print what came out."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="of trial at 10 Hz (default: 24)")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        log = day_of_trial(arguments.hours)
        bench = Bench(log, as_written(log, Path(folder) / "day.mcap"), Path(folder))
        results = []
        for comparison in comparisons(len(log["yaw_rate"])):
            comparison.ours(bench)  # compile, and fill the disk's cache
            rounds = [
                (_timed(comparison.ours, bench), _timed(comparison.peer, bench) * comparison.share)
                for _ in range(arguments.rounds)
            ]
            results.append(
                Result(
                    comparison.work,
                    comparison.named,
                    median(ours for ours, _ in rounds),
                    median(peer for _, peer in rounds),
                    median(peer / ours for ours, peer in rounds),
                    comparison.held_to,
                )
            )
            print(f"{comparison.work}: {results[-1].ratio:.3g} x", flush=True)
    _show(results, arguments.hours)
    if arguments.json:
        arguments.json.write_text(json.dumps([asdict(result) for result in results], indent=2))


def _timed(work: Callable[[Bench], object], bench: Bench) -> float:
    start = time.perf_counter()
    work(bench)
    return time.perf_counter() - start


def _show(results: list[Result], hours: float) -> None:
    table = Table(title=f"{hours:g} h of four channels at 10 Hz", title_justify="left")
    for column in ("work", "against", "ours [s]", "peer [s]", "ratio", "held to"):
        table.add_column(column, justify="left" if column in ("work", "against") else "right")
    for r in results:
        figures = (f"{r.ours_secs:.3g}", f"{r.peer_secs:.3g}", f"{r.ratio:.3g}", f"{r.held_to:g}")
        table.add_row(r.work, r.peer, *figures)
    Console().print(table)


if __name__ == "__main__":
    main()
