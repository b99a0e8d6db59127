"""The verb `record`: a trial file, or one subcommand for each installed source of samples."""

import argparse
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from recorders.record import Recording
from recorders.source import RecorderCommand
from recorders.streams.format import GROUP as FORMAT_GROUP
from recorders.streams.format import StreamFormat
from shiplog.cli.console import print_line, progress
from shiplog.cli.verb import ExitCode, Verb
from shiplog.errors import ShiplogError, UsageError
from shiplog.extensions import extension_names, load_extension
from shiplog.files import claimed_name, is_device

from .output_options import add_output_options, recording_output

GROUP = "shiplog.recorders"
TRIAL = "trial"  # the source that `record FILE.toml` is short for
DRY_RUN_SECS = 10.0


def _expand(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with the source before the name of a trial file, or before an address.

    The source of an address is the format of what is received there.

    Examples
    --------
    >>> _expand(["--dry-run", "sea.toml"]), _expand(["nmea0183", "gyro.log"])
    (['--dry-run', 'trial', 'sea.toml'], ['nmea0183', 'gyro.log'])
    """
    at = next((i for i, text in enumerate(arguments) if not text.startswith("-")), None)
    if at is None:
        return list(arguments)
    if arguments[at].lower().endswith(".toml"):
        source = TRIAL
    elif set(arguments[:at]) <= {"--dry-run"} and _is_address(arguments[at]):
        source = _detected(arguments[at])
    else:
        return list(arguments)
    return [*arguments[:at], source, *arguments[at:]]


def _is_address(text: str) -> bool:
    """Whether a text is not the name of a source, but the address of one."""
    names = (TRIAL, *extension_names(GROUP), *extension_names(FORMAT_GROUP))
    return text not in names and (
        "://" in text or Path(text).is_file() or re.fullmatch(r"v?can\d+", text) is not None
    )


def _detected(address: str) -> str:
    """Return the format of what is received at an address, and report it."""
    from recorders.trial.format_detection import LISTEN_SECS, detect_stream_format

    if not Path(address).is_file():
        print_line(
            f"no format is stated: listening for up to {LISTEN_SECS:.0f} s to detect it",
            to_stderr=True,
        )
    name = detect_stream_format(address)
    print_line(f"the format is {name}: shiplog record {name} {address}", to_stderr=True)
    return name


def _configure(parser: argparse.ArgumentParser) -> None:
    """Add a subcommand for each source; one that cannot be loaded reports it when used."""
    _add_dry_run(parser, default=False)
    sources = parser.add_subparsers(metavar="SOURCE", dest="source_name", required=True)
    for name, command in _loaded(GROUP, RecorderCommand, "recorder", sources):
        own = _add_source(sources, name, command.help)
        command.configure(own)
        add_output_options(own, required=True)
        own.set_defaults(recorder=command)
    for name, stream_format in _loaded(FORMAT_GROUP, StreamFormat, "format", sources):
        from .stream_commands import configure_stream

        own = _add_source(sources, name, stream_format.help)
        configure_stream(own, stream_format)
        add_output_options(own, required=False)
        _add_dry_run(own)
        own.set_defaults(recorder=stream_format)
    own = _add_source(
        sources, TRIAL, "all sources of a trial file, into one log; `record FILE.toml` for short"
    )
    own.add_argument("trial", metavar="FILE", help="the trial file")
    add_output_options(own, required=False)
    _add_dry_run(own)
    own.set_defaults(recorder=None)


def _add_dry_run(parser: argparse.ArgumentParser, *, default: object = argparse.SUPPRESS) -> None:
    """Add the option before and after the source; the default stands before it."""
    parser.add_argument(
        "--dry-run",
        action="store_true",
        default=default,
        help=f"listen for {DRY_RUN_SECS:.0f} s, report what is heard, and write nothing",
    )


def _loaded(group: str, kind: type[Any], noun: str, sources: Any) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - argparse's private class
    """Yield the extensions of a group; the others become subcommands that report the error."""
    for name in extension_names(group):
        try:
            yield name, load_extension(group, name, kind, noun)
        except ShiplogError as error:
            _add_unloadable(sources, name, error)


def _add_source(sources: Any, name: str, text: str) -> argparse.ArgumentParser:  # noqa: ANN401 - argparse's private class
    parser: argparse.ArgumentParser = sources.add_parser(
        name,
        help=text,
        description=f"{text[0].upper()}{text[1:]}.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    return parser


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
    """Record what was asked for, or only listen to it."""
    if arguments.dry_run:
        return _listen(arguments)
    recording = _recorded(arguments)
    first, *others = recording.files
    names = f"{first} to {others[-1].name}" if others else str(first)
    print_line(
        f"{names}: {recording.samples} samples of {recording.channels} channels",
        to_stderr=is_device(first),
    )
    if recording.interrupted:
        print_line("interrupted: the log is whole, and ends there", to_stderr=True)
        return ExitCode.INTERRUPTED
    if not recording.samples:
        print_line(
            "shiplog: no sample was recorded; the events of the log state why", to_stderr=True
        )
        return ExitCode.FAILURE
    if recording.dropped:
        print_line(f"{recording.dropped} packets came too fast and were dropped", to_stderr=True)
        return ExitCode.DATA_LOST
    return ExitCode.OK


def _recorded(arguments: argparse.Namespace) -> Recording:
    """Record a trial file, a stream, or another source."""
    if arguments.recorder is None:
        from .stream_commands import record_trial

        return record_trial(arguments)
    if isinstance(arguments.recorder, RecorderCommand):
        return _record_command(arguments.recorder, arguments)
    from .stream_commands import record_stream

    return record_stream(arguments, arguments.recorder, recording_output(arguments))


def _record_command(command: RecorderCommand[Any], arguments: argparse.Namespace) -> Recording:
    """Open the source of a recorder and write it to the log.

    The name is claimed before: of two processes started together, the slower one would otherwise
    replace the other's log.
    """
    if arguments.output is None:  # the source could not be loaded
        command.open(arguments)
    output = recording_output(arguments)
    with claimed_name(output.log):
        source = command.open(arguments)
        from recorders.record import record

        with progress() as on_progress:
            on_progress("write")
            recording = record(
                source,
                output.log,
                rotation=output.rotation,
                sync_secs=output.sync_secs,
                on_chunk=lambda n: on_progress(f"write: {n} samples"),
            )
            if not recording.interrupted:
                command.finish(arguments, source)
    return recording


def _listen(arguments: argparse.Namespace) -> ExitCode:
    """Report what is heard, without writing anything."""
    if isinstance(arguments.recorder, RecorderCommand):
        raise UsageError("--dry-run is for trial files and for live sources")
    from .dry_run import listen_to_stream, listen_to_trial

    if arguments.recorder is None:
        return listen_to_trial(arguments.trial, DRY_RUN_SECS)
    return listen_to_stream(arguments, arguments.recorder, DRY_RUN_SECS)


RECORD = Verb(
    "record sensor streams to a log",
    _configure,
    _record,
    (
        "shiplog record simulate zigzag-20-20 --seed 1 --duration 600 -o trial.mcap",
        "shiplog record nmea0183 udp://127.0.0.1:10110 -o trial.mcap",
        "shiplog record nmea0183 gyro.log -o gyro.mcap",
        "shiplog record udp://0.0.0.0:10110 -o trial.mcap   (detects the format)",
        "shiplog record --dry-run trial.toml",
    ),
    expand=_expand,
)
