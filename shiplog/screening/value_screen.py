"""Unusable values of a log left out, and one source of each quantity, whatever the log lacks."""

from collections.abc import Mapping, Sequence

from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Log

from .screened_log import ScreenedLog, Screening
from .sources import choose_sources


def screen_values(
    log: Log, names: Sequence[str], *, sources: Mapping[str, str] | None = None
) -> ScreenedLog:
    """Return a log with one source of each quantity and no unusable value, whatever it lacks.

    No channel is required, and defects of a single channel are neither refused nor reported.

    Parameters
    ----------
    log
        The log as recorded.
    names
        Names of the quantities that are used, where the log has them.
    sources
        As in `screen_log`.

    Raises
    ------
    LogError
        A source is missing.
    """
    chosen = dict(sources or {})
    selected = log.select_sources(chosen) if chosen else log
    all_stats = compute_log_stats(log, strict=True, sources=chosen)
    stats = all_stats.select_sources(chosen)
    present = tuple(name for name in names if name in stats)
    found, warnings = choose_sources(selected, stats, present, chosen)
    return ScreenedLog(log, Screening(all_stats, chosen | found, tuple(warnings)))
