"""The time of a replay by stage, attributed by the module in which it is spent."""

import sys
import time
from collections import defaultdict
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.main import main

if TYPE_CHECKING:
    from types import FrameType

# the folders and modules of each stage; the time of any other module counts to its caller's stage
STAGES = {
    "read": ("shiplog.mcap",),
    "check": (
        "shiplog.checks.log_stats", "shiplog.checks.time_stats", "shiplog.checks.data_quality",
        "shiplog.checks.stuck", "shiplog.checks.consistency", "shiplog.checks.interpolate",
        "analysis.replay.channel_warnings",
    ),
    "resample": ("shiplog.resampling", "analysis.signals.hold"),
    "signal statistics": ("analysis.signals.signal_stats",),
    "filter": ("analysis.filters", "analysis.replay.residuals"),
    "disturbance": ("analysis.disturbance",),
    "coefficients": ("analysis.regression",),
    "track": ("analysis.replay.track",),
    "review": ("analysis.view", "analysis.report"),
}  # fmt: skip
REST = "the rest"
_STAGE_OF = {name: stage for stage, names in STAGES.items() for name in names}


def our_stages(path: Path, out: Path) -> dict[str, float]:
    """Return the seconds that `shiplog replay` spends in each stage.

    The replay runs twice in this process and the second is timed, so that neither the start of
    Python nor the loading of compiled loops counts.
    """
    command = ["replay", str(path), "-o", str(out)]
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        main(command)
        stopwatch = _Stopwatch()
        sys.setprofile(stopwatch)
        try:
            main(command)
        finally:
            sys.setprofile(None)
    return {stage: stopwatch.secs[stage] for stage in (*STAGES, REST) if stopwatch.secs[stage] > 0}


@cache
def stage_of(module: str) -> str | None:
    """Return the stage of a module by its full name, or of its folder; None if it has none.

    Examples
    --------
    >>> stage_of("shiplog.mcap.reader"), stage_of("shiplog.types.channel")
    ('read', None)
    """
    return _STAGE_OF.get(module) or _STAGE_OF.get(module.rpartition(".")[0])


class _Stopwatch:
    """A profiling function: adds the time between calls and returns to the current stage."""

    def __init__(self) -> None:
        self.secs: dict[str, float] = defaultdict(float)
        self._stack, self._since = [REST], time.perf_counter()

    def __call__(self, frame: "FrameType", event: str, _: object) -> None:
        if event == "call":
            stage = stage_of(frame.f_globals.get("__name__", ""))
            self._count()
            self._stack.append(stage or self._stack[-1])
        elif event == "return" and len(self._stack) > 1:
            self._count()
            self._stack.pop()

    def _count(self) -> None:
        now = time.perf_counter()
        self.secs[self._stack[-1]] += now - self._since
        self._since = now
