"""The verbs of the core: info, convert."""

import argparse
from pathlib import Path

from .console import print_warnings, progress, write_json
from .paths import require_distinct, require_inputs, require_outputs
from .verb import ExitCode, Verb


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
    print(f"{found.name}: {(found.end_ns - found.start_ns) * 1e-9:.1f} s")
    rows = [("topic", "samples", "unit", "positive")]
    rows += [(c.topic, str(c.samples), c.unit, c.positive) for c in found.channels]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    for topic, samples, unit, positive in rows:
        line = f"  {topic:<{widths[0]}}  {samples:>{widths[1]}}  {unit:<{widths[2]}}  {positive}"
        print(line.rstrip())
    for key, value in found.metadata.items():
        print(f"  {key}: {value}")
    print(f"  vessel.toml: {'attached' if found.has_vessel else 'none'}")
    print_warnings(found.warnings)
    return ExitCode.DATA_LOST if found.data_lost else ExitCode.OK


def _configure_convert(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source", metavar="FROM", type=Path, help="a log (.mcap, .csv, .parquet) or a table"
    )
    parser.add_argument("target", metavar="TO", type=Path, help=".mcap, .csv or .parquet")
    parser.add_argument(
        "--layout", type=Path, help="the columns of a foreign table: a TOML file (docs/tables.md)"
    )


def _convert(arguments: argparse.Namespace) -> ExitCode:
    require_outputs(arguments.target)
    from shiplog.tables.convert import convert

    with progress() as on_progress:
        on_progress(f"{arguments.source.name} to {arguments.target.name}")
        log, warnings = convert(arguments.source, arguments.target, arguments.layout)
    print_warnings(warnings)
    samples = sum(len(channel) for channel in log.channels)
    print(f"{arguments.target}: {samples} samples of {len(log.channels)} channels")
    return ExitCode.DATA_LOST if log.data_lost else ExitCode.OK


INFO = Verb(
    "list what is in a log, without reading it all",
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
        "shiplog convert trial.mcap.part trial.mcap   (a recording that was cut short)",
    ),
)
