"""The verb estimate: run any linear system's estimator over the channels of a log."""

import argparse
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.console import print_tables, print_warnings, progress, write_json
from shiplog.cli.options import (
    add_cut_options,
    add_derive_option,
    add_source_option,
    assigned_sources,
    open_cut,
)
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError, UsageError

from .shared_options import show_review

if TYPE_CHECKING:
    from analysis.linear.estimate_plan import EstimatePlan
    from analysis.view.estimate_review import EstimateReview


def _configure_estimate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG")
    parser.add_argument(
        "--system",
        required=True,
        metavar="FILE",
        help="the system file: plant, channels, noise, disturbances, method "
        "(docs/linear_systems.md)",
    )
    parser.add_argument(
        "--smooth", action="store_true", help="smooth the states backwards from the end"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="the review, an .rrd file")
    parser.add_argument("--view", action="store_true", help="open the review in the Rerun viewer")
    parser.add_argument("--json", metavar="FILE", help="write the results as JSON; - is stdout")
    add_source_option(parser)
    add_derive_option(parser)
    add_cut_options(parser)


def _estimate(arguments: argparse.Namespace) -> ExitCode:
    output = _review_path(arguments)
    require_distinct([output, arguments.json], [arguments.log, arguments.system])
    require_inputs(arguments.log, arguments.system)
    require_outputs(output, arguments.json)
    from analysis.linear.estimate import EstimateRun
    from analysis.linear.estimate_plan import plan_estimate
    from analysis.linear.system_file import load_system
    from analysis.replay.reading_options import ReadingOptions
    from analysis.report.estimate_json import estimate_json
    from analysis.report.estimate_tables import estimate_markdown, estimate_tables

    system = load_system(arguments.system)
    options = ReadingOptions(
        sources=assigned_sources(arguments.source), derive=tuple(arguments.derive)
    )
    with progress("analysis") as on_progress:
        log = open_cut(arguments.log, arguments)
        try:
            plan = plan_estimate(log, system, options, on_progress, smooth=arguments.smooth)
        except ShiplogError:
            print_warnings(log.warnings)  # they may explain the error
            raise
        run = EstimateRun(log, plan, on_progress=on_progress)
        with _open_review(plan, output) as review:
            for chunk in run.chunks():
                if review:
                    review.add(chunk)
            findings = run.findings
            if review:
                review.finish(estimate_markdown(findings))
    if arguments.json:
        write_json(estimate_json(findings), arguments.json)
    print_tables(estimate_tables(findings), to_stderr=arguments.json == "-")
    print_warnings(findings.warnings)
    if output:
        show_review(output, view=arguments.view)
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


def _review_path(arguments: argparse.Namespace) -> Path | None:
    """Return the path of the review; None where none is asked for."""
    if arguments.output is None:
        if arguments.view:
            raise UsageError("--view shows the review; name its file with -o, such as -o roll.rrd")
        return None
    output = Path(arguments.output)
    require_suffix(".rrd", output)
    return output


def _open_review(
    plan: "EstimatePlan", output: Path | None
) -> AbstractContextManager["EstimateReview | None"]:
    """Open the review; without a path a context that holds none."""
    if output is None:
        return nullcontext()
    from analysis.view.estimate_review import open_estimate_review

    return open_estimate_review(plan, output)


ESTIMATE = Verb(
    "estimate the states of any linear system from the channels of a log",
    _configure_estimate,
    _estimate,
    (
        "shiplog estimate trial.mcap --system roll.toml",
        "shiplog estimate trial.mcap --system heading.toml -o heading.rrd --json heading.json",
    ),
    unneeded=("pandas", "numpy.f2py"),
)
