"""Simulated trials as logs, and logs cut at chosen times."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from recorders.simulated.simulate import SimulatedTrial
from shiplog import Channel, TrialLog


def as_log(trial: SimulatedTrial, name: str = "trial.mcap") -> TrialLog:
    """Return a simulated trial as a log in memory."""
    return TrialLog(name, trial.channels, trial.metadata, trial.vessel_toml)


class InChunks:
    """A log whose chunks are cut at given times of reception, s after its start."""

    def __init__(self, log: TrialLog, cuts: list[float]) -> None:
        self.log, self.cuts = log, cuts

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self.log, name)

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        start, _ = self.log.span_ns
        edges = [int(start + at * 1e9) for at in self.cuts]
        ends = {
            c.topic: [0, *np.searchsorted(c.received_ns, edges).tolist(), len(c)] for c in self.log
        }
        for i in range(len(edges) + 1):
            yield tuple(c.part(ends[c.topic][i], ends[c.topic][i + 1]) for c in self.log)
