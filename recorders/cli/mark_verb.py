"""The verb `mark`: add an event to a running recording."""

import argparse

from shiplog.cli.console import print_line
from shiplog.cli.verb import ExitCode, Verb


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG", help="the log that is recorded")
    parser.add_argument("text", metavar="TEXT", help="what happened, in one line")


def _mark(arguments: argparse.Namespace) -> ExitCode:
    """Send the mark, and confirm that the recorder has taken it."""
    from recorders.trial.marks import send_mark

    send_mark(arguments.log, arguments.text)
    print_line(f"marked in {arguments.log}: {arguments.text}")
    return ExitCode.OK


MARK = Verb(
    "mark an event in a running recording",
    _configure,
    _mark,
    ('shiplog mark trial.mcap "execute, 20 starboard"',),
)
