"""Series to be drawn: named lines over time, their colours and bands."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.types import FloatArray

Colour = tuple[int, int, int, int]
GREY: Colour = (140, 140, 140, 255)
PALE: Colour = (205, 205, 205, 255)
CYAN: Colour = (60, 190, 210, 255)
GREEN: Colour = (76, 175, 80, 255)
BLUE: Colour = (66, 150, 245, 255)  # estimates of yaw
ORANGE: Colour = (245, 140, 40, 255)  # estimates of surge
RED: Colour = (225, 70, 80, 255)
MAGENTA: Colour = (225, 90, 190, 255)
YELLOW: Colour = (225, 200, 60, 255)
VIOLET: Colour = (150, 110, 235, 255)
BROWN: Colour = (170, 120, 80, 255)
LIME: Colour = (175, 220, 75, 255)
PINK: Colour = (250, 165, 175, 255)
STEEL: Colour = (125, 150, 185, 255)

BAND_ALPHA = 120  # of 255


@dataclass(frozen=True, eq=False)
class Line:
    """A named line of a series.

    Attributes
    ----------
    name
        The name shown for the line.
    values
        (n,) in the unit in which it is drawn; NaN is a gap.
    colour
        Red, green, blue and alpha, 0 to 255.
    width
        In points.
    """

    name: str
    values: FloatArray
    colour: Colour
    width: float = 1.0


@dataclass(frozen=True, eq=False)
class Series:
    """Lines that share their times.

    Attributes
    ----------
    name
        The last part of its entity's path; a series later in the alphabet is drawn on top.
    time_secs
        (n,) s since the start of the signals.
    lines
        The lines.
    spiky
        Whether, where many points fall on a pixel, their extremes are drawn and not their mean.
    steps
        Whether each value is drawn as held until the next, instead of joined to it.
    """

    name: str
    time_secs: FloatArray
    lines: tuple[Line, ...]
    spiky: bool = False
    steps: bool = False


def banded(
    name: str, values: FloatArray, half_width: FloatArray, colour: Colour
) -> tuple[Line, Line, Line]:
    """Return a line over two thin, pale ones at plus and minus `half_width`, (n,) each."""
    pale = (*colour[:3], BAND_ALPHA)
    band = (Line("±2σ", values + sign * half_width, pale) for sign in (1, -1))
    return (*band, Line(name, values, colour, 1.5))  # type: ignore[return-value]


def measured_line(values: FloatArray, dt_secs: float) -> tuple[FloatArray, FloatArray]:
    """Return the times and the values of what was measured, with one NaN in each gap.

    Parameters
    ----------
    values
        (n,) on a clock of `dt_secs`; NaN where nothing was measured.
    dt_secs
        The interval of the clock, s.

    Returns
    -------
    tuple of arrays
        (k,) s since the first value, and (k,) values.

    Examples
    --------
    >>> times, values = measured_line(np.array([1.0, np.nan, 2.0, np.nan, 3.0]), 0.1)
    >>> times, values
    (array([0. , 0.2, 0.4]), array([1., 2., 3.]))
    """
    at = np.flatnonzero(np.isfinite(values))
    median_step = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    samples = MeasuredSamples(gap_threshold_secs(median_step * dt_secs) / dt_secs)
    rows, columns = samples.step(0, values[:, None])
    return rows * dt_secs, columns[:, 0]


class MeasuredSamples:
    """Selects an output's measured samples from chunks, and puts one NaN into each gap.

    A slow sensor leaves most instants of the clock empty; a line joins its samples nevertheless,
    but not across a gap.

    Parameters
    ----------
    longest_step
        The number of instants between samples beyond which there is a gap.
    """

    def __init__(self, longest_step: float) -> None:
        self._longest_step, self._last = longest_step, -1

    def step(self, first: int, columns: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Select the samples of the next chunk.

        Parameters
        ----------
        first
            The number of the chunk's first instant.
        columns
            (n, c); where the first column is measured the others are.

        Returns
        -------
        tuple of arrays
            The instants (k,) and their rows (k, c).
        """
        at = np.flatnonzero(np.isfinite(columns[:, 0]))
        if not len(at):
            return at, columns[:0]
        rows = at + first
        before = np.concatenate(([self._last if self._last >= 0 else rows[0]], rows[:-1]))
        self._last = int(rows[-1])
        gap_ends = np.flatnonzero(rows - before > self._longest_step)
        values = np.insert(columns[at], gap_ends, np.nan, axis=0)
        return np.insert(rows, gap_ends, before[gap_ends] + 1), values
