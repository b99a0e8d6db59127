"""The verb `decode`: decode the raw packets of a log again."""

import argparse

from shiplog.cli.console import print_tables, print_warnings, progress
from shiplog.cli.options import assigned_texts
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG", help="a log with raw packets")
    parser.add_argument("-o", "--output", required=True, metavar="FILE", help="the log to write")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="STREAM.OPTION=VALUE",
        help="an option of a stream's format that differs from that of the recording, such as "
        "bridge.time=gnss",
    )


def _decode(arguments: argparse.Namespace) -> ExitCode:
    """Write the log anew from its raw packets."""
    require_inputs(arguments.log)
    require_outputs(arguments.output)
    require_suffix(".mcap", arguments.output)
    require_distinct([arguments.output], [arguments.log])
    from recorders.decoded_source import open_raw
    from recorders.record import record
    from recorders.trial.stream_tables import stream_tables

    changes = assigned_texts(arguments.set, "--set", "bridge.time=gnss")
    source = open_raw(arguments.log, changes)
    with progress() as on_progress:
        recording = record(
            source, arguments.output, on_chunk=lambda n: on_progress(f"decode: {n} samples")
        )
    print_tables(stream_tables(source.recorded.streams))
    print_warnings(source.log.warnings)  # known when it was read to its end
    print(
        f"{arguments.output}: {recording.samples} samples of {recording.channels} channels, "
        f"{source.old_channels} before"
    )
    return ExitCode.DATA_LOST if source.log.data_lost else ExitCode.OK


DECODE = Verb(
    "decode the raw packets of a log again",
    _configure,
    _decode,
    (
        "shiplog decode old.mcap -o new.mcap",
        "shiplog decode old.mcap -o new.mcap --set bridge.time=gnss",
    ),
)
