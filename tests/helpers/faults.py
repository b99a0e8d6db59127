"""Sensor faults that happen on board, as pure functions TrialLog -> TrialLog."""

from collections.abc import Callable
from dataclasses import replace
from math import radians

import numpy as np

from shiplog import Channel, TrialLog

Fault = Callable[[TrialLog], TrialLog]


def dropout(name: str, start_secs: float, length_secs: float) -> Fault:
    """Remove the samples of an interval."""

    def change(channel: Channel) -> Channel:
        at = _time_secs(channel)
        return _with_rows(channel, (at < start_secs) | (at >= start_secs + length_secs))

    return _on_channel(name, change)


def freeze(name: str, start_secs: float, length_secs: float) -> Fault:
    """Repeat the first value of an interval throughout it."""

    def change(channel: Channel) -> Channel:
        at, values = _time_secs(channel), channel.values.copy()
        stuck = (at >= start_secs) & (at < start_secs + length_secs)
        values[stuck] = values[stuck][0]
        return replace(channel, values=values)

    return _on_channel(name, change)


def spike(name: str, at_secs: float, size: float) -> Fault:
    """Add an error to one sample."""

    def change(channel: Channel) -> Channel:
        values = channel.values.copy()
        values[np.searchsorted(_time_secs(channel), at_secs)] += size
        return replace(channel, values=values)

    return _on_channel(name, change)


def clock_jump(name: str, at_secs: float, jump_secs: float) -> Fault:
    """Set the sensor's clock: all later samples have a later time stamp."""

    def change(channel: Channel) -> Channel:
        later = (_time_secs(channel) >= at_secs) * round(jump_secs * 1e9)
        return replace(channel, measured_ns=channel.measured_ns + later)

    return _on_channel(name, change)


def bias(name: str, offset: float) -> Fault:
    """Add a constant error to all samples."""
    return _on_channel(name, lambda channel: replace(channel, values=channel.values + offset))


def _on_channel(name: str, change: Callable[[Channel], Channel]) -> Fault:
    def fault(log: TrialLog) -> TrialLog:
        changed = tuple(change(c) if c.name == name else c for c in log.channels)
        return replace(log, channels=changed)

    return fault


def _time_secs(channel: Channel) -> np.ndarray:
    return (channel.measured_ns - channel.measured_ns[0]) * 1e-9


def _with_rows(channel: Channel, kept: np.ndarray) -> Channel:
    return replace(
        channel,
        measured_ns=channel.measured_ns[kept],
        received_ns=channel.received_ns[kept],
        values=channel.values[kept],
    )


# each with the channel that the regression check must name first
FAULTS: dict[str, tuple[Fault, str]] = {
    "dropout of the gyro": (dropout("yaw_rate", 100.0, 5.0), "/yaw_rate/measured"),
    "dropout of the log": (dropout("speed", 100.0, 5.0), "/speed/measured"),
    "dropout of the rudder": (dropout("rudder", 100.0, 5.0), "/rudder/measured"),
    "one lost sample": (dropout("yaw_rate", 100.0, 0.1), "/yaw_rate/measured"),
    "frozen gyro": (freeze("yaw_rate", 100.0, 3.0), "/yaw_rate/measured"),
    "frozen log": (freeze("speed", 100.0, 3.0), "/speed/measured"),
    "spike of the gyro": (spike("yaw_rate", 150.0, radians(0.01)), "/yaw_rate/measured"),
    "spike of the rpm": (spike("rpm", 150.0, 1.0), "/rpm/measured"),
    "clock jump of the gyro": (clock_jump("yaw_rate", 200.0, 0.3), "/yaw_rate/measured"),
    "clock jump of the rudder": (clock_jump("rudder", 200.0, 0.3), "/rudder/measured"),
    "biased gyro": (bias("yaw_rate", radians(1e-4)), "/yaw_rate/measured"),
    "biased rudder": (bias("rudder", radians(1e-4)), "/rudder/measured"),
}
