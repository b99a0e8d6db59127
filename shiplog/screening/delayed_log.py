"""Delays of sensors corrected: a log whose late channels have earlier times."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from shiplog.types import Channel, Log

from .log_view import LogView


@dataclass(frozen=True)
class SensorDelay:
    """The delay of a channel, by which its times are corrected.

    Attributes
    ----------
    name
        The quantity.
    secs
        By how much its times are later than those of the motion, s.
    error_secs
        The standard error of the estimate, s; None for a delay that was stated.
    reference
        The quantity with which it was compared; empty for a delay that was stated.
    """

    name: str
    secs: float
    error_secs: float | None = None
    reference: str = ""

    @property
    def warning(self) -> str:
        """What was corrected, in a sentence."""
        if self.error_secs is None:
            return f"{self.name}: its times are {self.secs:.3g} s earlier than recorded, as stated"
        return (
            f"{self.name}: its times are {self.secs:.2f} ± {self.error_secs:.2f} s (standard error)"
            f" earlier than recorded: so much it lags the {self.reference.replace('_', ' ')}"
        )


class DelayedLog(LogView):
    """A log without the delays of its sensors; a `shiplog.types.Log`.

    Parameters
    ----------
    log
        The log as recorded.
    delays
        The delays of some of its quantities.
    """

    def __init__(self, log: Log, delays: Sequence[SensorDelay]) -> None:
        super().__init__(log)
        self._delays = tuple(delays)
        self._shifts_ns = {each.name: round(each.secs * 1e9) for each in self._delays}

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the samples in chunks, in the order of reception."""
        for chunk in self._log.chunks():
            yield tuple(map(self._corrected, chunk))

    def select_sources(self, sources: Mapping[str, str]) -> "DelayedLog":
        """Return the log with a single source for each of the names given.

        Raises
        ------
        LogError
            The log has no such channel.
        """
        return DelayedLog(self._log.select_sources(sources), self._delays)

    def _corrected(self, channel: Channel) -> Channel:
        shift_ns = self._shifts_ns.get(channel.name, 0)
        if not shift_ns:
            return channel
        return replace(channel, measured_ns=channel.measured_ns - shift_ns)
