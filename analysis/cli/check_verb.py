"""The verb check: compare replays with their references."""

import argparse
import os
from pathlib import Path

from shiplog.cli.console import print_line, print_lines, progress, write_json
from shiplog.cli.paths import (
    require_distinct,
    require_outputs,
)
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError, UsageError


def _configure_check(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", type=Path, help="a log or a folder of logs")
    parser.add_argument(
        "--update", action="store_true", help="after inspection: make the replays the references"
    )
    parser.add_argument("--json", metavar="FILE", help="write the comparison as JSON; - is stdout")


def _check(arguments: argparse.Namespace) -> ExitCode:
    if arguments.update and os.environ.get("CI"):
        raise UsageError(
            "references are not updated in CI; update them where someone inspects them"
        )
    require_outputs(arguments.json)
    from analysis.check.compare import (
        compare,
        comparison_json,
        logs_in,
        reference_path,
        update_reference,
    )

    comparisons = []
    logs = logs_in(arguments.path)
    require_distinct([arguments.json], [*logs, *map(reference_path, logs)])
    with progress("analysis") as on_progress:
        for number, log in enumerate(logs):
            on_progress(f"log {number + 1} of {len(logs)}: {log.name}", number / len(logs))
            comparisons.append(compare(log))
    for comparison in comparisons:
        print_lines(str(comparison), to_stderr=arguments.json == "-")
    if arguments.json:
        write_json([comparison_json(comparison) for comparison in comparisons], arguments.json)
    if arguments.update:
        unusable = [c.name for c in comparisons if c.replay is None]
        if unusable:
            raise ShiplogError(
                f"no reference was updated: {', '.join(unusable)} cannot be replayed"
            )
        for log, comparison in zip(logs, comparisons, strict=True):
            update_reference(log, comparison)
            print_line(f"updated: {reference_path(log)}", to_stderr=True)
        return ExitCode.OK
    for comparison in comparisons:
        if comparison.changed:
            from analysis.check.overlay import write_overlay

            overlay = Path(f"{Path(comparison.name).stem}.check.rrd")
            write_overlay(comparison, overlay)
            print_line(f"replay and reference, overlaid: {overlay}", to_stderr=True)
    return ExitCode.OK if all(comparison.ok for comparison in comparisons) else ExitCode.FAILURE


CHECK = Verb(
    "compare replays with their references",
    _configure_check,
    _check,
    ("shiplog check sample_data", "shiplog check trial.mcap --update"),
)
