"""Sources of quantities on one clock, as they are compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_on_clock import ChannelOnClock, Frames, Unwrapped
from shiplog.checks.channel_stats import ChannelStats
from shiplog.types import ChunkedLog, FloatArray
from shiplog.units import CATALOGUE, display_conversion

MAX_INSTANTS = 20_000  # of the clock on which sources are compared
MIN_INSTANTS = 20  # at which two sources are known, to compare them
# A smaller difference (rms) is no disagreement, in display units; of any other quantity 1 %.
MIN_DISAGREEMENT = {
    "yaw_rate": 0.02, "speed": 0.3, "rudder": 0.5, "heading": 1.0, "position": 30.0, "sway": 0.3,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class ComparedSource:
    """One source of a quantity on the common clock.

    Attributes
    ----------
    stats
        Statistics of its channel.
    values
        (n,), or (n, 2) m for positions; NaN in gaps and beyond its ends. Headings are unwrapped.
    """

    stats: ChannelStats
    values: FloatArray

    @property
    def coverage(self) -> float:
        """Share of the clock at which the source is known."""
        return float(np.isfinite(self.values).reshape(len(self.values), -1).all(axis=1).mean())

    @property
    def is_dead(self) -> bool:
        """Whether the source does not vary; revolutions that are constant are dead only at 0."""
        known = self.values[np.isfinite(self.values)]
        if not len(known):
            return True
        return float(np.ptp(known)) == 0.0 and (self.stats.name != "rpm" or known[0] == 0)

    @property
    def noise(self) -> float:
        """Standard deviation of the white noise, from third differences on the clock."""
        differences = np.diff(self.values, 3, axis=0)
        known = differences[np.isfinite(differences)]
        return float(1.4826 * np.median(np.abs(known)) / np.sqrt(20)) if len(known) else 0.0


def sources_on_one_clock(
    log: ChunkedLog, channels: Sequence[ChannelStats]
) -> tuple[FloatArray, list[ComparedSource]]:
    """Interpolate channels at the instants of one clock, in one pass over the log.

    Returns
    -------
    clock
        (n,) s since its start.
    sources
        One for each channel, in their order.
    """
    alive = [channel for channel in channels if channel.valid > 1]
    start = min((c.valid_span_ns[0] for c in alive), default=0)
    span = (max((c.valid_span_ns[1] for c in alive), default=0) - start) * 1e-9
    intervals = [c.interval_secs for c in alive if c.interval_secs > 0]
    dt = max(min(intervals, default=1.0), span / MAX_INSTANTS, 1e-3)
    clock = np.arange(int(span / dt) + 1) * dt
    frames: Frames = {}  # all positions of one kind have one datum
    gathered = [
        ChannelOnClock(channel, clock, start, Unwrapped() if is_circular(channel) else None, frames)
        for channel in channels
    ]
    for chunk in log.chunks():
        for each in gathered:
            each.add(chunk)
    return clock, [_source(each) for each in gathered]


def _source(gathered: ChannelOnClock) -> ComparedSource:
    values = gathered.result()
    if gathered.stats.valid < 2:
        values = np.full_like(values, np.nan)
    return ComparedSource(gathered.stats, values if gathered.stats.fields else values[:, 0])


def is_circular(channel: ChannelStats) -> bool:
    """Return whether the values of a channel start again after a full turn."""
    kind = CATALOGUE.get(channel.name)
    return kind is not None and kind.circular


def min_disagreement(name: str, sources: Sequence[ComparedSource]) -> float:
    """Return the rms difference below which sources of a quantity agree, in its unit."""
    _, factor = display_unit(sources[0].stats)
    if name in MIN_DISAGREEMENT:
        return MIN_DISAGREEMENT[name] / factor
    known = np.concatenate([np.ravel(source.values) for source in sources])
    known = known[np.isfinite(known)]
    return 0.01 * float(np.max(np.abs(known))) if len(known) else 0.0


def display_unit(channel: ChannelStats) -> tuple[str, float]:
    """Return the unit in which a channel is shown, and the factor to it."""
    return ("m", 1.0) if channel.fields else display_conversion(channel.name, channel.unit)


def root_mean_square(values: FloatArray) -> float:
    """Return the rms of the finite values, (n,) or (n, k); NaN with fewer than `MIN_INSTANTS`."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) >= MIN_INSTANTS else np.nan
