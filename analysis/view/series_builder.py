"""The series of a replay, built chunk by chunk in the units people use."""

import numpy as np

from analysis.filters.base import OUTPUT_STATES
from analysis.replay.replay_results import ReplayChunk
from analysis.report.display import BAND_STDS, DISTURBANCES
from analysis.signals.signal_stats import SignalStats
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.resampling import Clock
from shiplog.ships.paper import PAPER_OUTPUTS

from .decimation import Decimator, bucket_size, is_long
from .panels import review_unit
from .sensor_panels import SensorSeries
from .series import (
    BLUE,
    CYAN,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Line,
    MeasuredSamples,
    Series,
    banded,
)
from .steering_panels import WIDTH, heading_series, rudder_series

STEERING = "steering"  # the panel of heading and rudder


class SeriesBuilder:
    """Builds the series of a replay from its chunks, and keeps what a screen can show of each.

    Parameters
    ----------
    clock
        The clock of the replay.
    stats
        Statistics of its signals.
    """

    def __init__(self, clock: Clock, stats: SignalStats) -> None:
        self._clock, self._long = clock, is_long(clock.count)
        self._decimators: dict[str, Decimator] = {}
        self._sensors = SensorSeries(clock)
        self._samples = {
            name: MeasuredSamples(longest)
            for name, longest in zip(PAPER_OUTPUTS, stats.gap_steps, strict=True)
        }
        self._first_heading: float | None = None  # rad
        if "heading" in clock.channels:
            gap_secs = gap_threshold_secs(clock.channels["heading"].interval_secs)
            self._samples["heading"] = MeasuredSamples(gap_secs / clock.dt_secs)

    def add(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Add the next chunk; return its series over time, by entity, with every sample."""
        dense = self._outputs(chunk) | _inputs(chunk) | _disturbances(chunk)
        dense |= self._heading(chunk) | self._sensors.step(chunk)
        for entity, series in (dense | _sparse(chunk)).items():
            if entity not in self._decimators:
                size = bucket_size(self._clock.count, len(series.lines))
                self._decimators[entity] = Decimator(size * self._clock.dt_secs)
            self._decimators[entity].add(series)
        return dense

    def result(self) -> dict[str, Series]:
        """Return all series, by entity, each decimated, once all chunks were added."""
        return {entity: decimator.result() for entity, decimator in self._decimators.items()}

    def _outputs(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Measured and estimated yaw rate and speed, the wave, and the normalised innovations."""
        drawn = {}
        estimates, at = chunk.estimates, chunk.signals.time_secs
        for i, (name, state, colour) in enumerate(
            zip(PAPER_OUTPUTS, OUTPUT_STATES, (BLUE, ORANGE), strict=True)
        ):
            scale = review_unit(name)[1]
            innovation = estimates.innovations[:, i] / estimates.innovation_stds[:, i]
            rows, columns = self._samples[name].step(
                chunk.signals.first, np.column_stack((chunk.signals[name] * scale, innovation))
            )
            times, (measured, normalised) = rows * chunk.signals.dt_secs, columns.T
            line = Line("measured", measured, GREY, 2.5)
            drawn[f"{name}/measured"] = Series("measured", times, (line,), spiky=True)
            value = estimates.states[:, state] * scale
            band = banded("estimate", value, BAND_STDS * estimates.stds[:, state] * scale, colour)
            drawn[f"{name}/state"] = Series("state", at, band, spiky=self._long)
            if state == 0 and estimates.wave is not None:
                line = Line("wave", estimates.wave * scale, CYAN)
                drawn[f"{name}/wave"] = Series("wave", at, (line,), spiky=True)
            line = Line("innovation", normalised, colour)
            series = Series("normalised", times, (line,), spiky=True)
            drawn[f"innovation_{name}/normalised"] = series
        return drawn

    def _heading(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Heading from its first value, without jumps at north; nothing where none is measured."""
        if "heading" not in chunk.signals or "heading" not in self._samples:
            return {}
        heading = chunk.signals["heading"]
        known = heading[np.isfinite(heading)]
        if self._first_heading is None:
            self._first_heading = float(known[0]) if len(known) else None
        if self._first_heading is None:
            return {}
        turned = np.degrees(heading - self._first_heading)[:, None]
        rows, columns = self._samples["heading"].step(chunk.signals.first, turned)
        (series,) = heading_series(rows * chunk.signals.dt_secs, columns[:, 0])
        return {f"{STEERING}/heading/{series.name}": series}


def _inputs(chunk: ReplayChunk) -> dict[str, Series]:
    """Rudder and revolutions."""
    at = chunk.signals.time_secs
    rudder = rudder_series(at, np.degrees(chunk.signals["rudder"]))
    line = Line("rpm", chunk.signals["rpm"], GREEN, WIDTH)
    return {
        f"{STEERING}/rudder/{rudder.name}": rudder,
        "rpm/measured": Series("measured", at, (line,), spiky=True),
    }


def _disturbances(chunk: ReplayChunk) -> dict[str, Series]:
    """The slow disturbances of yaw and surge, and waves and wind where they are estimated.

    Those that are states of the filter have bands.
    """
    found, at = chunk.disturbance, chunk.signals.time_secs
    parts = (
        ("yaw", found.yaw, found.yaw_wave, found.yaw_wind),
        ("surge", found.surge, found.surge_wave, found.surge_wind),
    )
    drawn = {}
    for axis, (name, values, wave, wind) in enumerate(parts):
        _, _, scale = DISTURBANCES[name]
        lines: tuple[Line, ...] = (Line("disturbance", values * scale, RED, 1.5),)
        if found.stds is not None:
            half_width = BAND_STDS * found.stds[:, axis] * scale
            lines = banded("disturbance", values * scale, half_width, RED)
        drawn[f"disturbance_{name}/estimate"] = Series("estimate", at, lines)
        if wave is not None:
            line = Line("wave", wave * scale, CYAN)
            drawn[f"disturbance_{name}/wave"] = Series("wave", at, (line,), spiky=True)
        if wind is not None:
            line = Line("wind", wind * scale, GREEN)
            drawn[f"disturbance_{name}/wind"] = Series("wind", at, (line,), spiky=True)
    return drawn


def _sparse(chunk: ReplayChunk) -> dict[str, Series]:
    """Coefficients with their standard deviations in SI, and the track in m."""
    drawn = {}
    for history in (chunk.yaw_history, chunk.surge_history):
        for i, name in enumerate(history.names):
            value, std = history.values[:, i], history.stds[:, i]
            lines = Line("value", value, GREY), Line("std", std, GREY)
            drawn[f"coefficient_{name}/per_window"] = Series("per_window", history.time_secs, lines)
    lines = Line("north", chunk.track.north, GREY), Line("east", chunk.track.east, GREY)
    drawn["track"] = Series("track", chunk.track.time_secs, lines)
    if "heading" in chunk.signals:
        heading = chunk.signals["heading"]
        known = np.isfinite(heading)
        line = Line("heading", heading[known], GREY)
        drawn["heading"] = Series("heading", chunk.signals.time_secs[known], (line,))
    return drawn
