"""The verbs of the core: info, convert."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.text_table import TextTable

from .console import print_tables, print_warnings, progress, write_json
from .options import add_cut_options
from .paths import require_distinct, require_inputs, require_outputs
from .verb import ExitCode, Verb

if TYPE_CHECKING:
    from shiplog.mcap.info import LogInfo


def _configure_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG")
    parser.add_argument("--json", metavar="FILE", help="write it as JSON; - is stdout")


def _info(arguments: argparse.Namespace) -> ExitCode:
    from shiplog.mcap.info import read_log_info

    require_inputs(arguments.log)
    require_outputs(arguments.json)
    require_distinct([arguments.json], [arguments.log])
    found = read_log_info(arguments.log)
    if arguments.json:
        write_json(found.to_dict(), arguments.json)
        return ExitCode.DATA_LOST if found.data_lost else ExitCode.OK
    state = "finished" if found.finished else "not finished"
    state += ", damaged" if found.data_lost else ""
    duration_secs = (found.end_ns - found.start_ns) * 1e-9
    print(f"{found.name}: from {found.start_utc}, {duration_secs:.1f} s, {state}")
    print_tables(_info_tables(found))
    for key, value in found.metadata.items():
        print(f"  {key}: {value}")
    print(f"  vessel.toml: {'attached' if found.has_vessel else 'none'}")
    print_warnings(found.warnings)
    return ExitCode.DATA_LOST if found.data_lost else ExitCode.OK


def _info_tables(info: "LogInfo") -> list[TextTable]:
    """Tables of a log's channels and of its foreign topics; those without rows are omitted."""
    channels = tuple(
        (
            channel.topic,
            str(channel.samples),
            "" if channel.rate_hz is None else f"{channel.rate_hz:.4g}",
            "" if channel.lowest is None else f"{channel.lowest:.4g}",
            "" if channel.highest is None else f"{channel.highest:.4g}",
            channel.display_unit or channel.unit,
        )
        for channel in info.channels
    )
    signs = tuple((one.topic, one.positive) for one in info.channels if one.positive)
    foreign = tuple((one.topic, str(one.messages), one.schema) for one in info.foreign)
    headings = ("topic", "samples", "rate [Hz]", "lowest", "highest", "unit")
    tables = (
        TextTable("channels", headings, channels),
        TextTable("signs", ("topic", "positive"), signs),
        TextTable("topics of other programs", ("topic", "messages", "schema"), foreign),
    )
    return [table for table in tables if table.rows]


def _configure_convert(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source", metavar="FROM", type=Path, help="a log (.mcap, .csv, .parquet) or a table"
    )
    parser.add_argument("target", metavar="TO", type=Path, help=".mcap, .csv or .parquet")
    parser.add_argument(
        "--layout", type=Path, help="the columns of a foreign table: a TOML file (docs/tables.md)"
    )
    add_cut_options(parser)
    parser.add_argument(
        "--strict", action="store_true", help="refuse a table with a contradiction in unit or sign"
    )


def _convert(arguments: argparse.Namespace) -> ExitCode:
    require_outputs(arguments.target)
    from shiplog.tables.convert import convert

    with progress() as on_progress:
        on_progress(f"{arguments.source.name} to {arguments.target.name}")
        log, warnings = convert(
            arguments.source,
            arguments.target,
            arguments.layout,
            start=arguments.start,
            end=arguments.end,
            strict=arguments.strict,
        )
    print_warnings(warnings)
    samples = sum(len(channel) for channel in log.channels)
    print(f"{arguments.target}: {samples} samples of {len(log.channels)} channels")
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


INFO = Verb(
    "list what is in a log: times, rates, ranges, foreign topics",
    _configure_info,
    _info,
    ("shiplog info trial.mcap", "shiplog info trial.mcap --json -"),
)
CONVERT = Verb(
    "convert a table to a log, or a log to a table",
    _configure_convert,
    _convert,
    (
        "shiplog convert run.dat run.mcap --layout my_tank.toml",
        "shiplog convert trial.mcap trial.csv",
        "shiplog convert day.mcap zigzag.mcap --from 12:04:30 --to 12:21   (a part of it)",
        "shiplog convert trial.mcap.part trial.mcap   (a recording that was cut short)",
    ),
)
