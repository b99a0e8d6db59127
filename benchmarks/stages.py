"""Where the time of a replay goes: by the module that spends it."""

import sys
import time
from collections import defaultdict
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.cli.main import main

if TYPE_CHECKING:
    from types import FrameType

STAGES = {
    # stage: the modules whose time is its own; of the others it is their caller's
    "read": ("reader", "log_file", "scan", "messages", "mcap_summary"),
    "check": ("log_stats", "quality", "stuck", "doubts", "rudder_sign", "gyro_bias"),
    "one clock": ("clock", "inputs"),
    "signal_stats": ("signal_stats", "first_model"),
    "filter": ("pseudo_input", "three_state", "smoother", "tuning", "residuals"),
    "disturbance": ("disturbance", "ship_observer"),
    "coefficients": ("weak_form", "sliding", "identification", "two_stack", "newey_west"),
    "track": ("track",),
    "review": ("panels", "drawing", "chart", "rerun_view", "summary", "tables"),
}
REST = "the rest"
_STAGE_OF = {module: stage for stage, modules in STAGES.items() for module in modules}


def our_stages(path: Path, out: Path) -> dict[str, float]:
    """Seconds that `shiplog replay` spends in each stage, Python and the loops being loaded."""
    command = ["replay", str(path), "-o", str(out)]
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        main(command)
        watch = _Watch()
        sys.setprofile(watch)
        try:
            main(command)
        finally:
            sys.setprofile(None)
    return {stage: watch.secs[stage] for stage in (*STAGES, REST) if watch.secs[stage] > 0}


class _Watch:
    """Told of every call and return, generators' too; counts the time to the stage on top."""

    def __init__(self) -> None:
        self.secs: dict[str, float] = defaultdict(float)
        self._stack, self._since = [REST], time.perf_counter()

    def __call__(self, frame: "FrameType", event: str, _: object) -> None:
        if event == "call":
            package, *inner = frame.f_globals.get("__name__", "").split(".")
            ours = package in ("shiplog", "analysis")
            stage = _STAGE_OF.get(inner[-1]) if ours and inner else None
            self._count()
            self._stack.append(stage or self._stack[-1])
        elif event == "return" and len(self._stack) > 1:
            self._count()
            self._stack.pop()

    def _count(self) -> None:
        now = time.perf_counter()
        self.secs[self._stack[-1]] += now - self._since
        self._since = now
