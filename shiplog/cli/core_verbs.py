"""The verbs of the core: info, convert, layout."""

import argparse
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.errors import ShiplogError
from shiplog.printable import counted

from .console import print_line, print_tables, print_toml, print_warnings, progress, write_json
from .options import add_cut_options, add_derive_option
from .paths import require_distinct, require_inputs, require_outputs
from .verb import ExitCode, Verb

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shiplog.checks.log_content import LogInfo
    from shiplog.foreign_mcap.ulog import UlogCopy


def _configure_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", metavar="LOG", nargs="+", help="one log, or several for an overview")
    add_cut_options(parser)
    parser.add_argument(
        "--json", metavar="FILE", help="write it as JSON, of several logs a list; - is stdout"
    )


def _info(arguments: argparse.Namespace) -> ExitCode:
    require_outputs(arguments.json)
    require_distinct([arguments.json], arguments.log)
    if len(arguments.log) > 1:
        return _info_of_several(arguments)

    from .info_tables import info_tables

    require_inputs(*arguments.log)
    info = _read_info(arguments.log[0], arguments)
    if arguments.json:
        write_json(info.to_dict(), arguments.json)
    else:
        start = f"from {info.start_utc}" if info.start_utc else "no samples"
        print_line(f"{info.name}: {start}, {info.duration_secs:.1f} s, {info.state}")
        print_tables(info_tables(info))
        for key, value in info.metadata.items():
            print_line(f"  {key}: {value}")
        print_line(f"  vessel.toml: {'attached' if info.has_vessel else 'none'}")
        print_warnings(info.warnings)
    return ExitCode.DATA_LOST if info.data_lost else ExitCode.OK


def _info_of_several(arguments: argparse.Namespace) -> ExitCode:
    """Show one row for each log; a log that cannot be read is reported and the others shown."""
    from .info_tables import info_overview

    infos, entries, failed = [], [], False
    with progress() as on_progress:
        for number, path in enumerate(arguments.log):
            on_progress(f"log {number + 1} of {len(arguments.log)}", number / len(arguments.log))
            try:
                require_inputs(path)
                infos.append(_read_info(path, arguments))
                entries.append(infos[-1].to_dict())
            except ShiplogError as error:
                entries.append({"name": Path(path).name, "error": str(error)})
                print_line(f"shiplog: {error}", to_stderr=True)
                failed = True
    if arguments.json:
        write_json(entries, arguments.json)
    else:
        print_tables([info_overview(infos)])
    for info in infos:
        print_warnings(
            [text if info.name in text else f"{info.name}: {text}" for text in info.warnings]
        )
    if failed:
        return ExitCode.FAILURE
    return ExitCode.DATA_LOST if any(info.data_lost for info in infos) else ExitCode.OK


def _read_info(path: str, arguments: argparse.Namespace) -> "LogInfo":
    from shiplog.checks.info import read_log_info

    with _as_mcap(Path(path)) as copy:
        info = read_log_info(copy.path, arguments.start, arguments.end)
    warnings, lost = (*copy.warnings, *info.warnings), info.data_lost or copy.data_lost
    return replace(info, warnings=warnings, data_lost=lost)


@contextmanager
def _as_mcap(path: Path) -> "Iterator[UlogCopy]":
    """Give a log as an MCAP file: a copy of a ULog file, any other as it is."""
    from shiplog.foreign_mcap.ulog import UlogCopy, is_ulog, ulog_as_mcap

    if is_ulog(path):
        with ulog_as_mcap(path) as copy:
            yield copy
    else:
        yield UlogCopy(path)


def _configure_convert(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source",
        metavar="FROM",
        type=Path,
        help="a log, a table, or MCAP or ULog of another program",
    )
    parser.add_argument(
        "target",
        metavar="TO",
        type=Path,
        help=".mcap, .csv, .parquet, or of the track .kml or .gpx",
    )
    parser.add_argument(
        "--layout",
        type=Path,
        help="the columns of a foreign table, or the topics and fields of a foreign MCAP file: "
        "TOML (docs/tables.md, docs/foreign_mcap.md)",
    )
    parser.add_argument(
        "--wide",
        action="store_true",
        help="a .csv with one row per instant of a uniform clock and one column per quantity",
    )
    parser.add_argument(
        "--units",
        choices=("si", "people"),
        help="a .csv for other programs, in SI units and radians, or in the units that people use, "
        "such as deg and kn; without this and --wide a .csv keeps the whole log",
    )
    add_cut_options(parser)
    add_derive_option(parser)
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse a foreign file with a contradiction in unit or sign",
    )


def _convert(arguments: argparse.Namespace) -> ExitCode:
    require_outputs(arguments.target)
    from shiplog.tables.convert import convert
    from shiplog.tables.plain_csv import CsvShape

    shape = None
    if arguments.wide or arguments.units:
        shape = CsvShape(arguments.wide, display_units=arguments.units == "people")
    with progress() as on_progress:
        on_progress(f"{arguments.source.name} to {arguments.target.name}")
        log, warnings = convert(
            arguments.source,
            arguments.target,
            arguments.layout,
            start=arguments.start,
            end=arguments.end,
            strict=arguments.strict,
            derive=arguments.derive,
            shape=shape,
        )
    print_warnings(warnings)
    samples = counted(sum(len(channel) for channel in log.channels), "sample")
    print_line(f"{arguments.target}: {samples} of {counted(len(log.channels), 'channel')}")
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


INFO = Verb(
    "list what is in a log: times, rates, ranges, foreign topics",
    _configure_info,
    _info,
    (
        "shiplog info trial.mcap",
        "shiplog info *.mcap   (one row for each log)",
        "shiplog info day.mcap --from 12:04:30 --to 12:21 --json -",
    ),
)
CONVERT = Verb(
    "convert a table or a foreign MCAP file to a log, or a log to a table",
    _configure_convert,
    _convert,
    (
        "shiplog convert run.dat run.mcap --layout my_tank.toml",
        "shiplog convert bag.mcap trial.mcap --layout ros.toml   (messages of ROS 2, ...)",
        "shiplog convert trial.mcap trial.csv",
        "shiplog convert trial.mcap table.csv --wide --units people   (for a spreadsheet)",
        "shiplog convert trial.mcap track.kml   (or .gpx)",
        "shiplog convert day.mcap zigzag.mcap --from 12:04:30 --to 12:21   (a part of it)",
        "shiplog convert trial.mcap.part trial.mcap   (a recording that was cut short)",
    ),
)


def _configure_layout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "table",
        metavar="FILE",
        type=Path,
        help="a foreign table with a header, or an MCAP or ULog file of another program",
    )
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="layout file to write")


def _layout(arguments: argparse.Namespace) -> ExitCode:
    from shiplog.files import atomic_write
    from shiplog.foreign_mcap.mcap_draft import draft_mcap_layout
    from shiplog.mcap.part_names import SUFFIX, log_suffix
    from shiplog.tables.draft import draft_layout

    require_outputs(arguments.output)
    require_distinct([arguments.output], [arguments.table])
    with _as_mcap(arguments.table) as copy:
        is_mcap = log_suffix(arguments.table) == SUFFIX or copy.path != arguments.table
        draft = (draft_mcap_layout if is_mcap else draft_layout)(copy.path)
    if arguments.output is None:
        print_toml(draft.text)
    else:
        with atomic_write(arguments.output) as part:
            part.write_text(draft.text, encoding="utf-8")
    for remark in draft.remarks:
        print_line(f"{arguments.table.name}: {remark}", to_stderr=True)
    return ExitCode.OK


LAYOUT = Verb(
    "draft the layout of a foreign table, or of an MCAP file of another program",
    _configure_layout,
    _layout,
    (
        "shiplog layout run.csv -o run.toml",
        "shiplog convert run.csv run.mcap --layout run.toml",
        "shiplog layout bag.mcap -o ros.toml",
    ),
)
