"""What in a log may not be what it seems: said before anything is built on it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from shiplog import Signals, TrialLog
from shiplog.clock import gap_threshold_secs
from shiplog.gyro_bias import gyro_bias_warning
from shiplog.rudder_sign import rudder_sign_warning
from shiplog.types import FloatArray, TimeArray
from shiplog.units import CATALOGUE

ASTERN_SHARE = 0.01  # of the samples: a single one may be noise about rest


def possible(log: TrialLog) -> TrialLog:
    """The log with what no ship does as not measured; `quality.examine` has said where."""
    channels = []
    for channel in log:
        kind = CATALOGUE.get(channel.name)
        if kind is not None and not channel.fields:
            values = channel.values
            credible = (values >= kind.lowest) & (values <= kind.highest)
            channels.append(replace(channel, values=np.where(credible, values, np.nan)))
        else:
            channels.append(channel)
    return replace(log, channels=tuple(channels))


def doubtful(log: TrialLog, needed: tuple[str, ...]) -> Iterator[str]:
    """Sources to choose from, sensors that seem dead, signs that seem contrary."""
    for name in needed:
        sources = [channel.source for channel in log if channel.name == name]
        if len(sources) > 1:
            yield (
                f"{name}: {len(sources)} sources ({', '.join(sources)}), {sources[0]} is used; "
                f"--source {name}={sources[1]} chooses another"
            )
    yield from _dead(log)
    for name in ("speed", "rpm"):
        values = _known(log, name)
        if np.mean(values < 0) > ASTERN_SHARE:
            yield f"{name}: astern in places, where the model does not hold"
    for warning in (rudder_sign_warning(log), gyro_bias_warning(log)):
        if warning:
            yield warning


def _dead(log: TrialLog) -> Iterator[str]:
    """Sensors that say the same throughout although the ship moved."""
    turned = np.ptp(_known(log, "yaw_rate")) > np.radians(0.1)
    went = np.median(_known(log, "speed")) > 1.0
    for name in ("yaw_rate", "speed", "rudder"):
        if np.ptp(_known(log, name)) == 0 and (turned or name != "rudder"):
            yield f"{log[name].topic}: never changes; if the sensor was dead, choose another"
    if went and not _known(log, "rpm").any():
        yield f"{log['rpm'].topic}: 0 throughout, though the ship goes; the model needs it"


def silent_ends(log: TrialLog, signals: Signals, needed: tuple[str, ...]) -> Iterator[str]:
    """Parts of the log that are not replayed, or only predicted, for want of a channel."""
    first, last = signals.start_ns, int(signals.stamps_ns[-1])
    begun = {name: int(_times(log, name).min()) for name in needed}
    ended = {name: int(_times(log, name).max()) for name in needed}
    late = max(begun, key=lambda name: begun[name])
    wait = (first - min(begun.values())) * 1e-9
    if wait > gap_threshold_secs(log[late]):
        yield f"{late}: sets in {wait:.1f} s after the others; the replay begins there"
    rest = (max(ended.values()) - last) * 1e-9
    if rest > max(gap_threshold_secs(log[name]) for name in needed):
        ceased = min(needed, key=lambda name: abs(ended[name] - last))
        yield f"{ceased}: ends {rest:.1f} s before the others; the replay ends there"
    for name in needed:
        silent = (last - ended[name]) * 1e-9
        if silent > gap_threshold_secs(log[name]):
            yield f"{name}: silent for the last {silent:.1f} s, which are only predicted"


def _known(log: TrialLog, name: str) -> FloatArray:
    values = log[name].values
    return values[np.isfinite(values)]


def _times(log: TrialLog, name: str) -> TimeArray:
    channel = log[name]
    return channel.measured_ns[np.isfinite(channel.values)]
