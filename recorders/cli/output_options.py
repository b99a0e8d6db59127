"""Options of `record` about its output: the file, its parts, and how often it is made safe."""

import argparse
from dataclasses import dataclass
from math import inf
from pathlib import Path

from recorders.disk_sync import SYNC_SECS
from recorders.record import Rotation
from recorders.transports.live_stream import BATCH_SECS
from recorders.trial.trial_file import TrialFile
from shiplog.cli.paths import require_outputs, require_suffix
from shiplog.errors import UsageError


@dataclass(frozen=True)
class RecordingOutput:
    """The output of a recording.

    Attributes
    ----------
    log
        The log.
    rotation
        When to go on in a new part; None for never.
    flush_secs
        How often what a live source has received is handed to the operating system, s.
    sync_secs
        How often what was written is forced to the disk, s.
    """

    log: Path
    rotation: Rotation | None = None
    flush_secs: float = BATCH_SECS
    sync_secs: float = SYNC_SECS


def add_output_options(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add the options; `required` is whether there is no output without ``-o``."""
    parser.add_argument(
        "-o", "--output", required=required, metavar="FILE", help="the log to write"
    )
    for option, metavar, text in (
        ("--rotate-minutes", "MIN", "go on in a new part after MIN minutes: FILE.001.mcap, ..."),
        ("--rotate-megabytes", "MB", "go on in a new part when one has MB megabytes"),
        ("--flush", "S", f"of live sources: survive a killed process every S s ({BATCH_SECS:g})"),
        ("--fsync", "S", f"survive a power failure every S seconds (default: {SYNC_SECS:g})"),
    ):
        parser.add_argument(option, type=_positive, metavar=metavar, help=text)


def recording_output(
    arguments: argparse.Namespace, trial: TrialFile | None = None
) -> RecordingOutput:
    """Return the output that was asked for; options precede the keys of a trial file.

    Raises
    ------
    UsageError
        There is none, or it is no MCAP file.
    ShiplogError
        Its folder is missing.
    """
    log = arguments.output
    if log is None and trial is not None:
        log = trial.output
    if log is None:
        where = f", or `file` in [output]: {trial.path}" if trial else ""
        raise UsageError(f"no output; add -o FILE{where}")
    require_outputs(log)
    require_suffix(".mcap", log)
    minutes, megabytes = arguments.rotate_minutes, arguments.rotate_megabytes
    flush_secs, sync_secs = arguments.flush, arguments.fsync
    if trial is not None:
        minutes, megabytes = minutes or trial.rotate_minutes, megabytes or trial.rotate_megabytes
        flush_secs, sync_secs = flush_secs or trial.flush_secs, sync_secs or trial.fsync_secs
    return RecordingOutput(
        Path(log),
        Rotation(minutes, megabytes) if minutes or megabytes else None,
        flush_secs or BATCH_SECS,
        sync_secs or SYNC_SECS,
    )


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < inf:
        raise argparse.ArgumentTypeError(f"{text} is no positive number")
    return value
