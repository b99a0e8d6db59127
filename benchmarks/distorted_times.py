"""Distortions of times and sampling: clocks, delays, lost samples, writing on change."""

from collections.abc import Callable

import numpy as np

from recorders.simulated.simulate import START_NS
from shiplog import Channel, TrialLog
from shiplog.types import FloatArray, TimeArray

from .distorted_values import DEG, KNOT
from .distortion import (
    Clock,
    Distortion,
    all_times,
    delayed,
    kept,
    on_values,
    replaced,
    written_on_change,
)

SECOND = 10**9
CLOCK_WORDS = ("clock", "set back", "set forward", "time stamps", "run back")


def stepped(*steps: tuple[float, float], only: str = "") -> Clock:
    """Return a clock that is changed by steps; each is a time and a size, s."""

    def clock(channel: Channel, times: TimeArray) -> TimeArray:
        if only and channel.name != only:
            return times
        changed = times.copy()
        for at, size in steps:
            changed[times >= START_NS + round(at * SECOND)] += round(size * SECOND)
        return changed

    return clock


def single_time(value: int) -> Clock:
    """Return a clock that writes one impossible time in the middle of each channel."""

    def clock(_: Channel, times: TimeArray) -> TimeArray:
        changed = times.copy()
        first = np.flatnonzero(times >= START_NS + 100 * SECOND)[:1]
        changed[first[times[first] < START_NS + 102 * SECOND]] = value
        return changed

    return clock


def clock_distortions() -> list[Distortion]:
    """Return the clocks that step, are coarse or run at another rate, and the late channels."""
    clocks = (
        ("set back by 5.25 s", stepped((150, -5.25))),
        ("set forward by 5.25 s", stepped((150, 5.25))),
        ("set back by 20 s near the start", stepped((10, -20.0))),
        ("set back by an hour", stepped((150, -3600.0))),
        ("set back twice", stepped((100, -3.0), (200, -7.5))),
        ("set forward and back", stepped((100, 40.0), (200, -40.0))),
        ("of the rudder alone set back by 5 s", stepped((150, -5.0), only="rudder")),
        ("of the yaw rate alone set forward by 5 s", stepped((150, 5.0), only="yaw_rate")),
        ("at 1970 once in each channel", single_time(0)),
        ("at 2180 once in each channel", single_time(210 * 365 * 86400 * SECOND)),
    )
    times = (
        ("in whole seconds", lambda t: t // SECOND * SECOND, ("same time", "time stamps coarse")),
        ("in whole half seconds", lambda t: t // (SECOND // 2) * (SECOND // 2), ("same time",)),
        ("in ms read as s", lambda t: t * 1000, ("time ms", "time unit")),
        ("in s read as ms", lambda t: t // 1000, ("time ms", "time unit")),
        ("in min read as s", lambda t: t // 60, ("time min", "time unit")),
        ("in s read as min", lambda t: t * 60, ("time min", "time unit")),
    )
    lags = (("yaw_rate", 3.0), ("rudder", 3.0), ("rudder", 1.5), ("speed", 6.0),
            ("heading", 4.0), ("position", 18.0), ("yaw_rate", -3.0))  # fmt: skip
    return [
        *(Distortion("clock", f"clock {name}", CLOCK_WORDS, clock=clock) for name, clock in clocks),
        *(Distortion("clock", f"times {name}", words, all_times(change))
          for name, change, words in times),
        *(Distortion("clock", f"{name} {secs:g} s late", (f"{name} lag", f"{name} delay",
                     "lags " + name), delayed(name, secs)) for name, secs in lags),
    ]  # fmt: skip


def sampling_distortions() -> list[Distortion]:
    """Return the channels that are sparse, coarse, written on change, or partly lost."""
    nan = float("nan")
    sampled = (
        ("rudder written on change", ("rudder",), written_on_change("rudder")),
        ("rpm written on change", ("rpm",), written_on_change("rpm")),
        ("rudder every 3 s", ("rudder",), kept("rudder", slice(None, None, 15))),
        ("rudder every 10 s", ("rudder",), kept("rudder", slice(None, None, 50))),
        ("speed every 3 s", ("speed",), kept("speed", slice(None, None, 15))),
        ("yaw rate every 2 s", ("yaw_rate",), kept("yaw_rate", slice(None, None, 10))),
        ("heading every 10 s", ("heading",), kept("heading", slice(None, None, 20))),
        ("rudder known in every fifteenth row", ("rudder",), on_values("rudder", _sparse)),
        ("rpm known in every fifteenth row", ("rpm",), on_values("rpm", _sparse)),
        ("rudder lost for 30 s", ("rudder",), replaced("rudder", nan, slice(0.4, 0.5))),
        ("yaw rate lost for 30 s", ("yaw_rate",), replaced("yaw_rate", nan, slice(0.4, 0.5))),
        ("speed lost at the start", ("speed",), replaced("speed", nan, slice(None, 0.1))),
        ("rudder in whole degrees", ("rudder",), _rounded("rudder", DEG)),
        ("heading in whole degrees", ("heading",), _rounded("heading", DEG)),
        ("speed in whole knots", ("speed",), _rounded("speed", KNOT)),
        ("yaw rate in tenths of deg/s", ("yaw_rate",), _rounded("yaw_rate", 0.1 * DEG)),
    )
    words = ("written", "held", "gap", "not measured", "sampl", "interval", "coarse", "steps",
             "resol", "constant")  # fmt: skip
    return [
        Distortion("sampling", name, tuple(f"{c} {w}" for c in channels for w in words), apply)
        for name, channels, apply in sampled
    ]


def _sparse(values: FloatArray) -> FloatArray:
    """Return the values with NaN in all but every fifteenth row."""
    known = np.arange(len(values)) % 15 == 0
    return np.where(known, values, np.nan)


def _rounded(name: str, step: float) -> Callable[[TrialLog], TrialLog]:
    return on_values(name, lambda values: np.round(values / step) * step)
