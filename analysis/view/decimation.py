"""Decimation of long series to what a screen can show, with every extreme kept."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled
from shiplog.types import FloatArray

from .series import Series

POINTS = 20_000  # of a series: more than a screen has, and quick to draw


def is_long(count: int) -> bool:
    """Return whether a series of `count` points is decimated."""
    return count > POINTS


def bucket_size(count: int, lines: int) -> int:
    """Return the number of instants of which each line keeps two; 0 where all are kept.

    Parameters
    ----------
    count
        The number of instants in all.
    lines
        The number of lines of the series.
    """
    return -(-count // max(1, POINTS // (2 * lines))) if is_long(count) else 0


def decimated(series: Series) -> Series:
    """Decimate a series that is all in memory to about `POINTS` points."""
    at = series.time_secs
    size = bucket_size(len(at), len(series.lines))
    decimator = Decimator(size * float(at[-1] - at[0]) / max(len(at) - 1, 1) if size else 0.0)
    decimator.add(series)
    return decimator.result()


class Decimator:
    """Keeps each line's extremes in every bucket of time, of a series that comes in chunks.

    The points kept have their own times. The first point of every gap is kept, and both ends.

    Parameters
    ----------
    bucket_secs
        The length of a bucket, s; 0 keeps all points.
    """

    def __init__(self, bucket_secs: float) -> None:
        self._bucket_secs = bucket_secs
        self._parts: list[FloatArray] = []  # rows of time and lines
        self._open = np.zeros((0, 0))  # the rows of the bucket that is not complete
        self._before: FloatArray = np.zeros(0)  # the row before them
        self._template: Series | None = None

    def add(self, series: Series) -> None:
        """Add the next points."""
        rows = np.column_stack((series.time_secs, *(line.values for line in series.lines)))
        if self._template is None:
            self._template, self._open = series, rows[:0]
            self._parts = [rows[:0]]
            self._before = np.full(rows.shape[1] - 1, np.nan)
        if not self._bucket_secs:
            self._parts.append(rows)
            return
        rows = np.concatenate((self._open, rows))
        if not len(rows):
            return
        buckets = self._bucket_numbers(rows)
        complete = int(np.searchsorted(buckets, buckets[-1]))
        self._keep(rows[:complete])
        self._open = rows[complete:]

    def result(self) -> Series:
        """Return the points kept of all that were added."""
        if self._template is None:
            raise ValueError("no points were added")
        self._keep(self._open, last=True)
        self._open = self._open[:0]
        rows = np.concatenate(self._parts)
        lines = (
            replace(line, values=values)
            for line, values in zip(self._template.lines, rows[:, 1:].T, strict=True)
        )
        return replace(self._template, time_secs=rows[:, 0], lines=tuple(lines))

    def _bucket_numbers(self, rows: FloatArray) -> NDArray[np.int64]:
        return np.asarray(np.floor(rows[:, 0] / self._bucket_secs + 1e-6), np.int64)

    def _keep(self, rows: FloatArray, *, last: bool = False) -> None:
        if not len(rows):
            return
        kept = np.zeros(len(rows), bool)
        kept[0], kept[-1] = len(self._parts) == 1, last
        lines = np.ascontiguousarray(rows[:, 1:])
        _mark(self._bucket_numbers(rows), lines, self._before, kept)
        self._before = rows[-1, 1:]
        self._parts.append(rows[kept])


@compiled
def _mark(
    buckets: NDArray[np.int64], lines: FloatArray, before: FloatArray, kept: NDArray[np.bool_]
) -> None:
    """Mark the extremes of each line (n, c) in each bucket, and where a gap begins."""
    for j in range(lines.shape[1]):
        low, high, last = 0, 0, before[j]
        for i in range(len(lines)):
            value = lines[i, j]
            if i > 0 and buckets[i] != buckets[i - 1]:
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
