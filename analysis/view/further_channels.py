"""Panels of the channels that a replay does not use, drawn at their own times.

Channels of one quantity share a panel, with a line for each source; an order is drawn in the panel
of what it commands.
"""

from analysis.replay.passes import REQUIRED_CHANNELS
from shiplog.checks.channel_stats import ChannelStats
from shiplog.resampling import Clock
from shiplog.screening import Screening
from shiplog.types import Channel

from .channel_series import ChannelSeries, DrawnQuantity, channel_label, channels_by_quantity
from .panels import Panel
from .quantity_panel import has_any_value, quantity_panel


class FurtherChannels:
    """Draws the channels of a log that a replay does not use, chunk by chunk.

    The heading counts as used, as it is drawn over the rudder. Of a quantity with several sources
    all are drawn, the one that the replay uses included.
    Positions are not drawn, as they are the track, nor are the times of a satellite receiver. Where
    the chunks are cut changes no result.

    Parameters
    ----------
    screening
        What the replay uses of the log, with the statistics of all channels.
    clock
        The clock of the replay, from whose start to whose end channels are drawn.
    full
        Whether to keep every sample, in memory; by default what a screen can show.
    """

    def __init__(self, screening: Screening, clock: Clock, *, full: bool = False) -> None:
        span = clock.start_ns, (clock.count - 1) * clock.dt_secs
        drawn = {*REQUIRED_CHANNELS, *({"heading"} & set(clock.channels))}
        self._groups = {
            quantity: [
                ChannelSeries(
                    channel, span, quantity, _label(channel, quantity, screening), full=full
                )
                for channel in channels
            ]
            for quantity, channels in channels_by_quantity(screening.all_stats).items()
            if quantity.name not in drawn or len(channels) > 1
        }

    def __bool__(self) -> bool:
        """Whether the log has any further channel."""
        return bool(self._groups)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next chunk of the log as recorded, with all sources."""
        for group in self._groups.values():
            for series in group:
                series.add(chunk)

    def panels(self) -> list[Panel]:
        """Return a panel of each quantity that has a value on the clock, after all chunks."""
        panels: list[Panel] = []
        for quantity, group in self._groups.items():
            drawn = [series for each in group if has_any_value(series := each.result())]
            if drawn:
                panels.append(quantity_panel(f"further/{len(panels)}", quantity, drawn))
        return panels


def _label(channel: ChannelStats, quantity: DrawnQuantity, screening: Screening) -> str:
    """Return the label of a channel, which marks the source that the replay uses."""
    label = channel_label(channel, quantity)
    return f"{label} (used)" if screening.sources.get(channel.name) == channel.source else label
