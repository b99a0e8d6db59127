"""Distortion of a trial: a way in which a log misrepresents it, and words that name it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from recorders.simulated.simulate import START_NS
from shiplog import Channel, TrialLog
from shiplog.geodesy import LocalFrame, LocalPositions
from shiplog.types import FloatArray, TimeArray
from shiplog.units import GEOGRAPHIC

DATUM = (60.0, 20.0)
Clock = Callable[[Channel, TimeArray], TimeArray]


def unchanged(log: TrialLog) -> TrialLog:
    """Return the log as it is."""
    return log


@dataclass(frozen=True)
class Distortion:
    """One way in which a log is distorted.

    Attributes
    ----------
    family
        The kind of distortion: unit, sign, clock, sampling, sentinel, source or position.
    name
        What is distorted, in words.
    causes
        The texts of which one must be in a warning that names the cause. The words of a text may be
        anywhere in the warning, in any case.
    apply
        The distortion of the values.
    clock
        The distortion of the times: a function of a channel and its true times, ns. Times are
        distorted while the log is written, so that the order of the file is that of the truth.
    """

    family: str
    name: str
    causes: tuple[str, ...]
    apply: Callable[[TrialLog], TrialLog] = unchanged
    clock: Clock | None = None

    def __str__(self) -> str:
        return f"{self.family}: {self.name}"

    def is_named_in(self, warning: str) -> bool:
        """Whether a warning or an error names the cause."""
        text = warning.lower()
        return any(all(word in text for word in cause.split()) for cause in self.causes)


def with_channel(log: TrialLog, name: str, **changes: Any) -> TrialLog:  # noqa: ANN401 - of a field
    """Return the log with fields of one channel changed."""
    channel = log[name]
    changed = replace(channel, **changes)
    return replace(log, channels=tuple(changed if c is channel else c for c in log))


def on_values(name: str, function: Callable[[FloatArray], FloatArray]) -> Callable[..., TrialLog]:
    """Return a distortion of the values of one channel."""
    return lambda log: with_channel(log, name, values=function(log[name].values))


def scaled(*names: str, by: float) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that multiplies the values of channels."""

    def apply(log: TrialLog) -> TrialLog:
        for name in names:
            log = with_channel(log, name, values=log[name].values * by)
        return log

    return apply


def replaced(name: str, value: float, rows: slice) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that writes one value in some rows; fractions of the log as a slice."""

    def apply(log: TrialLog) -> TrialLog:
        values = log[name].values.copy()
        values[shares_of(rows, len(values))] = value
        return with_channel(log, name, values=values)

    return apply


def shares_of(rows: slice, count: int) -> slice:
    """Return a slice of rows from one whose start and stop are shares of their number."""
    start = 0 if rows.start is None else round(rows.start * count)
    stop = count if rows.stop is None else round(rows.stop * count)
    return slice(start, max(stop, start + 1), rows.step)


def kept(name: str, rows: slice) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that keeps some rows of a channel and loses the others."""

    def apply(log: TrialLog) -> TrialLog:
        channel = log[name].take(rows)
        return replace(log, channels=tuple(channel if c.name == name else c for c in log))

    return apply


def written_on_change(name: str) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that keeps the samples of a channel that differ from the one before."""

    def apply(log: TrialLog) -> TrialLog:
        values = log[name].values
        rows = np.flatnonzero(np.concatenate(([True], np.diff(values) != 0)))
        rows = np.union1d(rows, [len(values) - 1])
        changed = log[name].take(rows)
        return replace(log, channels=tuple(changed if c.name == name else c for c in log))

    return apply


def second_source(
    name: str, function: Callable[[FloatArray], FloatArray], *, first: bool
) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that adds another source of a channel before or after the right one."""

    def apply(log: TrialLog) -> TrialLog:
        channel = log[name]
        other = replace(channel, source="second", values=function(channel.values))
        channels = (other, *log.channels) if first else (*log.channels, other)
        return replace(log, channels=channels)

    return apply


def delayed(name: str, secs: float) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that writes the times of a channel late."""

    def apply(log: TrialLog) -> TrialLog:
        channel, delay = log[name], round(secs * 1e9)
        return with_channel(
            log, name,
            measured_ns=channel.measured_ns + delay, received_ns=channel.received_ns + delay,
        )  # fmt: skip

    return apply


def all_times(function: Callable[[TimeArray], TimeArray]) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion of all times, which are given in ns since the start."""

    def changed(times: TimeArray) -> TimeArray:
        return START_NS + function(times - START_NS)

    def apply(log: TrialLog) -> TrialLog:
        channels = tuple(
            replace(c, measured_ns=changed(c.measured_ns), received_ns=changed(c.received_ns))
            for c in log.channels
        )
        return replace(log, channels=channels)

    return apply


def geographic(
    change: Callable[[FloatArray], FloatArray] | None = None,
    datum: tuple[float, float] = DATUM,
    *,
    altitude: float = np.nan,
) -> Callable[[TrialLog], TrialLog]:
    """Return a distortion that writes the fixes as latitude and longitude, then changes those.

    Parameters
    ----------
    change
        A function of latitude and longitude, (n, 2) deg.
    datum
        Latitude and longitude of the start, deg.
    altitude
        The altitude, m.
    """

    def apply(log: TrialLog) -> TrialLog:
        position = log["position"]
        if position.fields == GEOGRAPHIC:
            globe = position.values[:, :2]
        else:
            places = LocalFrame(datum, geographic=True).to_geographic(
                LocalPositions(*position.values.T)
            )
            globe = np.column_stack((places.latitude, places.longitude))
        globe = change(globe.copy()) if change else globe
        values = np.column_stack((globe, np.full(len(globe), altitude)))
        return with_channel(log, "position", unit="deg", fields=GEOGRAPHIC, values=values)

    return apply
