"""The verb report: the manoeuvring indices of trials against the norm, as a page to sign."""

import argparse
import shlex

from shiplog.cli.console import print_line, print_tables, print_warnings, progress, write_json
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb
from shiplog.files import atomic_write

from .shared_options import add_reading_options, reading_options

DEFAULT_PAGE = "report.html"


def _configure_report(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", nargs="+", metavar="LOG", help="logs of one ship")
    add_reading_options(parser)
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
    options = reading_options(arguments)
    outputs = (arguments.output, arguments.pdf, arguments.json)
    require_suffix(".html", arguments.output)
    require_suffix(".pdf", arguments.pdf)
    require_distinct(outputs, [*arguments.log, arguments.vessel])
    require_inputs(*arguments.log)
    require_outputs(*outputs)
    from analysis.report.page.browser_pdf import find_browser, print_pdf
    from analysis.report.page.report_page import report_page
    from analysis.report.page.trial_json import trial_json
    from analysis.report.page.report_trials import LogPart, report_trials
    from analysis.report.page.trial_tables import trial_tables

    if arguments.pdf:
        find_browser()  # before the work
    with progress("analysis", lines=len(arguments.log) > 1) as on_progress:
        report = report_trials(
            [LogPart(path, arguments.start, arguments.end) for path in arguments.log],
            options,
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


def _command(arguments: argparse.Namespace) -> str:
    """Return the command line that makes the page again."""
    words = ["shiplog", "report", *arguments.log]
    for name in ("vessel", "length", "sensor_delay", "start", "end", "model"):
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
