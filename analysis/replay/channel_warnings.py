"""What in a log may not be what it seems: said before anything is built on it."""

from collections.abc import Iterator

import numpy as np

from shiplog.checks.channel_stats import LogStats
from shiplog.resampling import Clock

ASTERN_SHARE = 0.01  # of the samples: a single one may be noise about rest


def channel_warnings(found: LogStats, needed: tuple[str, ...]) -> Iterator[str]:
    """Sources to choose from, and sensors that seem dead or to go astern."""
    for name in needed:
        sources = [channel.source for channel in found if channel.name == name]
        if len(sources) > 1:
            yield (
                f"{name}: {len(sources)} sources ({', '.join(sources)}), {sources[0]} is used; "
                f"--source {name}={sources[1]} chooses another"
            )
    yield from _dead(found)
    for name in ("speed", "rpm"):
        if found[name].negative_share > ASTERN_SHARE:
            yield f"{name}: astern in places, where the model does not hold"


def _dead(found: LogStats) -> Iterator[str]:
    """Sensors that say the same throughout although the ship moved."""
    ranges = {name: np.ptp(found[name].value_range) for name in ("yaw_rate", "speed", "rudder")}
    turned = ranges["yaw_rate"] > np.radians(0.1)
    for name, reach in ranges.items():
        if reach == 0 and (turned or name != "rudder"):
            yield f"{found[name].topic}: never changes; if the sensor was dead, choose another"
    if found["speed"].median > 1.0 and found["rpm"].value_range == (0.0, 0.0):
        yield f"{found['rpm'].topic}: 0 throughout, though the ship goes; the model needs it"


def end_warnings(found: LogStats, clock: Clock, needed: tuple[str, ...]) -> Iterator[str]:
    """Parts of the log that are not replayed, or only predicted, for want of a channel."""
    first, last = clock.start_ns, clock.end_ns
    begun = {name: found[name].valid_span_ns[0] for name in needed}
    ended = {name: found[name].valid_span_ns[1] for name in needed}
    late = max(begun, key=lambda name: begun[name])
    wait = (first - min(begun.values())) * 1e-9
    if wait > found[late].gap_threshold_secs:
        yield f"{late}: sets in {wait:.1f} s after the others; the replay begins there"
    rest = (max(ended.values()) - last) * 1e-9
    if rest > max(found[name].gap_threshold_secs for name in needed):
        ceased = min(needed, key=lambda name: abs(ended[name] - last))
        yield f"{ceased}: ends {rest:.1f} s before the others; the replay ends there"
    for name in needed:
        silent = (last - ended[name]) * 1e-9
        if silent > found[name].gap_threshold_secs:
            yield f"{name}: silent for the last {silent:.1f} s, which are only predicted"
