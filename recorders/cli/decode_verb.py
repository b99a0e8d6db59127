"""The verb `decode`: decode the raw packets of a log again."""

import argparse
from typing import TYPE_CHECKING

from shiplog.cli.console import print_line, print_tables, print_warnings, progress
from shiplog.cli.options import assigned_texts
from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.cli.verb import ExitCode, Verb

if TYPE_CHECKING:
    from recorders.source import Source


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
    from recorders.trial.stream_tables import stream_tables

    changes = assigned_texts(arguments.set, "--set", "bridge.time=gnss")
    source = open_raw(arguments.log, changes)
    samples, channels = _write(source, arguments.output)
    print_tables(stream_tables(source.recorded.streams))
    print_warnings(source.log.warnings)  # known when it was read to its end
    print_line(
        f"{arguments.output}: {samples} samples of {channels} channels, "
        f"{source.old_channels} before"
    )
    return ExitCode.DATA_LOST if source.log.data_lost else ExitCode.OK


def _write(source: "Source", output: str) -> tuple[int, int]:
    """Write the whole log, or nothing where it is interrupted; return the samples and channels."""
    from shiplog.files import atomic_write
    from shiplog.mcap.writer import LogWriter
    from shiplog.types import Channel

    topics = set[str]()
    with (
        progress() as on_progress,
        atomic_write(output) as part,
        LogWriter(part, metadata=source.metadata, vessel_toml=source.vessel_toml) as writer,
    ):
        for chunk in source.chunks():
            writer.write(*chunk)
            topics.update(item.topic for item in chunk if isinstance(item, Channel))
            on_progress(f"decode: {writer.samples} samples")
        writer.update_metadata(source.metadata)
    return writer.samples, len(topics)


DECODE = Verb(
    "decode the raw packets of a log again",
    _configure,
    _decode,
    (
        "shiplog decode old.mcap -o new.mcap",
        "shiplog decode old.mcap -o new.mcap --set bridge.time=gnss",
    ),
)
