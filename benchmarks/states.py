"""The replay with further states, and smoothed, against the same replay without."""

import time
from collections.abc import Callable, Mapping

from analysis.replay.plan import plan_replay
from analysis.replay.replay import Replay
from shiplog import TrialLog

from .bench import Bench
from .logs import NAMES, day_of_trial
from .measure import Comparison, Limit

Settings = Mapping[str, object]
CHANNELS = (*NAMES, "heading", "position")
SENSORS: Settings = {"filter.sensor_bias": "auto"}
EXTENDED: Settings = {"filter.kind": "extended"}
SMOOTHED: Settings = {**EXTENDED, "filter.smooth": True}
MAX_SENSOR_RATIO = 2.0
NOTE = "processor time in one process, without a review; heading at 2 Hz, positions at 1 Hz"


def state_lines(bench: Bench) -> list[Comparison]:
    """Return the comparisons of replays of a turning circle as long as the log of the bench."""
    log = day_of_trial(bench.log.duration_secs / 3600, "turning-circle-35", CHANNELS)
    lines: tuple[tuple[str, Settings, str, Settings, float | None], ...] = (
        ("sensor errors", SENSORS, "without", {}, MAX_SENSOR_RATIO),
        ("extended, sensor errors", {**EXTENDED, **SENSORS}, "without", EXTENDED, MAX_SENSOR_RATIO),
        ("extended, smoothed", SMOOTHED, "not smoothed", EXTENDED, None),
        ("extended, smoothed, sensor errors", {**SMOOTHED, **SENSORS}, "extended", EXTENDED, None),
    )
    return [
        Comparison(
            f"estimates of a replay: {work}", against,
            estimation(log, settings), estimation(log, others),
            Limit(at_most=limit), note=NOTE,
        )
        for work, settings, against, others, limit in lines
    ]  # fmt: skip


def estimation(log: TrialLog, settings: Settings) -> Callable[[], float]:
    """Return a function that replays a log and returns the processor time, s."""

    def secs() -> float:
        start = time.process_time()
        replay = Replay(log, plan_replay(log, settings=settings))
        for _ in replay.chunks():
            pass
        return time.process_time() - start

    return secs
