"""The verb replay: estimate states, disturbances and coefficients from a log."""

import argparse
from pathlib import Path

from shiplog.cli.console import print_tables, print_warnings, progress, write_json
from shiplog.cli.options import (
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
from shiplog.mcap.part_names import log_stem
from shiplog.toml_text import parse_toml
from shiplog.vessel.settings import DISTURBANCE_CHOICES, SENSOR_ERRORS

from .shared_options import add_reading_options, reading_options, show_review


def _configure_replay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG")
    add_reading_options(parser)
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
        "--sensor-bias",
        metavar="SENSORS",
        help="sensor errors to estimate with the states: auto for those that the log determines, "
        f"or some of {','.join(SENSOR_ERRORS)}; heading and position are then measurements too",
    )
    parser.add_argument(
        "--disturbance",
        metavar="MODELS",
        help=f"the disturbances to estimate, some of {','.join(DISTURBANCE_CHOICES)} "
        "(default: constant); wind needs --smooth and the channels of the wind",
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
    options = reading_options(arguments)
    output = _replay_output(arguments)
    from analysis.replay.plan import plan_replay
    from analysis.replay.precompile import compile_tests, compiling_beside
    from analysis.replay.replay import Replay
    from analysis.report.replay_json import replay_json
    from analysis.report.replay_tables import replay_markdown, replay_tables

    with (
        progress("analysis") as on_progress,
        compiling_beside(
            arguments.filter,
            smooth=arguments.smooth,
            sensors=arguments.sensor_bias is not None,
        ) as compilation,
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
            compile_tests()
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
    show_review(output, view=arguments.view)
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


def _replay_output(arguments: argparse.Namespace) -> Path:
    """Return the path of the review, after a check of all paths."""
    if Path(arguments.log).suffix == ".rrd":
        raise UsageError(f"a review, not a log; open it with: rerun {arguments.log}")
    output = Path(arguments.output or f"{log_stem(Path(arguments.log))}.rrd")
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
            table = parse_toml(f"value = {value}", text, "setting", UsageError)
            found[name] = table["value"] if equals else None
        except UsageError:
            found[name] = value  # a word needs no quotes here
        if not (name and value):
            raise UsageError(f"--set takes KEY=VALUE, such as filter.gate=4, not {text!r}")
    if parsed.filter:
        found["filter.kind"] = parsed.filter
    if parsed.disturbance is not None:
        found["disturbance.models"] = [model.strip() for model in parsed.disturbance.split(",")]
    if parsed.sensor_bias is not None:
        found["filter.sensor_bias"] = parsed.sensor_bias
    flags = {"filter.smooth": parsed.smooth, "filter.wave": parsed.wave}
    return found | {name: True for name, given in flags.items() if given}


REPLAY = Verb(
    "estimate states, disturbances and coefficients from a log",
    _configure_replay,
    _replay,
    (
        "shiplog replay trial.mcap",
        "shiplog replay trial.mcap --vessel my_ship.toml -o run.rrd --json run.json",
        "shiplog replay trial.mcap --filter extended --smooth --set filter.process_ratio=auto",
        "shiplog replay trial.mcap --filter extended --smooth --sensor-bias auto",
    ),
    # pyarrow imports pandas to recognise data frames; scipy imports all names of numpy
    unneeded=("pandas", "numpy.f2py"),
)
