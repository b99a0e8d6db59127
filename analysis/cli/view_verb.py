"""The verb view: show logs as recorded in Rerun, without a replay."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.console import print_warnings, progress
from shiplog.cli.options import add_cut_options
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError, UsageError
from shiplog.mcap.part_names import log_stem

from .shared_options import show_review

if TYPE_CHECKING:
    from analysis.view.log_drawing import LogDrawing
    from shiplog.checks.log_content import LogInfo
    from shiplog.text_table import TextTable
    from shiplog.types import Log


def _configure_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log",
        metavar="LOG",
        nargs="+",
        type=Path,
        help="a log or a table; several are drawn over each other",
    )
    parser.add_argument(
        "--align",
        choices=("execute", "start"),
        help="from what times count: the execute of each log's first manoeuvre (default of "
        "several logs), or its start (default of one log)",
    )
    parser.add_argument(
        "--layout",
        type=Path,
        help="the columns of a foreign table, or the topics and fields of a foreign MCAP file",
    )
    add_cut_options(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        help="write the review to this .rrd file and open no viewer "
        "(default: LOG's name with .view.rrd, here, and the viewer opens it)",
    )
    parser.add_argument(
        "--full", action="store_true", help="every sample in the review, not what a screen can show"
    )


def _view(arguments: argparse.Namespace) -> ExitCode:
    output = _output(arguments)
    from analysis.report.markdown import markdown_page
    from analysis.view.log_drawing import draw_log
    from analysis.view.log_review import write_log_review
    from shiplog.checks.info import describe_log
    from shiplog.tables.any_log import open_any_log

    align = arguments.align or ("execute" if len(arguments.log) > 1 else "start")
    drawings, infos = [], []
    with progress("analysis") as on_progress:
        for number, path in enumerate(arguments.log):
            on_progress(f"read {path.name}", number / len(arguments.log))
            log = open_any_log(path, arguments.layout, arguments.start, arguments.end)
            drawings.append(draw_log(log, full=arguments.full))
            infos.append(describe_log(log, drawings[-1].stats))
            if align == "execute":
                drawings[-1] = _aligned(log, drawings[-1])
            elif len(arguments.log) == 1:
                drawings[-1] = _with_manoeuvres(log, drawings[-1])
        on_progress("review")
        warnings = _warnings(drawings)
        title = " and ".join(info.name for info in infos)
        text = markdown_page(title, _tables(infos), warnings)
        write_log_review(drawings, output, text)
    print_warnings(warnings)
    show_review(output, view=arguments.output is None)
    return ExitCode.DATA_LOST if any(info.data_lost for info in infos) else ExitCode.OK


def _aligned(log: "Log", drawing: "LogDrawing") -> "LogDrawing":
    """Return a drawing aligned at the first execute, or as it is with a warning of the reason."""
    from analysis.trial.log_manoeuvres import find_log_manoeuvres
    from analysis.view.execute_alignment import aligned_at_execute, first_execute_of

    try:
        execute, reason = first_execute_of(find_log_manoeuvres(log)), "no manoeuvre was found"
    except ShiplogError as error:
        execute, reason = None, f"no manoeuvre could be looked for ({error})"
    if execute is not None:
        return aligned_at_execute(drawing, execute)
    warning = f"{reason}; times and track count from the log's start"
    return replace(drawing, warnings=(*drawing.warnings, warning))


def _with_manoeuvres(log: "Log", drawing: "LogDrawing") -> "LogDrawing":
    """Return a drawing with the manoeuvres of its log; as it is where the log shows no steering."""
    from analysis.trial.log_manoeuvres import find_log_manoeuvres

    try:
        return replace(drawing, manoeuvres=find_log_manoeuvres(log))
    except ShiplogError:
        return drawing


def _output(arguments: argparse.Namespace) -> Path:
    """Return the path of the review, after a check of all paths."""
    for path in arguments.log:
        if path.suffix == ".rrd":
            raise UsageError(f"a review, not a log; open it with: rerun {path}")
    output = arguments.output or Path(f"{log_stem(arguments.log[0])}.view.rrd")
    require_suffix(".rrd", output)
    require_distinct([output], arguments.log)
    require_inputs(*arguments.log, arguments.layout)
    require_outputs(output)
    return output


def _tables(infos: Sequence["LogInfo"]) -> list["TextTable"]:
    """Return the content of a log without its events, of which the review has a list."""
    from shiplog.cli.info_tables import info_overview, info_tables

    if len(infos) > 1:
        return [info_overview(infos)]
    return info_tables(replace(infos[0], events=()))


def _warnings(drawings: Sequence["LogDrawing"]) -> list[str]:
    """Return the warnings of all logs, which begin with their log where they are several."""
    if len(drawings) == 1:
        return list(drawings[0].warnings)
    return [f"{each.name}: {text}" for each in drawings for text in each.warnings]


VIEW = Verb(
    "show logs as recorded in Rerun, without a replay",
    _configure_view,
    _view,
    (
        "shiplog view trial.mcap",
        "shiplog view trial.mcap -o trial.view.rrd   (for a computer with a screen)",
        "shiplog view zigzag_1.mcap zigzag_2.mcap   (over each other, from their executes)",
        "shiplog view night.mcap day.mcap --align start   (from their starts)",
        "shiplog view bridge.csv --layout bridge.toml",
    ),
)
