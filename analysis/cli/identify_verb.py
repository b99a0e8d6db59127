"""The verb identify: fit a ship model to logs, and validate it on others."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.console import print_line, print_tables, print_warnings, progress, write_json
from shiplog.cli.options import (
    assigned_numbers,
    open_cut,
)
from shiplog.cli.paths import (
    require_distinct,
    require_inputs,
    require_outputs,
    require_suffix,
)
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import UsageError
from shiplog.extensions import extension_names
from shiplog.files import atomic_write

from .shared_options import (
    add_antenna_option,
    add_reading_options,
    antenna_place,
    reading_options,
    show_review,
)

if TYPE_CHECKING:
    from analysis.identification.identified_ship import IdentifiedShip
    from shiplog.types import Log

DEFAULT_REVIEW = "identified.rrd"


def _configure_identify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG", nargs="+", help="logs of one ship, loaded alike")
    add_reading_options(parser)
    add_antenna_option(parser)
    parser.add_argument(
        "--model",
        metavar="NAME",
        help=f"{', '.join(extension_names('shiplog.ship_models'))}, or auto: the one with the "
        "smallest error in cross-validation (default: burylin; burylin-tied where T3 is fixed)",
    )
    parser.add_argument(
        "--validate",
        nargs="+",
        action="extend",
        default=[],
        metavar="LOG",
        help="logs to predict, not to fit",
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="fix a parameter instead of estimating it, such as T3=0.5",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="the vessel.toml, for simulation and replay"
    )
    parser.add_argument(
        "--review",
        metavar="FILE",
        help="an .rrd for Rerun: measured against simulated, residuals, coefficient histories",
    )
    parser.add_argument(
        "--view", action="store_true", help=f"open the review, else {DEFAULT_REVIEW}, in Rerun"
    )
    parser.add_argument("--json", metavar="FILE", help="write the result as JSON; - is stdout")


def _identify(arguments: argparse.Namespace) -> ExitCode:
    review = arguments.review or (DEFAULT_REVIEW if arguments.view else None)
    fixed = assigned_numbers(arguments.fix, "--fix", "T3=0.5")
    options = replace(reading_options(arguments), antenna=antenna_place(arguments.antenna))
    _require_identify_paths(arguments, review)
    from analysis.identification.identify import identify
    from analysis.identification.vessel_file import vessel_toml
    from analysis.report.identification_json import identification_json
    from analysis.report.identification_tables import identification_tables

    with progress("analysis", lines=arguments.model == "auto") as on_progress:
        on_progress("read")
        ship = identify(
            _measured_logs(arguments.log, arguments),
            arguments.model,
            validation_logs=_measured_logs(arguments.validate, arguments),
            fixed=fixed,
            options=options,
            on_progress=on_progress,
        )
        toml = vessel_toml(ship, on_progress) if arguments.output else ""
    if arguments.output:
        with atomic_write(arguments.output) as part:
            part.write_text(toml, encoding="utf-8")
    if arguments.json:
        write_json(identification_json(ship), arguments.json)
    if review:
        from analysis.view.identification_review import write_identification_review

        write_identification_review(ship, review)
    to_stderr = arguments.json == "-"
    print_tables(identification_tables(ship), to_stderr=to_stderr)
    if ship.no_predictions:
        print_line(f"no predicted manoeuvres: {ship.no_predictions}", to_stderr=to_stderr)
    print_warnings(ship.warnings)
    if review:
        show_review(review, view=arguments.view)
    if arguments.output:
        _report_vessel_file(arguments.output, ship)
    return ExitCode.DATA_LOST if ship.data_lost else ExitCode.OK


def _require_identify_paths(arguments: argparse.Namespace, review: str | None) -> None:
    """Check all paths, and that no log is named twice."""
    outputs = [arguments.output, arguments.json, review]
    fitted, held_out = (
        [str(Path(path).resolve()) for path in paths]
        for paths in (arguments.log, arguments.validate)
    )
    require_distinct(outputs, [*fitted, *held_out, arguments.vessel])
    require_suffix(".rrd", review)
    require_suffix(".toml", arguments.output)
    require_inputs(*arguments.log, *arguments.validate)
    require_outputs(*outputs)
    from analysis.identification.runs import require_distinct_logs

    require_distinct_logs(fitted, held_out)


def _report_vessel_file(path: str, ship: "IdentifiedShip") -> None:
    """Report the vessel file that was written, and what it cannot be used for."""
    from analysis.identification.vessel_file import undetermined_parts

    names = ", ".join(ship.uncertainty.unidentifiable)
    caution = f"; not identifiable, and valid for these logs only: {names}" if names else ""
    print_line(f"vessel file: {path}{caution}", to_stderr=True)
    for equation in undetermined_parts(ship):
        print_line(
            f"the vessel file gives no model, only comments: no parameter of the {equation} "
            "equation is identifiable from these logs; add the log of a zig-zag",
            to_stderr=True,
        )


def _measured_logs(paths: Sequence[str], arguments: argparse.Namespace) -> "list[Log]":
    """Open the logs that are of trials; report the references and truths that are skipped."""
    from analysis.identification.runs import is_measured

    logs = {path: open_cut(path, arguments) for path in paths}
    skipped = [path for path, log in logs.items() if not is_measured(log)]
    if skipped and len(skipped) == len(paths):
        raise UsageError(
            "references of `shiplog check` and simulated truths are no trials; give the logs "
            f"themselves, not {', '.join(skipped)}"
        )
    if skipped:
        names = ", ".join(Path(path).name for path in skipped)
        print_line(f"skipped, as references or simulated truths: {names}", to_stderr=True)
    return [log for path, log in logs.items() if path not in skipped]


IDENTIFY = Verb(
    "fit a ship model to logs, with intervals, and validate it on others",
    _configure_identify,
    _identify,
    (
        "shiplog identify zigzag.mcap --fix T3=0.5 -o vessel.toml",
        "shiplog identify zigzag.mcap random.mcap --model auto --validate circle.mcap",
    ),
)
