"""The verb report: the manoeuvring indices of trials against the norm, as a page to sign."""

import argparse
import shlex
from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING

from shiplog.cli.console import print_line, print_tables, print_warnings, progress, write_json
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import UsageError
from shiplog.files import atomic_write

from .shared_options import (
    add_antenna_option,
    add_reading_options,
    antenna_place,
    finite_numbers,
    reading_options,
)

if TYPE_CHECKING:
    from analysis.trial.trial_options import TrialOptions

DEFAULT_PAGE = "report.html"
MAX_TEST_SPEED = 50.0  # m/s
MAX_COMPASS_ERROR_DEG = 10.0
VALUES = (  # the options with one value, by their names in the parsed arguments
    "vessel", "length", "sensor_delay", "start", "end",
    "start_rule", "execute", "antenna", "test_speed", "compass_error", "model",
)  # fmt: skip


def _configure_report(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", nargs="+", metavar="LOG", help="logs of one ship")
    add_reading_options(parser)
    parser.add_argument(
        "--start-rule",
        choices=("order", "moved", "event", "stated"),
        help="where a manoeuvre begins: at the rudder's order or, without orders in the log, its "
        "movement (default), when it has moved by 0.5°, at a marked event, or as --execute states",
    )
    parser.add_argument(
        "--execute",
        metavar="SECS",
        help="the executes, s since the log's start, such as 60 or 60,900; the rule is then stated",
    )
    add_antenna_option(parser)
    parser.add_argument(
        "--test-speed", type=float, metavar="M/S", help="V of the norm (default: the log's)"
    )
    parser.add_argument(
        "--compass-error",
        type=float,
        metavar="DEG",
        help="standard uncertainty of the compass in a change of heading, ° (default: that of "
        "the vessel file, or else 0.25 times the secant of the latitude, of IMO A.821(19), 4.1.2)",
    )
    parser.add_argument(
        "--model",
        metavar="NAME",
        help="identify this ship model from all logs too, as `shiplog identify` does; auto chooses",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        default=DEFAULT_PAGE,
        help="the page (default: %(default)s)",
    )
    parser.add_argument(
        "--pdf",
        metavar="FILE",
        help="print the page to PDF, by an installed Chromium, Chrome or Edge",
    )
    parser.add_argument("--json", metavar="FILE", help="write the numbers as JSON; - is stdout")


def _report(arguments: argparse.Namespace) -> ExitCode:
    options, trial_options = reading_options(arguments), _trial_options(arguments)
    outputs = (arguments.output, arguments.pdf, arguments.json)
    require_suffix(".html", arguments.output)
    require_suffix(".pdf", arguments.pdf)
    require_distinct(outputs, [*arguments.log, arguments.vessel])
    require_inputs(*arguments.log)
    require_outputs(*outputs)
    from analysis.report.page.browser_pdf import find_browser, print_pdf
    from analysis.report.page.report_page import report_page
    from analysis.report.page.report_trials import ReportPart, report_trials
    from analysis.report.page.trial_json import trial_json
    from analysis.report.page.trial_tables import trial_tables

    if arguments.pdf:
        find_browser()  # before the work
    with progress("analysis", lines=arguments.model is not None) as on_progress:
        report = report_trials(
            [ReportPart(path, arguments.start, arguments.end) for path in arguments.log],
            options,
            trial_options,
            model=arguments.model,
            command=_command(arguments),
            on_progress=on_progress,
        )
        page = report_page(report, on_progress)
        with atomic_write(arguments.output) as part:
            part.write_text(page, encoding="utf-8")
        if arguments.pdf:
            on_progress("print")
            print_pdf(page, arguments.pdf)
    if arguments.json:
        write_json(trial_json(report), arguments.json)
    print_tables(trial_tables(report), to_stderr=arguments.json == "-")
    print_warnings(report.warnings)
    for path in filter(None, (arguments.output, arguments.pdf)):
        print_line(f"report: {path}", to_stderr=True)
    return ExitCode.DATA_LOST if report.data_lost else ExitCode.OK


def _trial_options(arguments: argparse.Namespace) -> "TrialOptions":
    """Return the options of the analysis; raise `UsageError` where one cannot be used."""
    from analysis.manoeuvres.start_rules import StartRule
    from analysis.trial.trial_options import TrialOptions

    executes = finite_numbers(arguments.execute, "--execute", "60,900")
    antenna = antenna_place(arguments.antenna)
    rule = arguments.start_rule or ("stated" if executes else "order")
    if (rule == "stated") != bool(executes):
        raise UsageError("the start rule stated needs --execute SECS, and no other rule takes it")
    if arguments.test_speed is not None and not 0 < arguments.test_speed < MAX_TEST_SPEED:
        raise UsageError(
            f"--test-speed takes m/s between 0 and {MAX_TEST_SPEED:g}, not {arguments.test_speed:g}"
        )
    error_deg = arguments.compass_error
    if error_deg is not None and not 0 <= error_deg <= MAX_COMPASS_ERROR_DEG:
        raise UsageError(
            f"--compass-error takes degrees from 0 to {MAX_COMPASS_ERROR_DEG:g}, not {error_deg:g}"
        )
    options = TrialOptions(
        StartRule(rule),
        execute_secs=executes,
        antenna_forward=antenna[0],
        antenna_starboard=antenna[1],
        test_speed=arguments.test_speed,
    )
    return options if error_deg is None else replace(options, compass_change_std=radians(error_deg))


def _command(arguments: argparse.Namespace) -> str:
    """Return the command line that makes the page again."""
    words = ["shiplog", "report", *arguments.log]
    for name in VALUES:
        value = getattr(arguments, name)
        if value is not None:
            flag = {"start": "from", "end": "to"}.get(name, name.replace("_", "-"))
            words.append(f"--{flag}={value}")
    words += [f"--source={each}" for each in arguments.source]
    words += [f"--derive={each}" for each in arguments.derive]
    words += ["--strict"] * arguments.strict
    return shlex.join([*words, "-o", arguments.output])


REPORT = Verb(
    "compare the manoeuvres of trials with IMO's standards, on a page to sign",
    _configure_report,
    _report,
    (
        "shiplog report circle.mcap zigzag.mcap --vessel my_ship.toml -o report.html",
        "shiplog report day.mcap --length 320 -o report.html --pdf report.pdf --json report.json",
    ),
)
