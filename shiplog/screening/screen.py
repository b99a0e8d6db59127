"""Decisions about what is used of a log, from statistics of the whole log."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from shiplog.checks.channel_stats import LogStats
from shiplog.checks.data_quality import data_warnings
from shiplog.checks.log_stats import compute_log_stats
from shiplog.errors import LogError
from shiplog.types import Log

from .screened_log import ScreenedLog, Screening
from .sources import choose_sources


def screen_log(
    log: Log,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    purpose: str,
    sources: Mapping[str, str] | None = None,
) -> ScreenedLog:
    """Decide what is used of a log, and return the log without the rest.

    Parameters
    ----------
    log
        The log as recorded.
    required, optional
        Names of the quantities that are used.
    purpose
        What needs them, for messages, such as ``a replay``.
    sources
        The source to use, by the name of a quantity that has several. By default it is chosen
        by comparing them.

    Raises
    ------
    LogError
        A required quantity or a source is missing, or a channel cannot be used as it is.

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
    >>> screened = screen_log(log, ("yaw_rate", "rudder"), purpose="a replay")
    >>> screened.warnings
    ()
    """
    screened = screen_values(log, (*required, *optional), sources=sources)
    stats = screened.screening.stats
    _require_channels(stats, required, purpose)
    names = (*required, *(name for name in optional if name in stats))
    warnings = (*screened.screening.warnings, *data_warnings(stats, names))
    return ScreenedLog(log, replace(screened.screening, warnings=warnings))


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


def _require_channels(stats: LogStats, required: Sequence[str], purpose: str) -> None:
    missing = [name for name in required if name not in stats]
    if missing:
        present = ", ".join(sorted({channel.name for channel in stats}))
        raise LogError(
            f"no channel {missing[0]!r} in {stats.name}; it has {present or 'no channels'}; "
            f"{purpose} needs {', '.join(required)}"
        )
