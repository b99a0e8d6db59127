"""A report computed from logs: their manoeuvres, their replays, and a model if one is asked for."""

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.identification.identify import identify
from analysis.replay.plan import plan_replay
from analysis.replay.reading_options import DEFAULT_OPTIONS, ReadingOptions
from analysis.replay.replay import Replay
from analysis.replay.replay_results import Findings
from analysis.trial.analyse_trial import analyse_trial
from analysis.trial.trial_options import DEFAULT_TRIAL_OPTIONS, TrialOptions
from shiplog.checks.log_stats import compute_log_stats
from shiplog.errors import ShiplogError
from shiplog.mcap.part_names import part_files
from shiplog.mcap.stream import open_log
from shiplog.progress import ProgressCallback, no_progress
from shiplog.types import Log
from shiplog.version import __version__

from .trial_report import LogDigest, ReportedLog, TrialReport


@dataclass(frozen=True)
class ReportPart:
    """A log, or a part of one, that a report is about.

    Attributes
    ----------
    path
        Of the log.
    start, end
        The part, as `shiplog.open_log` takes them; by default all.
    """

    path: str | os.PathLike[str]
    start: float | str | None = None
    end: float | str | None = None

    def open(self) -> Log:
        """Open the part of the log."""
        return open_log(self.path, self.start, self.end)


def report_trials(
    logs: Sequence[ReportPart | str | os.PathLike[str]],
    options: ReadingOptions = DEFAULT_OPTIONS,
    trial_options: TrialOptions = DEFAULT_TRIAL_OPTIONS,
    *,
    model: str | None = None,
    command: str = "",
    on_progress: ProgressCallback = no_progress,
) -> TrialReport:
    """Analyse the manoeuvres of logs and replay them, for a report.

    Parameters
    ----------
    logs
        Paths of logs of one ship, or parts of logs.
    options
        The vessel, the ship's length and the sources of channels, as in `analyse`.
    trial_options
        The start rule, the place of the antenna, and assumed errors, as in `analyse_trial`.
    model
        The ship model to identify from all logs together, or ``auto``; by default none.
    command
        The command line, to be printed in the report.
    on_progress
        Called with each step and its share done.

    Returns
    -------
    TrialReport
        For `report_page` and `trial_report_json`. A log that cannot be replayed, such as one
        without yaw rate, keeps its manoeuvres, and the reason is reported.

    Raises
    ------
    LogError
        A log cannot be read, or contradicts itself where `options` is strict.
    """
    parts = [each if isinstance(each, ReportPart) else ReportPart(each) for each in logs]
    reported = []
    for number, part in enumerate(parts, start=1):
        of_all = f"log {number} of {len(parts)}"
        on_progress(f"read {of_all}", (number - 1) / len(parts))
        reported.append(_reported_log(part, (options, trial_options), of_all, on_progress))
    identified, error = None, ""
    if model is not None:
        try:
            opened = [part.open() for part in parts]
            antenna = trial_options.antenna_forward, trial_options.antenna_starboard
            placed = replace(options, antenna=antenna)
            identified = identify(opened, model, options=placed, on_progress=on_progress)
        except ShiplogError as cause:
            error = str(cause)
    return TrialReport(tuple(reported), __version__, trial_options, command, identified, error)


def _reported_log(
    part: ReportPart,
    both_options: tuple[ReadingOptions, TrialOptions],
    of_all: str,
    on_progress: ProgressCallback,
) -> ReportedLog:
    """Analyse and replay one log."""
    options, trial_options = both_options

    def on_step(step: str, share: float | None = None, /) -> None:
        on_progress(f"{of_all}: {step}", share)

    log = part.open()
    trial = analyse_trial(log, options, trial_options, on_progress=on_step)
    replay, error = None, ""
    try:
        replay = _replayed(log, options, on_step)
    except ShiplogError as cause:
        if options.strict:
            raise
        error = str(cause)
    return ReportedLog(
        trial,
        replay.plan.log_stats if replay else compute_log_stats(log),
        replay.events if replay else tuple(log.events),
        log.data_lost,
        tuple(_digest(file) for file in part_files(Path(part.path))),
        replay,
        error,
    )


def _replayed(log: Log, options: ReadingOptions, on_progress: ProgressCallback) -> Findings:
    """Replay a log without keeping its time series."""
    plan = plan_replay(log, options, on_progress=on_progress)
    replay = Replay(log, plan, on_progress=on_progress)
    for _ in replay.chunks():
        pass
    return replay.findings


def _digest(path: Path) -> LogDigest:
    """Compute the hash of a file."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return LogDigest(path.name, path.stat().st_size, digest)
