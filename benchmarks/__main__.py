"""The time of each piece of work and of the whole replay, as a ratio to a peer in the same run.

The theme `distortions` is not of times: it replays one trial distorted in 200 ways, identifies some
of them, and counts the wrong results that are not reported; and it replays undistorted trials in
many conditions with fifty seeds and counts their warnings. Nor is `prediction`: it identifies
reference ships from simulated zig-zags, predicts circles and zig-zags, and reports the errors.

Each line times shiplog and a straightforward peer in turn, several rounds, and reports the median
of the ratios: times differ between machines and moments, ratios within one run hardly do. Before,
it is verified that both compute the same. A peer that would take hours is timed on the first
minutes of the same log, and its time is scaled up; the table states the share. No result affects
the exit code: it is 0 however slow.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from . import files, filters, ranking, replays, start_up, states, windows
from .bench import Bench
from .distortion_matrix import measure_distortions
from .logs import day_of_trial, write_repeated
from .measure import Comparison, ComparisonResult, compare_with_peer, machine
from .prediction import ONE_SEED_STUDY, SHORT_STUDY, measure_study
from .report import BenchmarkReport, print_report, report_as_markdown
from .stages import our_stages

THEMES = (
    "files", "filter", "windows", "info", "start-up", "replay", "states", "ranking", "stages",
    "growth", "distortions", "prediction",
)  # fmt: skip
UNTIMED_THEMES = {"distortions", "prediction"}
MIN_JUDGED_HOURS = 24.0  # in shorter logs fixed costs count too much for the limits
EPILOG = """\
The defaults take an hour or more on two cores, most of it for the peers and the predictions.
--growth 1,24,240,720 takes ten minutes more, and 5 GB in the folder of temporary files, which
TMPDIR names; logs too long for the disk are skipped. --full-peer takes some hours.
"""


@dataclass(frozen=True)
class Sizes:
    """The sizes of the inputs; lengths in hours unless the name states another unit."""

    hours: float
    rounds: int
    growth: tuple[float, ...]
    info_hours: float
    peer_minutes: float


DEFAULT = Sizes(24.0, 5, (1.0, 24.0), 240.0, 15.0)
SHORT = Sizes(0.06, 1, (0.02, 0.05), 0.15, 3.5)  # the peer of the replay needs 205 s


def main() -> None:
    """Measure, and print the results."""
    arguments = _parser().parse_args()
    with tempfile.TemporaryDirectory(prefix="shiplog-benchmarks-") as folder:
        report = _measure(arguments, Path(folder))
    print_report(report)
    if arguments.json:
        text = json.dumps(report.as_json(), indent=2, ensure_ascii=False)
        arguments.json.write_text(text + "\n", encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(report_as_markdown(report), encoding="utf-8")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--hours", type=float, help="length of the log (default: 24)")
    parser.add_argument("--rounds", type=int, help="rounds of each line (default: 5)")
    parser.add_argument(
        "--growth", type=_lengths, metavar="H,H", help="lengths of the logs in h (default: 1,24)"
    )
    parser.add_argument(
        "--info-hours", type=float, help="length of the file for `shiplog info` (default: 240)"
    )
    parser.add_argument(
        "--peer-minutes", type=float, help="length of the log for a slow peer (default: 15)"
    )
    parser.add_argument("--full-peer", action="store_true", help="the whole log for every peer")
    parser.add_argument(
        "--short", action="store_true",
        help="every line on a log of four minutes, one round: verifies that each runs",
    )  # fmt: skip
    parser.add_argument("--only", nargs="+", choices=THEMES, default=THEMES, metavar="THEME",
                        help=f"some of {', '.join(THEMES)}")  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results as JSON")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables")
    return parser


def _lengths(text: str) -> tuple[float, ...]:
    return tuple(float(hours) for hours in text.split(","))


def _sizes(arguments: argparse.Namespace) -> Sizes:
    """Return the sizes given as options; the others by default."""
    given = {name: getattr(arguments, name) for name in Sizes.__dataclass_fields__}
    default = SHORT if arguments.short else DEFAULT
    return replace(default, **{name: value for name, value in given.items() if value is not None})


def _measure(arguments: argparse.Namespace, folder: Path) -> BenchmarkReport:
    sizes = _sizes(arguments)
    report = BenchmarkReport(machine(), sizes.hours, sizes.rounds, [])
    if "distortions" in arguments.only:
        report.distortions = measure_distortions(*((5, 1) if arguments.short else ()))
    if "prediction" in arguments.only:
        report.prediction = measure_study(SHORT_STUDY if arguments.short else ONE_SEED_STUDY)
    if set(arguments.only) <= UNTIMED_THEMES:
        return report
    log = day_of_trial(sizes.hours)
    path = write_repeated(log, sizes.hours, folder / "day.mcap")
    log_secs = 3600 * sizes.hours
    peer_secs = log_secs if arguments.full_peer else min(60 * sizes.peer_minutes, log_secs)
    bench = Bench(log, path, folder, peer_secs, sizes.info_hours, arguments.short)
    judged = sizes.hours >= MIN_JUDGED_HOURS
    for theme, lines in _themes(bench, report).items():
        if theme not in arguments.only:
            continue
        for line in lines():
            report.results.append(compare_with_peer(line, sizes.rounds, judged=judged))
            _print_result(report.results[-1])
        dependence = windows.length_dependence(report.results, judged=judged)
        if theme == "windows" and dependence:
            report.results.append(dependence)
    if "stages" in arguments.only:
        report.our_stages.update(our_stages(path, folder / "stages.rrd"))
    if "growth" in arguments.only:
        report.growth = replays.measure_growth(log, sizes.growth, folder, sizes.rounds)
    return report


def _themes(bench: Bench, report: BenchmarkReport) -> dict[str, Callable[[], Iterable[Comparison]]]:
    """Return the functions that make the lines of each theme."""
    return {
        "files": lambda: files.file_lines(bench),
        "filter": lambda: filters.filter_lines(bench),
        "windows": lambda: windows.window_lines(bench),
        "info": lambda: files.info_lines(bench),
        "start-up": lambda: start_up.start_up_lines(bench),
        "replay": lambda: replays.replay_lines(bench, report.peer_stages),
        "states": lambda: states.state_lines(bench),
        "ranking": lambda: ranking.ranking_lines(bench),
    }


def _print_result(result: ComparisonResult) -> None:
    ratio = f"skipped: {result.skipped}" if result.ratio is None else f"{result.ratio:.3g} x"
    print(f"{result.work}, against {result.against}: {ratio}", flush=True)


if __name__ == "__main__":
    main()
