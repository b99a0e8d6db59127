"""Data types of a trial: channels, logs, and signals on one uniform clock.

A `Channel` holds the samples of one sensor with their own times. A `TrialLog` holds the channels of
a trial in memory; `Log` is the interface that it shares with `shiplog.LogFile`, a log read from its
file chunk by chunk. `Signals` are channels resampled to one clock.

All are immutable: their arrays are read-only views and their mappings reject assignment. All can be
pickled and deep-copied, and the copies are read-only too. Imports nothing of the other folders,
except for the conversions of `TrialLog` to tables, when they are called.
"""

from .arrays import FloatArray, ReadOnlyMapping, TimeArray, is_sorted, read_only
from .channel import Channel, concatenate_channels
from .channels_by_name import ChannelsByName, NamedChannel
from .event import Event, EventLevel
from .log import TrialLog
from .log_interface import ChunkedLog, Log
from .raw_packets import RawPackets
from .signals import Signals, concatenate_signals

__all__ = [
    "Channel",
    "ChannelsByName",
    "ChunkedLog",
    "Event",
    "EventLevel",
    "FloatArray",
    "Log",
    "NamedChannel",
    "RawPackets",
    "ReadOnlyMapping",
    "Signals",
    "TimeArray",
    "TrialLog",
    "concatenate_channels",
    "concatenate_signals",
    "is_sorted",
    "read_only",
]
