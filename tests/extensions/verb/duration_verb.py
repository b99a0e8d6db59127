"""A verb that prints how long each log lasts, and which channels it has."""

import argparse

from shiplog import read
from shiplog.cli.console import print_tables
from shiplog.cli.paths import require_inputs
from shiplog.cli.verb import ExitCode, Verb
from shiplog.text_table import TextTable


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the verb's arguments to its parser."""
    parser.add_argument("log", nargs="+", metavar="LOG")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Print a table with one row per log."""
    require_inputs(*arguments.log)
    logs = [read(path) for path in arguments.log]
    rows = tuple((log.name, f"{log.duration_secs:.0f}", f"{len(log)}") for log in logs)
    print_tables([TextTable("Duration", ("log", "duration [s]", "channels"), rows)])
    return ExitCode.DATA_LOST if any(log.data_lost for log in logs) else ExitCode.OK


DURATION = Verb(
    "print the duration of logs", configure, run, ("shiplog duration monday.mcap tuesday.mcap",)
)
