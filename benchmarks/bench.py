"""The log that the comparisons work on, and how much of it a slow peer is given."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample

from .logs import NAMES

VESSEL: Vessel = load_vessel("table1")[0]
# the values do not matter, as both sides are given the same
NOISE = NoiseModel(np.array([8e-5, 0.12]), np.full(2, 2.5e-5))


@dataclass(frozen=True)
class Bench:
    """The input of the comparisons.

    Attributes
    ----------
    log
        The log in memory.
    path
        The same log as a file.
    folder
        A folder for output files.
    peer_secs
        The duration of log that a slow peer is given; its time is scaled up.
    info_hours
        The length of the file that `shiplog info` reads.
    short
        Whether the run only verifies that every line runs.
    """

    log: TrialLog
    path: Path
    folder: Path
    peer_secs: float
    info_hours: float
    short: bool = False

    @cached_property
    def signals(self) -> Signals:
        """The log resampled to one clock."""
        return resample(self.log, channels=NAMES)

    @cached_property
    def peer_signals(self) -> Signals:
        """The first `peer_secs` of the signals, for a slow peer."""
        return head(self.signals, self.peer_secs)

    @property
    def share(self) -> float:
        """The share of the log that a slow peer is given, 0 to 1."""
        return len(self.peer_signals) / len(self.signals)


def head(signals: Signals, secs: float) -> Signals:
    """Return the first `secs` seconds of the signals."""
    return signals.part(0, round(secs / signals.dt_secs))


def share_note(share: float) -> str:
    """Return a note such as ``peer timed on 1/24 of the log``; empty if it is the whole log.

    Examples
    --------
    >>> share_note(1 / 24)
    'peer timed on 1/24 of the log'
    """
    return "" if share > 0.999 else f"peer timed on 1/{1 / share:.3g} of the log"
