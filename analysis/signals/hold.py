"""The inputs of a ship as a filter needs them: known at every instant, and one instant ahead."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from shiplog import Channel, Signals
from shiplog.resampling import Clock
from shiplog.ships.paper import PAPER_INPUTS


class InputHold:
    """Keeps rudder and revolutions at their last known value wherever they were not measured.

    A filter cannot predict without them; what it predicts then is a guess, to be said so.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last = dict.fromkeys(PAPER_INPUTS, np.nan)
        self._last_ns = dict.fromkeys(PAPER_INPUTS, np.iinfo(np.int64).min)
        self.missing = dict.fromkeys(PAPER_INPUTS, 0)  # instants

    def add_raw(self, chunk: tuple[Channel, ...]) -> None:
        """Look at the samples themselves for what was known before the clock begins."""
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
        """The next signals, their inputs known throughout."""
        values = dict(signals.values)
        for name in PAPER_INPUTS:
            missing = np.isnan(values[name])
            if missing.any():
                self.missing[name] += int(missing.sum())
                known = np.concatenate(([self._last[name]], values[name]))
                last = np.where(missing, 0, np.arange(1, len(known)))
                values[name] = known[np.maximum.accumulate(last)]
            self._last[name] = float(values[name][-1])
        return replace(signals, values=values)

    def warnings(self) -> list[str]:
        """What was held, in words."""
        return [
            f"{name}: not measured for {count * self._clock.dt_secs:.1f} s in all; "
            "held at its last value there, so that the estimates there are guesses"
            for name, count in self.missing.items()
            if count
        ]


def held_throughout(
    chunks: Iterable[Signals], holding: InputHold
) -> Iterator[tuple[Signals, Signals, Mapping[str, float]]]:
    """Each chunk as measured, with its inputs held, and the inputs of the instant after it.

    Of the last chunk these are its own last.
    """
    previous: tuple[Signals, Signals] | None = None
    for signals in chunks:
        held = holding.step(signals)
        if previous is not None:
            yield *previous, {name: float(held[name][0]) for name in PAPER_INPUTS}
        previous = signals, held
    if previous is not None:
        yield *previous, last_inputs(previous[1])


def last_inputs(signals: Signals) -> Mapping[str, float]:
    """The inputs of signals at their end."""
    return {name: float(signals[name][-1]) for name in PAPER_INPUTS}
