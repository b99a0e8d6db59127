"""Resampling: the channels of a log, each with its own times, on one uniform clock.

`clock` chooses the clock, `grid` places the samples on it, by a resampler for each channel
(`channel_resamplers`). Measured channels (yaw rate, speed) are averaged about each instant;
commanded ones (rudder, rpm) and angles are interpolated, but not across a gap; channels that are
written only when they change are held. Where nothing was measured there is NaN. Imports nothing of
`shiplog.mcap`, `shiplog.tables` or `shiplog.vessel`.
"""

from .clock import MAX_INSTANTS, Clock, choose_clock, with_steering_gear
from .grid import resample, resample_chunks

__all__ = [
    "MAX_INSTANTS",
    "Clock",
    "choose_clock",
    "resample",
    "resample_chunks",
    "with_steering_gear",
]
