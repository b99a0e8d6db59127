"""A stretch of a run with known inputs, as a fit takes it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.errors import LogError
from shiplog.ships.motion import MODEL_OUTPUTS, InputPath
from shiplog.ships.paper import PAPER_INPUTS
from shiplog.ships.path import input_path
from shiplog.types import FloatArray, Signals

MIN_SEGMENT_SECS = 60.0  # a shorter segment does not determine a model
INITIAL_SECS = 10.0  # over which an initial level is a median


@dataclass(frozen=True, eq=False)
class Segment:
    """A run, or a part of one, in which rudder and revolutions are known at every sample.

    Attributes
    ----------
    name
        The run's name; segments of the same name are parts of one run.
    signals
        The n samples of all channels, with the inputs interpolated between their samples.
    path
        The inputs as the ship models take them: the rudder linear from sample to sample.
    measured
        (n, 4) outputs in the order of `MODEL_OUTPUTS`, SI; NaN where not measured.
    fixes
        (n, 2) position fixes north and east, m, NaN where there is none; None without any.
    antenna
        Place of the fixes ahead and to starboard of the midship point, m.
    """

    name: str
    signals: Signals
    path: InputPath
    measured: FloatArray
    fixes: FloatArray | None = None
    antenna: tuple[float, float] = (0.0, 0.0)

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.measured)

    @property
    def dt_secs(self) -> float:
        """The sample interval, s."""
        return self.signals.dt_secs

    def has(self, output: str) -> bool:
        """Return whether an output was measured at two samples or more."""
        return bool(np.isfinite(self.measured[:, MODEL_OUTPUTS.index(output)]).sum() > 1)

    def part(self, start: int, stop: int) -> "Segment":
        """Return the samples from `start` to before `stop` as a segment."""
        signals = self.signals.part(start, stop)
        fixes = None if self.fixes is None else self.fixes[start:stop]
        return Segment(
            self.name, signals, input_path(signals), self.measured[start:stop], fixes, self.antenna
        )


def split_into_segments(signals: Signals, name: str) -> tuple[Segment, ...]:
    """Split a run at the gaps of rudder and revolutions.

    Between their samples the inputs are interpolated linearly, but not across gaps
    (`gap_threshold_secs` of their median interval).

    Parameters
    ----------
    signals
        The run on one clock.
    name
        The run's name, for the segments and for messages.

    Returns
    -------
    segments
        The stretches of at least `MIN_SEGMENT_SECS`, in order.

    Raises
    ------
    LogError
        No stretch is long enough.
    """
    inputs = {channel: _interpolated(signals[channel], signals.dt_secs) for channel in PAPER_INPUTS}
    complete = np.isfinite(inputs["rudder"]) & np.isfinite(inputs["rpm"])
    whole = Signals(signals.start_ns, signals.dt_secs, {**signals.values, **inputs}, signals.first)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], complete, [0]))))
    stretches = [
        (start, stop)
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
        if (stop - start - 1) * signals.dt_secs >= MIN_SEGMENT_SECS
    ]
    if not stretches:
        raise LogError(
            f"rudder and rpm are known together for less than {MIN_SEGMENT_SECS:.0f} s at a time, "
            f"too short to identify a ship; give a longer log: {name}"
        )
    return tuple(_segment(whole.part(*stretch), name) for stretch in stretches)


def _segment(signals: Signals, name: str) -> Segment:
    missing = np.full(len(signals), np.nan)
    columns = [signals.values.get(output, missing) for output in MODEL_OUTPUTS]
    return Segment(name, signals, input_path(signals), np.column_stack(columns))


def averaged(segment: Segment, secs: float) -> Segment:
    """Return a segment of the means over blocks of about `secs`; the same if samples are longer.

    Parameters
    ----------
    segment
        The segment.
    secs
        The new sample interval, rounded to a whole number of samples.
    """
    every = round(secs / segment.dt_secs)
    count = len(segment) // max(every, 1)
    if every < 2 or count < 2:
        return segment

    def means(values: FloatArray) -> FloatArray:
        blocks = values[: count * every].reshape(count, every, *values.shape[1:])
        known = np.isfinite(blocks)
        total = np.where(known, blocks, 0.0).sum(axis=1)
        with np.errstate(invalid="ignore"):
            return np.asarray(total / np.where(known.any(axis=1), known.sum(axis=1), np.nan))

    signals, dt = segment.signals, segment.dt_secs
    middle_secs = (signals.first + (every - 1) / 2) * dt
    mean_signals = Signals(
        signals.start_ns + round(middle_secs * 1e9), dt * every,
        {name: means(values) for name, values in signals.values.items()},
    )  # fmt: skip
    fixes = None if segment.fixes is None else means(segment.fixes)
    return Segment(
        segment.name, mean_signals, input_path(mean_signals), means(segment.measured), fixes,
        segment.antenna,
    )  # fmt: skip


def _interpolated(values: FloatArray, dt: float) -> FloatArray:
    """Interpolate an input between its samples; its gaps stay NaN."""
    at = np.flatnonzero(np.isfinite(values))
    if len(at) < 2:
        return values
    filled = np.interp(np.arange(len(values)), at, values[at], left=np.nan, right=np.nan)
    longest = gap_threshold_secs(float(np.median(np.diff(at))) * dt) / dt
    for i in np.flatnonzero(np.diff(at) > longest):
        filled[at[i] + 1 : at[i + 1]] = np.nan
    return filled


def segments_by_run(segments: Sequence[Segment]) -> tuple[tuple[int, ...], ...]:
    """Return the numbers of each run's segments, which are those of one name."""
    names = [segment.name for segment in segments]
    return tuple(
        tuple(i for i, each in enumerate(names) if each == name) for name in dict.fromkeys(names)
    )


def initial_level(segments: Sequence[Segment], channel: str) -> float:
    """Return the initial magnitude of a channel, the largest among the segments.

    Parameters
    ----------
    segments
        One or more.
    channel
        Such as ``speed`` or ``rpm``.

    Returns
    -------
    float
        The largest of the segments' medians over their first `INITIAL_SECS`, in the channel's SI
        unit; NaN where no segment has the channel then.
    """
    starts = [
        np.abs(segment.signals[channel][: max(2, round(INITIAL_SECS / segment.dt_secs))])
        for segment in segments
    ]
    levels = [np.nanmedian(start) for start in starts if np.isfinite(start).any()]
    return float(max(levels, default=np.nan))
