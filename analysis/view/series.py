"""What is drawn of a replay: series in the units people use, thinned to what a screen can show.

Nothing about the ship is computed here, and nothing is known of the program that draws.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.disturbance.observer import DISTURBANCE_UNITS
from analysis.filters.base import OUTPUT_STATES
from analysis.replay.replay import ReplayChunk
from analysis.signals.signal_stats import SignalStats
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.compiled import compiled
from shiplog.resampling import Clock
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, conversion_factor

POINTS = 20_000  # a series: more than a screen has, and quickly drawn
BAND_STDS = 2.0  # standard deviations, of every band drawn

Colour = tuple[int, int, int, int]
GREY: Colour = (140, 140, 140, 255)
CYAN: Colour = (60, 190, 210, 255)
GREEN: Colour = (76, 175, 80, 255)
BLUE: Colour = (66, 150, 245, 255)  # what is said of yaw
ORANGE: Colour = (245, 140, 40, 255)  # what is said of surge
RED: Colour = (225, 70, 80, 255)


@dataclass(frozen=True, eq=False)
class Line:
    """A named line of a series."""

    name: str
    values: FloatArray  # (n,); NaN is a gap
    colour: Colour
    width: float = 1.0


@dataclass(frozen=True, eq=False)
class Series:
    """Lines that share their times."""

    name: str  # later in the alphabet is drawn on top
    time_secs: FloatArray  # (n,) since the signals' start
    lines: tuple[Line, ...]
    spiky: bool = False  # where many points fall on a pixel, its extremes matter, not its mean


class SeriesBuilder:
    """Draws a replay as its chunks come, and keeps of each series what a screen can show."""

    def __init__(self, clock: Clock, stats: SignalStats) -> None:
        self._clock, self._spiky = clock, clock.count > POINTS
        self._thinned: dict[str, Decimator] = {}
        self._samples = {
            name: _Samples(longest)
            for name, longest in zip(PAPER_OUTPUTS, stats.longest_steps, strict=True)
        }

    def add(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Draw the next chunk; its series over time, by entity, whole."""
        dense = {
            entity: series
            for part in (self._outputs(chunk), self._inputs(chunk), self._disturbances(chunk))
            for entity, series in part.items()
        }
        for entity, series in (dense | _sparse(chunk)).items():
            if entity not in self._thinned:
                stretch = _stretch(self._clock.count, len(series.lines))
                self._thinned[entity] = Decimator(stretch * self._clock.dt_secs)
            self._thinned[entity].add(series)
        return dense

    def result(self) -> dict[str, Series]:
        """All series, by entity, each thinned to about `POINTS`, once all chunks were added."""
        return {entity: decimated.result() for entity, decimated in self._thinned.items()}

    def _outputs(self, chunk: ReplayChunk) -> dict[str, Series]:
        drawn = {}
        estimates, at = chunk.estimates, chunk.signals.time_secs
        for i, (name, state, colour) in enumerate(
            zip(PAPER_OUTPUTS, OUTPUT_STATES, (BLUE, ORANGE), strict=True)
        ):
            scale = conversion_factor(CATALOGUE[name].unit, CATALOGUE[name].display_unit)
            residual = estimates.innovations[:, i] / estimates.innovation_stds[:, i]
            rows, columns = self._samples[name].step(
                chunk.signals.first, np.column_stack((chunk.signals[name] * scale, residual))
            )
            times, (measured, normalised) = rows * chunk.signals.dt_secs, columns.T
            line = Line("measured", measured, GREY, 2.5)
            drawn[f"{name}/measured"] = Series("measured", times, (line,), spiky=True)
            value = estimates.states[:, state] * scale
            band = banded("estimate", value, BAND_STDS * estimates.stds[:, state] * scale, colour)
            drawn[f"{name}/state"] = Series("state", at, band, spiky=self._spiky)
            if state == 0 and estimates.wave is not None:
                line = Line("wave", estimates.wave * scale, CYAN)
                drawn[f"{name}/wave"] = Series("wave", at, (line,), spiky=True)
            line = Line("residual", normalised, colour)
            drawn[f"residual_{name}/normalised"] = Series("normalised", times, (line,), spiky=True)
        return drawn

    def _inputs(self, chunk: ReplayChunk) -> dict[str, Series]:
        drawn = {}
        for name in PAPER_INPUTS:
            scale = conversion_factor(CATALOGUE[name].unit, CATALOGUE[name].display_unit)
            line = Line(name, chunk.signals[name] * scale, GREEN, 1.5)
            series = Series("measured", chunk.signals.time_secs, (line,), spiky=True)
            drawn[f"{name}/measured"] = series
        return drawn

    def _disturbances(self, chunk: ReplayChunk) -> dict[str, Series]:
        drawn, found = {}, chunk.disturbance
        at, waves = chunk.signals.time_secs, {"yaw": found.yaw_wave, "surge": found.surge_wave}
        for name, values in (("yaw", found.yaw), ("surge", found.surge)):
            scale, wave = DISTURBANCE_UNITS[name][2], waves[name]
            line = Line("disturbance", values * scale, RED, 1.5)
            drawn[f"disturbance_{name}/observed"] = Series("observed", at, (line,))
            if wave is not None:
                line = Line("wave", wave * scale, CYAN)
                drawn[f"disturbance_{name}/harmonic"] = Series("harmonic", at, (line,), spiky=True)
        return drawn


def _sparse(chunk: ReplayChunk) -> dict[str, Series]:
    """Coefficients with their standard deviations in SI, the track in m, the heading in rad."""
    drawn = {}
    for history in (chunk.yaw_history, chunk.surge_history):
        for i, name in enumerate(history.names):
            value, std = history.values[:, i], history.stds[:, i]
            lines = Line("value", value, GREY), Line("std", std, GREY)
            drawn[f"coefficient_{name}/window"] = Series("window", history.time_secs, lines)
    lines = Line("north", chunk.track.north, GREY), Line("east", chunk.track.east, GREY)
    drawn["track"] = Series("track", chunk.track.time_secs, lines)
    if "heading" in chunk.signals:
        known = np.isfinite(chunk.signals["heading"])
        line = Line("heading", chunk.signals["heading"][known], GREY)
        drawn["heading"] = Series("heading", chunk.signals.time_secs[known], (line,))
    return drawn


def banded(
    name: str, values: FloatArray, spread: FloatArray, colour: Colour
) -> tuple[Line, Line, Line]:
    """A line over two thin, lighter ones at plus and minus its spread."""
    pale = (*colour[:3], 120)
    band = (Line("±2σ", values + sign * spread, pale) for sign in (1, -1))
    return (*band, Line(name, values, colour, 1.5))  # type: ignore[return-value]


def measured_line(values: FloatArray, dt: float) -> tuple[FloatArray, FloatArray]:
    """The times, in s, and the values of what was measured, (k,) each, with a NaN in each gap."""
    at = np.flatnonzero(np.isfinite(values))
    usual = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    rows, columns = _Samples(gap_threshold_secs(usual * dt) / dt).step(0, values[:, None])
    return rows * dt, columns[:, 0]


def decimated(series: Series) -> Series:
    """A series that is all there, thinned to about `POINTS`."""
    at = series.time_secs
    count = _stretch(len(at), len(series.lines))
    thinning = Decimator(count * float(at[-1] - at[0]) / max(len(at) - 1, 1) if count else 0.0)
    thinning.add(series)
    return thinning.result()


class _Samples:
    """The measured samples of an output, and one NaN in each gap.

    A slow sensor leaves most instants of the clock blank; its samples shall be joined by a line
    all the same, but not across a gap, which is more than `longest` instants.
    """

    def __init__(self, longest: float) -> None:
        self._longest, self._last = longest, -1

    def step(self, first: int, columns: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """The instants (k,) and the rows (k, c) of the next chunk (n, c), which begins at `first`.

        Where the first column is measured the others are.
        """
        at = np.flatnonzero(np.isfinite(columns[:, 0]))
        if not len(at):
            return at, columns[:0]
        rows = at + first
        before = np.concatenate(([self._last if self._last >= 0 else rows[0]], rows[:-1]))
        self._last = int(rows[-1])
        ends = np.flatnonzero(rows - before > self._longest)
        values = np.insert(columns[at], ends, np.nan, axis=0)
        return np.insert(rows, ends, before[ends] + 1), values


def _stretch(count: int, lines: int) -> int:
    """How many instants share what is kept of them; none where all are few enough."""
    return -(-count // max(1, POINTS // (2 * lines))) if count > POINTS else 0


class Decimator:
    """Keeps of a series that comes in chunks each line's extremes in each of equal stretches.

    What is kept stands at its own time. The first point of every gap is kept, and both ends. A
    stretch of 0 s keeps all.
    """

    def __init__(self, stretch_secs: float) -> None:
        self._stretch = stretch_secs
        self._parts: list[FloatArray] = []  # rows of time and lines
        self._open = np.zeros((0, 0))  # the rows of the stretch that goes on
        self._before: FloatArray = np.zeros(0)  # the row before them
        self._like: Series | None = None

    def add(self, series: Series) -> None:
        """Take the next points."""
        rows = np.column_stack((series.time_secs, *(line.values for line in series.lines)))
        if self._like is None:
            self._like, self._open = series, rows[:0]
            self._parts = [rows[:0]]
            self._before = np.full(rows.shape[1] - 1, np.nan)
        if not self._stretch:
            self._parts.append(rows)
            return
        rows = np.concatenate((self._open, rows))
        if not len(rows):
            return
        stretches = self._number(rows)
        done = int(np.searchsorted(stretches, stretches[-1]))
        self._keep(rows[:done])
        self._open = rows[done:]

    def result(self) -> Series:
        """What was kept of all points."""
        if self._like is None:
            raise ValueError("nothing was added")
        self._keep(self._open, last=True)
        self._open = self._open[:0]
        rows = np.concatenate(self._parts)
        lines = (
            replace(line, values=values)
            for line, values in zip(self._like.lines, rows[:, 1:].T, strict=True)
        )
        return replace(self._like, time_secs=rows[:, 0], lines=tuple(lines))

    def _number(self, rows: FloatArray) -> NDArray[np.int64]:
        return np.asarray(np.floor(rows[:, 0] / self._stretch + 1e-6), np.int64)

    def _keep(self, rows: FloatArray, *, last: bool = False) -> None:
        if not len(rows):
            return
        kept = np.zeros(len(rows), bool)
        kept[0], kept[-1] = len(self._parts) == 1, last
        _mark(self._number(rows), np.ascontiguousarray(rows[:, 1:]), self._before, kept)
        self._before = rows[-1, 1:]
        self._parts.append(rows[kept])


@compiled
def _mark(
    stretches: NDArray[np.int64], lines: FloatArray, before: FloatArray, kept: NDArray[np.bool_]
) -> None:
    """Mark of each line (n, c) the extremes in each stretch, and where a gap begins."""
    for j in range(lines.shape[1]):
        low, high, last = 0, 0, before[j]
        for i in range(len(lines)):
            value = lines[i, j]
            if i > 0 and stretches[i] != stretches[i - 1]:
                kept[low], kept[high] = True, True
                low, high = i, i
            if value < lines[low, j] or np.isnan(lines[low, j]):
                low = i
            if value > lines[high, j] or np.isnan(lines[high, j]):
                high = i
            if np.isnan(value) and not np.isnan(last):
                kept[i] = True
            last = value
        kept[low], kept[high] = True, True
