"""What shiplog takes, against the straightforward way in the same run.

Each line times shiplog and its peer in turn, several rounds, and tells the median of the ratios:
machines are noisy, ratios in one run are not. Before, it is checked that both find the same. A
peer that would take hours is timed on the first minutes of the same log, and its time scaled up;
the table says on which share. Nothing is judged by the exit code: it is 0 however slow.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from . import files, filters, replays, windows
from .bench import Bench
from .logs import day_of_trial, write_repeated
from .measure import Result, compare, machine
from .report import Report, markdown, show
from .stages import our_stages

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from .measure import Line

THEMES = ("files", "filter", "windows", "info", "replay", "stages", "growth")
JUDGED_HOURS = 24.0  # a shorter log is held to nothing: what is fixed weighs too much in it
EPILOG = """\
The defaults take from half an hour to an hour on two cores, most of it the peers'; --growth
1,24,240,720 ten minutes more, and 5 GB in the folder for temporary files, which TMPDIR names;
what there is no room for is skipped. --full-peer takes some hours.
"""


def main() -> None:
    """Measure, and print what came out."""
    arguments = _parsed()
    with tempfile.TemporaryDirectory(prefix="shiplog-benchmarks-") as folder:
        report = _measured(arguments, Path(folder))
    show(report)
    if arguments.json:
        text = json.dumps(report.as_json(), indent=2, ensure_ascii=False)
        arguments.json.write_text(text + "\n", encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(markdown(report), encoding="utf-8")


def _parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--hours", type=float, help="of trial at 10 Hz (default: 24)")
    parser.add_argument("--rounds", type=int, help="of each line (default: 5)")
    parser.add_argument("--growth", type=_lengths, metavar="H,H", help="hours (default: 1,24)")
    parser.add_argument("--info-hours", type=float, help="of `info`'s file (default: 240)")
    parser.add_argument(
        "--peer-minutes", type=float, help="of the log for a slow peer (default: 15)"
    )
    parser.add_argument("--full-peer", action="store_true", help="the whole log for every peer")
    parser.add_argument(
        "--short", action="store_true",
        help="every line on a quarter of an hour, one round: whether it runs, in a minute",
    )  # fmt: skip
    parser.add_argument("--only", nargs="+", choices=THEMES, default=THEMES, metavar="THEME",
                        help=f"of {', '.join(THEMES)}")  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    usual = (24.0, 5, [1.0, 24.0], 240.0, 15.0)
    short = (0.25, 1, [0.1, 0.25], 0.5, 5.0)
    names = ("hours", "rounds", "growth", "info_hours", "peer_minutes")
    for name, value in zip(names, short if arguments.short else usual, strict=True):
        if getattr(arguments, name) is None:
            setattr(arguments, name, value)
    return arguments


def _lengths(said: str) -> list[float]:
    return [float(hours) for hours in said.split(",")]


def _measured(arguments: argparse.Namespace, folder: Path) -> Report:
    log = day_of_trial(arguments.hours)
    path = write_repeated(log, arguments.hours, folder / "day.mcap")
    secs = 3600 * arguments.hours if arguments.full_peer else 60 * arguments.peer_minutes
    bench = Bench(log, path, folder, min(secs, 3600 * arguments.hours), arguments.info_hours)
    report = Report(machine(), arguments.hours, arguments.rounds, [])
    themes: dict[str, Callable[[], Iterable[Line]]] = {
        "files": lambda: files.lines(bench),
        "filter": lambda: filters.lines(bench),
        "windows": lambda: windows.lines(bench),
        "info": lambda: files.info_line(bench),
        "replay": lambda: replays.lines(bench, report.peer_stages),
    }
    for theme in (name for name in themes if name in arguments.only):
        results = []
        for line in themes[theme]():
            results.append(compare(line, arguments.rounds, judged=arguments.hours >= JUDGED_HOURS))
            _tell(results[-1])
        even = windows.evenness(results, judged=arguments.hours >= JUDGED_HOURS)
        report.results.extend([*results, even] if even else results)
    if "stages" in arguments.only:
        report.our_stages.update(our_stages(path, folder / "stages.rrd"))
    if "growth" in arguments.only:
        report.growth = replays.growth(log, arguments.growth, folder, arguments.rounds)
    return report


def _tell(result: Result) -> None:
    said = result.skipped if result.ratio is None else f"{result.ratio:.3g} x"
    print(f"{result.work}, against {result.against}: {said}", flush=True)


if __name__ == "__main__":
    main()
