"""Rudder and revolutions held where not measured, and one instant ahead."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from shiplog import Channel, Signals
from shiplog.resampling import Clock
from shiplog.ships.paper import PAPER_INPUTS
from shiplog.types import FloatArray


class InputHold:
    """Holds rudder and revolutions at their last measured value (zero-order hold).

    A filter cannot predict without its inputs; where they are held, its estimates are less
    reliable, which `warnings` reports.

    Parameters
    ----------
    clock
        The uniform clock of the signals.

    Attributes
    ----------
    missing
        Number of instants at which each input was not measured.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last = dict.fromkeys(PAPER_INPUTS, np.nan)
        self._last_ns = dict.fromkeys(PAPER_INPUTS, np.iinfo(np.int64).min)
        self.missing = dict.fromkeys(PAPER_INPUTS, 0)

    def add_raw(self, chunk: tuple[Channel, ...]) -> None:
        """Read the inputs measured up to the start of the clock from raw channels.

        A channel without a sample at the clock's first instant then starts from its last value.
        """
        for name in PAPER_INPUTS:
            channel = self._clock.channels[name].select(chunk)
            if channel is None:
                continue
            earlier = np.isfinite(channel.values) & (channel.measured_ns <= self._clock.start_ns)
            times, values = channel.measured_ns[earlier], channel.values[earlier]
            if len(times) and times.max() > self._last_ns[name]:
                latest = np.argmax(times)
                self._last[name], self._last_ns[name] = float(values[latest]), int(times[latest])

    def step(self, signals: Signals) -> Signals:
        """Return the next chunk with its inputs held; NaN before the first sample."""
        values = dict(signals.values)
        for name in PAPER_INPUTS:
            self.missing[name] += int(np.isnan(values[name]).sum())
            values[name] = hold_last(values[name], self._last[name])
            self._last[name] = float(values[name][-1])
        return replace(signals, values=values)

    def warnings(self) -> list[str]:
        """Return one warning for each input that had to be held."""
        return [
            f"{name}: not measured for {count * self._clock.dt_secs:.1f} s in all; "
            "held at its last value there, which makes the estimates there less reliable"
            for name, count in self.missing.items()
            if count
        ]


def hold_last(values: FloatArray, before: float) -> FloatArray:
    """Return values (n,) with each NaN replaced by the value before it, the first by `before`.

    Examples
    --------
    >>> hold_last(np.array([np.nan, 1.0, np.nan, 2.0]), 5.0).tolist()
    [5.0, 1.0, 1.0, 2.0]
    """
    missing = np.isnan(values)
    if not missing.any():
        return values
    known = np.concatenate(([before], values))
    last = np.where(missing, 0, np.arange(1, len(known)))
    held: FloatArray = known[np.maximum.accumulate(last)]
    return held


def held_throughout(
    chunks: Iterable[Signals], hold: InputHold
) -> Iterator[tuple[Signals, Signals, Mapping[str, float]]]:
    """Yield each chunk as measured, with its inputs held, and the inputs that follow it.

    Parameters
    ----------
    chunks
        Consecutive chunks of the signals.
    hold
        The hold; its state is advanced.

    Yields
    ------
    signals, held : Signals
        The chunk as measured, and the same with its inputs held.
    following : Mapping[str, float]
        The inputs, rad and 1/min, at the instant after the chunk; for the last chunk, its own last
        inputs.
    """
    previous: tuple[Signals, Signals] | None = None
    for signals in chunks:
        held = hold.step(signals)
        if previous is not None:
            yield *previous, {name: float(held[name][0]) for name in PAPER_INPUTS}
        previous = signals, held
    if previous is not None:
        yield *previous, last_inputs(previous[1])


def in_pieces(
    held: Signals, following: Mapping[str, float], length: int
) -> Iterator[tuple[Signals, Mapping[str, float]]]:
    """Yield the pieces of a chunk, of so many instants at most, and the inputs that follow each.

    Parameters
    ----------
    held
        The chunk with its inputs held.
    following
        The inputs at the instant after the chunk.
    length
        The greatest number of instants of a piece.
    """
    for start in range(0, len(held), length):
        stop = min(start + length, len(held))
        ahead = {name: float(held[name][stop]) for name in PAPER_INPUTS if stop < len(held)}
        yield held.part(start, stop), ahead or following


def last_inputs(signals: Signals) -> Mapping[str, float]:
    """Return the inputs, rad and 1/min, at the last instant of the signals."""
    return {name: float(signals[name][-1]) for name in PAPER_INPUTS}
