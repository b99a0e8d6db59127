"""A segment as an identifier takes it: what the ship was given, and what was measured of her."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.errors import LogError
from shiplog.ships.motion import MODEL_OUTPUTS, InputPath
from shiplog.ships.paper import PAPER_INPUTS
from shiplog.ships.path import input_path
from shiplog.types import FloatArray, Signals

MIN_SEGMENT_SECS = 60.0  # of a piece: a shorter one says nothing of a ship


@dataclass(frozen=True, eq=False)
class Segment:
    """A run, or a piece of one, throughout which rudder and revolutions are known."""

    name: str
    signals: Signals
    path: InputPath
    measured: FloatArray  # (n, 4) in the order of MODEL_OUTPUTS; NaN where not measured

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.measured)

    @property
    def dt_secs(self) -> float:
        """From sample to sample."""
        return self.signals.dt_secs

    def has(self, output: str) -> bool:
        """Whether an output was measured at all."""
        return bool(np.isfinite(self.measured[:, MODEL_OUTPUTS.index(output)]).sum() > 1)

    def part(self, start: int, stop: int) -> "Segment":
        """Its samples from `start` to before `stop`."""
        signals = self.signals.part(start, stop)
        return Segment(self.name, signals, input_path(signals), self.measured[start:stop])


def split_into_segments(signals: Signals, name: str) -> tuple[Segment, ...]:
    """The pieces in which rudder and revolutions are known, each of `MIN_SEGMENT_SECS` or more.

    Between an input's samples it is interpolated, over its gaps not. Raises `LogError` where no
    piece is left.
    """
    inputs = {channel: _bridged(signals[channel], signals.dt_secs) for channel in PAPER_INPUTS}
    known = np.isfinite(inputs["rudder"]) & np.isfinite(inputs["rpm"])
    whole = Signals(signals.start_ns, signals.dt_secs, {**signals.values, **inputs}, signals.first)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], known, [0]))))
    pieces = [
        (start, stop)
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        if (stop - start - 1) * signals.dt_secs >= MIN_SEGMENT_SECS
    ]
    if not pieces:
        raise LogError(
            f"rudder and rpm are known together for less than {MIN_SEGMENT_SECS:.0f} s at a time, "
            f"too short to identify a ship; give a longer log: {name}"
        )
    return tuple(_trial(whole.part(*piece), name) for piece in pieces)


def _trial(signals: Signals, name: str) -> Segment:
    missing = np.full(len(signals), np.nan)
    columns = [signals.values.get(output, missing) for output in MODEL_OUTPUTS]
    return Segment(name, signals, input_path(signals), np.column_stack(columns))


def _bridged(values: FloatArray, dt: float) -> FloatArray:
    """An input with the instants between its samples filled in, its gaps left open."""
    at = np.flatnonzero(np.isfinite(values))
    if len(at) < 2:
        return values
    filled = np.interp(np.arange(len(values)), at, values[at], left=np.nan, right=np.nan)
    longest = gap_threshold_secs(float(np.median(np.diff(at))) * dt) / dt
    for i in np.flatnonzero(np.diff(at) > longest):
        filled[at[i] + 1 : at[i + 1]] = np.nan
    return filled


def initial_level(segments: Sequence[Segment], channel: str) -> float:
    """The largest initial speed or rpm among the segments, over their first ten seconds."""
    firsts = [
        np.abs(segment.signals[channel][: max(2, round(10 / segment.dt_secs))])
        for segment in segments
    ]
    known = [np.nanmedian(first) for first in firsts if np.isfinite(first).any()]
    return float(max(known, default=np.nan))
