"""The verbs of the analysis: replay, identify, check."""

import argparse
import os
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.console import print_tables, print_warnings, progress, write_json
from shiplog.cli.options import (
    add_cut_options,
    add_source_option,
    assigned_numbers,
    assigned_sources,
    open_cut,
)
from shiplog.cli.paths import (
    require_distinct,
    require_inputs,
    require_outputs,
    require_suffix,
)
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError, UsageError
from shiplog.extensions import extension_names
from shiplog.files import atomic_write
from shiplog.vessel.settings import DISTURBANCES

if TYPE_CHECKING:
    from analysis.identification.identified_ship import IdentifiedShip
    from analysis.replay.reading_options import ReadingOptions
    from shiplog.types import Log

DEFAULT_REVIEW = "identified.rrd"


# ---- the options that replay and identify share


def _add_reading_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vessel", help="a preset or a vessel.toml, instead of the one that the log carries"
    )
    parser.add_argument(
        "--length",
        type=float,
        metavar="METRES",
        help="length between perpendiculars, such as 320; precedes that of the vessel file",
    )
    add_source_option(parser)
    parser.add_argument(
        "--strict", action="store_true", help="refuse a log with a contradiction in unit or sign"
    )
    add_cut_options(parser)


def _reading_options(arguments: argparse.Namespace) -> "ReadingOptions":
    from analysis.replay.reading_options import ReadingOptions
    from shiplog.vessel.vessel_parser import load_vessel

    sources = assigned_sources(arguments.source)
    vessel = load_vessel(arguments.vessel)[0] if arguments.vessel else None
    return ReadingOptions(vessel, arguments.length, sources, arguments.strict)


# ---- replay


def _configure_replay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG")
    _add_reading_options(parser)
    parser.add_argument(
        "--filter",
        metavar="NAME",
        help=f"the state estimator: {', '.join(extension_names('shiplog.filters'))} "
        "(default: that of the vessel file, else pseudo-input)",
    )
    parser.add_argument(
        "--smooth", action="store_true", help="smooth the states backwards from the end"
    )
    parser.add_argument(
        "--wave",
        action="store_true",
        help="separate the waves in the yaw rate from the ship's own turning "
        "(default filter then: extended)",
    )
    parser.add_argument(
        "--disturbance",
        metavar="MODELS",
        help=f"the disturbances to estimate, some of {','.join(DISTURBANCES)} (default: constant)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="any setting of the vessel file's [filter], [disturbance] and [identifier], such as "
        "filter.gate=4 or identifier.window_secs=300; auto estimates it from the log "
        "(docs/vessel.md)",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="the review (default: LOG's name with .rrd, here)"
    )
    parser.add_argument(
        "--full", action="store_true", help="every sample in the review, not what a screen can show"
    )
    parser.add_argument("--json", metavar="FILE", help="write the summary as JSON; - is stdout")
    parser.add_argument("--view", action="store_true", help="open the review in the Rerun viewer")


def _replay(arguments: argparse.Namespace) -> ExitCode:
    settings = replay_settings(arguments)
    options = _reading_options(arguments)
    output = _replay_output(arguments)
    from analysis.replay.plan import plan_replay
    from analysis.replay.precompile import compiling_beside
    from analysis.replay.replay import Replay
    from analysis.report.replay_json import replay_json
    from analysis.report.replay_tables import replay_markdown, replay_tables

    with (
        progress("analysis") as on_progress,
        compiling_beside(arguments.filter, smooth=arguments.smooth) as compilation,
    ):
        on_progress("read")
        log = open_cut(arguments.log, arguments)
        try:
            plan = plan_replay(log, options, settings=settings, on_progress=on_progress)
        except ShiplogError:
            print_warnings(log.warnings)  # they may explain the error
            raise
        from analysis.view.replay_review import open_replay_review

        if compilation:
            compilation.wait()
        replay = Replay(log, plan, on_progress=on_progress)
        with open_replay_review(plan, output, full=arguments.full) as review:
            for chunk in replay.chunks():
                review.add(chunk)
            findings = replay.findings
            on_progress("review")
            review.add_further_channels(log)
            review.finish(findings, replay_markdown(findings))
    if arguments.json:
        write_json(replay_json(findings), arguments.json)
    print_tables(replay_tables(findings), to_stderr=arguments.json == "-")
    print_warnings(findings.warnings)
    _show_review(output, view=arguments.view)
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


def _replay_output(arguments: argparse.Namespace) -> Path:
    """Return the path of the review, after a check of all paths."""
    if Path(arguments.log).suffix == ".rrd":
        raise UsageError(f"a review, not a log; open it with: rerun {arguments.log}")
    output = Path(arguments.output or f"{Path(arguments.log).stem}.rrd")
    require_suffix(".rrd", output)
    require_distinct([output, arguments.json], [arguments.log, arguments.vessel])
    require_inputs(arguments.log)
    require_outputs(output, arguments.json)
    return output


def replay_settings(parsed: argparse.Namespace) -> dict[str, object]:
    """Collect the settings that the command line gives, by their names in a vessel file."""
    found: dict[str, object] = {}
    for text in parsed.set:
        name, equals, value = text.partition("=")
        try:
            found[name] = tomllib.loads(f"value = {value}")["value"] if equals else None
        except tomllib.TOMLDecodeError:
            found[name] = value  # a word needs no quotes here
        if not (name and value):
            raise UsageError(f"--set takes KEY=VALUE, such as filter.gate=4, not {text!r}")
    if parsed.filter:
        found["filter.kind"] = parsed.filter
    if parsed.disturbance is not None:
        found["disturbance.models"] = [model.strip() for model in parsed.disturbance.split(",")]
    flags = {"filter.smooth": parsed.smooth, "filter.wave": parsed.wave}
    return found | {name: True for name, given in flags.items() if given}


def _show_review(path: str | Path, *, view: bool) -> None:
    print(f"review: {path} (open it with: rerun {path})", file=sys.stderr)
    if view:
        from analysis.view.viewer import view_review

        view_review(path)


# ---- identify


def _configure_identify(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG", nargs="+", help="logs of one ship, loaded alike")
    _add_reading_options(parser)
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
    options = _reading_options(arguments)
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
    print_tables(identification_tables(ship), to_stderr=arguments.json == "-")
    print_warnings(ship.warnings)
    if review:
        _show_review(review, view=arguments.view)
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
    print(f"vessel file: {path}{caution}", file=sys.stderr)
    for equation in undetermined_parts(ship):
        print(
            f"the vessel file gives no model, only comments: no parameter of the {equation} "
            "equation is identifiable from these logs; add the log of a zig-zag",
            file=sys.stderr,
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
        print(f"skipped, as references or simulated truths: {names}", file=sys.stderr)
    return [log for path, log in logs.items() if path not in skipped]


# ---- check


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
        print(comparison, file=sys.stderr if arguments.json == "-" else sys.stdout)
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
            print(f"updated: {reference_path(log)}", file=sys.stderr)
        return ExitCode.OK
    for comparison in comparisons:
        if comparison.changed:
            from analysis.check.overlay import write_overlay

            overlay = Path(f"{Path(comparison.name).stem}.check.rrd")
            write_overlay(comparison, overlay)
            print(f"replay and reference, overlaid: {overlay}", file=sys.stderr)
    return ExitCode.OK if all(comparison.ok for comparison in comparisons) else ExitCode.FAILURE


REPLAY = Verb(
    "estimate states, disturbances and coefficients from a log",
    _configure_replay,
    _replay,
    (
        "shiplog replay trial.mcap",
        "shiplog replay trial.mcap --vessel my_ship.toml -o run.rrd --json run.json",
        "shiplog replay trial.mcap --filter extended --smooth --set filter.process_ratio=auto",
    ),
    # pyarrow imports pandas to recognise data frames; scipy imports all names of numpy
    unneeded=("pandas", "numpy.f2py"),
)
IDENTIFY = Verb(
    "fit a ship model to logs, with intervals, and validate it on others",
    _configure_identify,
    _identify,
    (
        "shiplog identify zigzag.mcap --fix T3=0.5 -o vessel.toml",
        "shiplog identify zigzag.mcap random.mcap --model auto --validate circle.mcap",
    ),
)
CHECK = Verb(
    "compare replays with their references",
    _configure_check,
    _check,
    ("shiplog check sample_data", "shiplog check trial.mcap --update"),
)
