"""The verb `recover`: all that is intact in a damaged or unfinished MCAP file."""

import argparse
from pathlib import Path

from shiplog.printable import counted
from shiplog.text_table import TextTable

from .console import print_line, print_tables, print_warnings
from .paths import require_distinct, require_inputs, require_outputs
from .verb import ExitCode, Verb


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source", metavar="DAMAGED", type=Path, help="an MCAP file of shiplog or another program"
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", type=Path, required=True, help="the file to write"
    )


def _recover(arguments: argparse.Namespace) -> ExitCode:
    require_inputs(arguments.source)
    require_outputs(arguments.output)
    require_distinct([arguments.output], [arguments.source])
    from shiplog.mcap.damage import damage_warnings
    from shiplog.mcap.recover import Recovery, recover

    recovery: Recovery = recover(arguments.source, arguments.output)
    lost = recovery.lost_messages
    rows = tuple(
        (topic, str(count), "" if lost is None else str(lost.get(topic, 0)))
        for topic, count in sorted((dict.fromkeys(lost or {}, 0) | recovery.messages).items())
    )
    print_tables([TextTable("Recovered", ("topic", "messages", "lost"), rows)])
    attachments = counted(recovery.attachments, "attachment")
    print_line(f"also {attachments} and {counted(recovery.metadata_records, 'metadata record')}")
    warnings = [*recovery.part_warnings, *damage_warnings(recovery.damage)]
    if not recovery.is_finished:
        warnings.append(
            "the file was not finished (the recorder was stopped or killed)"
            + ("; it ends within a record, of which the end is lost" if recovery.is_cut else "")
        )
    print_warnings(warnings)
    outcome = "the rest is lost" if recovery.is_lost else "nothing is lost"
    messages = counted(sum(recovery.messages.values()), "message")
    print_line(f"{arguments.output}: {messages}; {outcome}")
    return ExitCode.DATA_LOST if recovery.is_lost else ExitCode.OK


RECOVER = Verb(
    "write all that is intact in a damaged MCAP file to another one",
    _configure,
    _recover,
    ("shiplog recover damaged.mcap -o good.mcap",),
)
