"""The wind on the clock of a replay: its channels, and the regressors of its terms from them.

The wind relative to the ship is taken as measured; without it the wind over the water is converted,
by the ship's speed and, where it is stated from north, by the heading.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from analysis.filters.wind_terms import apparent_wind, wind_regressors
from analysis.signals.hold import hold_last
from shiplog import Signals
from shiplog.checks.channel_stats import LogStats
from shiplog.errors import UsageError
from shiplog.resampling import Clock
from shiplog.types import FloatArray
from shiplog.vessel.settings import WIND, DisturbanceSettings, FilterSettings


class WindChannels(NamedTuple):
    """Channels that state a wind.

    Attributes
    ----------
    speed, angle
        Names of the channels.
    is_apparent
        Whether the wind is relative to the ship.
    from_north
        Whether the angle is from north, else from ahead.
    """

    speed: str
    angle: str
    is_apparent: bool
    from_north: bool


# the first that a log has is used
WIND_CHANNELS = (
    WindChannels("apparent_wind_speed", "apparent_wind_angle", True, False),
    WindChannels("wind_speed", "true_wind_angle", False, False),
    WindChannels("wind_speed", "wind_direction", False, True),
)
WIND_CHANNEL_NAMES = tuple(dict.fromkeys(n for pair in WIND_CHANNELS for n in pair[:2]))
REQUIRED = (
    "it needs apparent_wind_speed and apparent_wind_angle, or wind_speed with true_wind_angle, or "
    "wind_speed and wind_direction with a heading"
)


def check_wind_settings(
    filter_settings: FilterSettings, disturbance: DisturbanceSettings, *, has_further_states: bool
) -> None:
    """Raise `UsageError` where a wind is asked for that the other settings exclude.

    Parameters
    ----------
    filter_settings, disturbance
        The settings of ``[filter]`` and ``[disturbance]``.
    has_further_states
        Whether the filter can have disturbances as states.
    """
    if WIND not in disturbance.models:
        return
    if not (filter_settings.smooth and has_further_states):
        raise UsageError(
            "disturbance.models has wind, whose coefficients are states of a smoothed filter: set "
            "filter.smooth (--smooth) with 'extended' or 'pseudo-input', or remove wind"
        )
    if set(disturbance.models) == {WIND}:
        raise UsageError(
            "disturbance.models has wind alone, so that every other force would count as wind; add "
            "constant"
        )


def with_wind_channels(clock: Clock, stats: LogStats) -> Clock:
    """Return the clock with the channels of the wind.

    Raises
    ------
    UsageError
        The log does not state the wind.
    """
    for pair in WIND_CHANNELS:
        measured = all(name in stats and stats[name].valid > 1 for name in pair[:2])
        if measured and (not pair.from_north or "heading" in clock.channels):
            added = {name: replace(stats[name], interpolation="linear") for name in pair[:2]}
            return replace(clock, channels={**clock.channels, **added})
    present = [name for name in WIND_CHANNEL_NAMES if name in stats]
    it_has = f"it has {', '.join(present)}" if present else "it has none"
    raise UsageError(
        f"disturbance.models has wind, but {stats.name} does not state the wind relative to the "
        f"ship: {it_has}; {REQUIRED}; remove wind"
    )


class WindSignals:
    """Adds the regressors of the wind's terms to signals, chunk by chunk, if the clock has a wind.

    Where the wind is not measured, the last one is held; before the first there is none. Where the
    chunks are cut changes no result.

    Parameters
    ----------
    clock
        The clock of the signals.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._pair = next((p for p in WIND_CHANNELS if set(p[:2]) <= set(clock.channels)), None)
        self._last: dict[str, float] = {}
        self._missing = 0

    def step(self, signals: Signals) -> Signals:
        """Return the next chunk with the regressors, m²/s², by the names of `WIND_TERMS`."""
        if self._pair is None:
            return signals
        names = [*self._pair[:2], "speed", *(["heading"] if self._pair.from_north else [])]
        measured = {name: signals[name] for name in names}
        needed = np.column_stack([values for name, values in measured.items() if name != "speed"])
        self._missing += int(np.sum(np.isnan(needed).any(axis=1)))
        values = {
            name: hold_last(each, self._last.get(name, np.nan)) for name, each in measured.items()
        }
        self._last = {name: float(each[-1]) for name, each in values.items()}
        terms = {
            name: np.where(np.isfinite(each), each, 0.0)
            for name, each in self._regressors(values).items()
        }
        return replace(signals, values=dict(signals.values) | terms)

    def _regressors(self, values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return the regressors; NaN before the first measured wind."""
        if self._pair is None:
            return {}
        speed, angle, ahead = values[self._pair.speed], values[self._pair.angle], values["speed"]
        if self._pair.from_north:
            angle = angle - values["heading"]
        if not self._pair.is_apparent:
            speed, angle = apparent_wind(speed, angle, ahead)
        return wind_regressors(speed, angle, ahead)

    def warnings(self) -> list[str]:
        """Return a warning where the wind was not measured for long."""
        if self._pair is None:
            return []
        secs = self._missing * self._clock.dt_secs
        longest = max(self._clock.channels[name].gap_threshold_secs for name in self._pair[:2])
        if secs <= longest:
            return []
        text = f"wind: not measured for {secs:.1f} s in all; held at its last value there, and "
        return [text + "none before the first: its moment and force are less reliable there"]
