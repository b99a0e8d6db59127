"""A log without its unusable values, read chunk by chunk."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from shiplog.checks.channel_stats import LogStats
from shiplog.types import Channel, Log

from .delayed_log import DelayedLog, SensorDelay
from .derived_log import Derivation, DerivedLog
from .log_view import LogView


@dataclass(frozen=True, eq=False)
class Screening:
    """What is used of a log: plain data, which can be pickled and applied in any number of passes.

    Attributes
    ----------
    all_stats
        Statistics of the channels of all sources as screened; counts of defects are those of the
        raw log.
    sources
        The chosen source, by the name of each quantity that has several or was chosen by the user.
    warnings
        Problems of the data, each in a sentence.
    derivations
        The channels that are derived from others.
    delays
        The delays by which times are corrected.
    """

    all_stats: LogStats
    sources: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    derivations: tuple[Derivation, ...] = ()
    delays: tuple[SensorDelay, ...] = ()

    @property
    def stats(self) -> LogStats:
        """Statistics of the channels that are used, with one source of each quantity."""
        return self.all_stats.select_sources(self.sources)


class ScreenedLog(LogView):
    """A log as its users take it; a `shiplog.types.ChunkedLog`.

    Impossible values and sentinels are NaN, and each quantity has one source.

    Parameters
    ----------
    log
        The log as recorded.
    screening
        What is used of it, from `screen_log`.
    """

    def __init__(self, log: Log, screening: Screening) -> None:
        timely = DelayedLog(log, screening.delays) if screening.delays else log
        whole = DerivedLog(timely, screening.derivations) if screening.derivations else timely
        super().__init__(whole.select_sources(screening.sources) if screening.sources else whole)
        self.screening = screening
        self._stats = {(stats.topic, stats.fields): stats for stats in screening.stats}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Problems met in reading the file, and problems of the data."""
        return (*self._log.warnings, *self.screening.warnings)

    def chunks(self) -> Iterator[tuple[Channel, ...]]:
        """Iterate over the screened samples in chunks, each topic in the order of reception."""
        for chunk in self._log.chunks():
            yield tuple(self._stats[channel.key].screened(channel) for channel in chunk)
