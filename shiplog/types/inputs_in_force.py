"""Values of commanded inputs that are in force at the start of a cut."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.units import CATALOGUE

from .channel import Channel

MAX_WAIT_NS = 10**9  # of a cut's start for the first sample; later, the value before is kept
ChannelKey = tuple[str, tuple[str, ...]]  # topic and fields


@dataclass
class _AroundStart:
    """The valid samples of one channel next to the start of a cut; None where there is none."""

    before: Channel | None = None
    following: Channel | None = None


def inputs_in_force(
    chunks: Iterable[Sequence[Channel]], start_ns: int
) -> dict[ChannelKey, Channel]:
    """Return the last samples of the commanded inputs before a cut, at its start.

    An input that is written only when it changes keeps its value until the next sample. Where the
    first valid sample of an input within the cut is within a second of the start, none is needed.

    Parameters
    ----------
    chunks
        The log, in one chunk or several.
    start_ns
        The start of the cut, ns.

    Returns
    -------
    samples
        A channel of one sample, measured at `start_ns`, for each input that needs it.

    Examples
    --------
    >>> times = 10**9 * np.array([0, 70, 150])
    >>> rpm = Channel("rpm", "order", "rpm", times, times, np.array([80.0, 90.0, 85.0]))
    >>> inputs_in_force([[rpm]], 120 * 10**9)["/rpm/order", ()].values.tolist()
    [90.0]
    """
    around: dict[ChannelKey, _AroundStart] = {}
    for chunk in chunks:
        for channel in chunk:
            kind = CATALOGUE.get(channel.name)
            if kind is not None and kind.commanded and not channel.fields:
                valid = np.flatnonzero(np.isfinite(channel.values))
                _add(around.setdefault(channel.key, _AroundStart()), channel.take(valid), start_ns)
    return {
        key: _at_start(each.before, each.following, start_ns)
        for key, each in around.items()
        if each.before is not None
        and (each.following is None or int(each.following.measured_ns[0]) > start_ns + MAX_WAIT_NS)
    }


def with_inputs_in_force(
    channels: Iterable[Channel], samples: Mapping[ChannelKey, Channel]
) -> tuple[Channel, ...]:
    """Return the channels of a cut, or of its first chunk, with the samples put before them."""
    return tuple(
        _prepended(channel, samples[channel.key]) if channel.key in samples else channel
        for channel in channels
    )


def _add(around: _AroundStart, channel: Channel, start_ns: int) -> None:
    """Add the next valid samples of a channel, in any order of their measured times."""
    times = channel.measured_ns
    before, following = np.flatnonzero(times < start_ns), np.flatnonzero(times >= start_ns)
    if len(before):
        row = int(before[len(before) - 1 - np.argmax(times[before][::-1])])
        if around.before is None or times[row] >= around.before.measured_ns[0]:
            around.before = channel.take(np.array([row]))
    if len(following):
        row = int(following[np.argmin(times[following])])
        if around.following is None or times[row] < around.following.measured_ns[0]:
            around.following = channel.take(np.array([row]))


def _at_start(before: Channel, following: Channel | None, start_ns: int) -> Channel:
    """Return a sample at the start of the cut; it is received before the following one."""
    received = before.received_ns + (start_ns - before.measured_ns)
    if following is not None:
        received = np.minimum(received, following.received_ns)
    return replace(before, measured_ns=np.array([start_ns]), received_ns=received)


def _prepended(channel: Channel, sample: Channel) -> Channel:
    return replace(
        channel,
        measured_ns=np.concatenate((sample.measured_ns, channel.measured_ns)),
        received_ns=np.concatenate((sample.received_ns, channel.received_ns)),
        values=np.concatenate((sample.values, channel.values)),
    )
