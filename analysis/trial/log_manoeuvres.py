"""Manoeuvres of a log as recorded, found without indices, and the signals that show them."""

from dataclasses import dataclass

from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan, manoeuvre_spans
from shiplog.resampling import resample_chunks
from shiplog.screening import screen_values
from shiplog.types import Log

from .thinned_signals import SEARCHED, ThinnedSignals
from .trial_record import attached_vessel, trial_clock


@dataclass(frozen=True, eq=False)
class LogManoeuvres:
    """The manoeuvres of a log.

    Attributes
    ----------
    start_ns
        The instant from which times count, ns since 1970-01-01 UTC.
    signals
        The signals in which they were found.
    spans
        In the order of their executes.
    """

    start_ns: int
    signals: ThinnedSignals
    spans: tuple[ManoeuvreSpan, ...]


def find_log_manoeuvres(log: Log) -> LogManoeuvres:
    """Find the manoeuvres of a log, chunk by chunk; it may be longer than memory.

    Parameters
    ----------
    log
        The log as recorded.

    Raises
    ------
    LogError
        The log has neither rudder, heading, yaw rate nor speed over time.

    Examples
    --------
    >>> import shiplog
    >>> found = find_log_manoeuvres(shiplog.read("sample_data/zigzag_20_20.mcap"))
    >>> [span.title for span in found.spans]
    ['zig-zag 20°/20°, first to starboard']
    """
    screened = screen_values(log, SEARCHED)
    clock = trial_clock(screened.screening.stats, log.name, attached_vessel(log))
    signals = ThinnedSignals(clock.count, clock.dt_secs, SEARCHED)
    for chunk in resample_chunks(screened.chunks(), clock):
        signals.add(chunk.first, chunk.values)
    return LogManoeuvres(clock.start_ns, signals, manoeuvre_spans(signals.trial_signals()))
