from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.pipeline import Analysis, analyse
from recorders.sensors import suite
from recorders.simulate import SimulatedTrial, simulate
from shiplog import Channel, TrialLog, Vessel, load_vessel

PROJECT = Path(__file__).parents[1]
RECORDINGS = PROJECT.parent / "shared" / "data"


@pytest.fixture(scope="session")
def recordings() -> Path:
    if not RECORDINGS.is_dir():
        pytest.skip(f"the real recordings are not here: {RECORDINGS}")
    return RECORDINGS


@pytest.fixture(scope="session")
def vessel() -> Vessel:
    return load_vessel("table1")[0]


def as_log(trial: SimulatedTrial, name: str = "trial.mcap") -> TrialLog:
    return TrialLog(name, trial.channels, trial.metadata, trial.vessel_toml)


class InSlabs:
    """A log cut at given times of reception, seconds after its start."""

    def __init__(self, log: TrialLog, cuts: list[float]) -> None:
        self.log, self.cuts = log, cuts

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        return getattr(self.log, name)

    def slabs(self) -> Iterator[tuple[Channel, ...]]:
        start, _ = self.log.span_ns
        edges = [int(start + at * 1e9) for at in self.cuts]
        ends = {
            c.topic: [0, *np.searchsorted(c.received_ns, edges).tolist(), len(c)] for c in self.log
        }
        for i in range(len(edges) + 1):
            yield tuple(c.part(ends[c.topic][i], ends[c.topic][i + 1]) for c in self.log)


@pytest.fixture(scope="session")
def zigzag() -> SimulatedTrial:
    """A 20/20 zig-zag of the paper's ship under the paper's noise."""
    vessel, text = load_vessel("table1")
    return simulate(
        vessel,
        "zigzag-20-20",
        duration_secs=500.0,
        seed=11,
        sensors=suite("paper"),
        vessel_toml=text,
    )


@pytest.fixture(scope="session")
def zigzag_log(zigzag: SimulatedTrial) -> TrialLog:
    return as_log(zigzag, "zigzag.mcap")


@pytest.fixture(scope="session")
def zigzag_analysis(zigzag_log: TrialLog) -> Analysis:
    return analyse(zigzag_log)
