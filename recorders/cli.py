"""The verb `record`: one subcommand for each installed source of samples."""

import argparse
import sys
from pathlib import Path
from typing import Any

from shiplog.cli.console import progress
from shiplog.cli.paths import require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError
from shiplog.extensions import extension_names, load_extension
from shiplog.files import is_device

from .source import RecorderCommand

GROUP = "shiplog.recorders"


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add a subcommand for each source; one that cannot be loaded reports it when used."""
    sources = parser.add_subparsers(metavar="SOURCE", required=True)
    for name in extension_names(GROUP):
        try:
            command = load_extension(GROUP, name, RecorderCommand, "recorder")
        except ShiplogError as error:
            _add_unloadable(sources, name, error)
            continue
        own = sources.add_parser(
            name,
            help=command.help,
            description=f"{command.help[0].upper()}{command.help[1:]}.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.configure(own)
        own.add_argument("-o", "--output", required=True, metavar="FILE", help="the log to write")
        own.set_defaults(recorder=command)


def _add_unloadable(sources: Any, name: str, error: ShiplogError) -> None:  # noqa: ANN401 - argparse's private class
    """Add a subcommand that accepts any arguments and reports the error."""

    def report(_: argparse.Namespace) -> Any:  # noqa: ANN401 - it never returns
        raise error

    # with this prefix no argument is an option, so that none is rejected before the report
    own = sources.add_parser(
        name, help="(cannot be loaded; use it to see why)", prefix_chars="\0", add_help=False
    )
    own.add_argument("arguments", nargs="*")
    own.set_defaults(recorder=RecorderCommand("", lambda _: None, report), output=None)


def _record(arguments: argparse.Namespace) -> ExitCode:
    """Open the source that was asked for and write it to the log."""
    command: RecorderCommand[Any] = arguments.recorder
    require_outputs(arguments.output)
    require_suffix(".mcap", arguments.output)
    source = command.open(arguments)
    from .record import record

    with progress() as on_progress:
        on_progress("write")
        recording = record(
            source, arguments.output, on_chunk=lambda n: on_progress(f"write: {n} samples")
        )
        if not recording.interrupted:
            command.finish(arguments, source)
    output = Path(arguments.output)
    print(
        f"{output}: {recording.samples} samples of {recording.channels} channels",
        file=sys.stderr if is_device(output) else sys.stdout,
    )
    if recording.interrupted:
        print("interrupted: the log ends there", file=sys.stderr)
    return ExitCode.OK


RECORD = Verb(
    "record sensor streams to a log",
    _configure,
    _record,
    ("shiplog record simulate zigzag-20-20 --seed 1 --duration 600 -o trial.mcap",),
)
