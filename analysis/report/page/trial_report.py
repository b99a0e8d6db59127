"""The content of a trial's report: each log with its manoeuvres and its replay, and the ship."""

from dataclasses import dataclass

from analysis.identification.identified_ship import IdentifiedShip
from analysis.replay.replay_results import Findings
from analysis.trial.trial_analysis import TrialAnalysis
from analysis.trial.trial_options import DEFAULT_TRIAL_OPTIONS, TrialOptions
from shiplog.checks.channel_stats import LogStats
from shiplog.types import Event


@dataclass(frozen=True)
class LogDigest:
    """The hash of a file, by which the log of a report is recognised.

    Attributes
    ----------
    name
        Of the file, without its folder.
    size
        In bytes.
    sha256
        In hexadecimal digits.
    """

    name: str
    size: int
    sha256: str


@dataclass(frozen=True, eq=False)
class ReportedLog:
    """One log of a report.

    Attributes
    ----------
    trial
        The manoeuvres with their indices, and the conditions.
    stats
        Statistics of the channels.
    events
        The events of the log, in the order of time.
    data_lost
        Whether a part of the file could not be read.
    files
        The files of the log.
    replay
        The findings of filter, disturbance observer and regression; None where the log could not
        be replayed.
    replay_error
        Why it could not; else empty.
    """

    trial: TrialAnalysis
    stats: LogStats
    events: tuple[Event, ...]
    data_lost: bool
    files: tuple[LogDigest, ...]
    replay: Findings | None
    replay_error: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of trial and replay, each once."""
        replay = self.replay.warnings if self.replay else ()
        return tuple(dict.fromkeys((*self.trial.warnings, *replay)))


@dataclass(frozen=True, eq=False)
class TrialReport:
    """The content of a report.

    Attributes
    ----------
    logs
        In the order given.
    version
        The version of shiplog that computed it.
    options
        The start rule, the place of the antenna, and the assumed errors.
    command
        The command line that makes the report again; empty where it was made in Python.
    identified
        The ship model that was fitted to the logs; None where none was asked for.
    identification_error
        Why the model could not be fitted; else empty.
    """

    logs: tuple[ReportedLog, ...]
    version: str
    options: TrialOptions = DEFAULT_TRIAL_OPTIONS
    command: str = ""
    identified: IdentifiedShip | None = None
    identification_error: str = ""

    @property
    def data_lost(self) -> bool:
        """Whether a part of any log could not be read."""
        return any(log.data_lost for log in self.logs)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of all logs and of the identification; of several logs with their names."""
        named = len(self.logs) > 1
        of_logs = [
            f"{log.trial.name}: {warning}" if named and log.trial.name not in warning else warning
            for log in self.logs
            for warning in log.warnings
        ]
        of_model = self.identified.warnings if self.identified else ()
        return tuple(dict.fromkeys((*of_logs, *of_model)))
