"""What the comparisons work on."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from analysis.filters.noise_model import NoiseModel
from shiplog import Signals, TrialLog, Vessel, load_vessel, resample

from .logs import NAMES

VESSEL: Vessel = load_vessel("table1")[0]
NOISE = NoiseModel(
    np.array([8e-5, 0.12]), np.full(2, 2.5e-5)
)  # as good as any: both are told the same


@dataclass(frozen=True)
class Bench:
    """A log, the same in a file, a folder to work in, and how much the peers are given of it."""

    log: TrialLog
    path: Path
    folder: Path
    peer_secs: float  # of the log for a peer that is slow; its time is scaled up
    info_hours: float  # the length of the file that `shiplog info` is asked about

    @cached_property
    def signals(self) -> Signals:
        """The log on one clock."""
        return resample(self.log, channels=NAMES)

    @cached_property
    def peer_signals(self) -> Signals:
        """What a slow peer is given of them."""
        return head(self.signals, self.peer_secs)

    @property
    def share(self) -> float:
        """How much of the log that is."""
        return len(self.peer_signals) / len(self.signals)


def head(signals: Signals, secs: float) -> Signals:
    """The first so many seconds."""
    return signals.part(0, round(secs / signals.dt_secs))


def said_share(share: float) -> str:
    """Such as `peer timed on 1/24 of the log`; nothing where it was timed on all of it."""
    return "" if share > 0.999 else f"peer timed on 1/{1 / share:.3g} of the log"
