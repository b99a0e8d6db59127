"""Decisions about what is used of a log, from statistics of the whole log."""

from collections.abc import Mapping, Sequence

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
    chosen = dict(sources or {})
    selected = log.select_sources(chosen) if chosen else log
    stats = compute_log_stats(selected, strict=True)
    _require_channels(stats, required, purpose)
    present = tuple(name for name in optional if name in stats)
    found, source_warnings = choose_sources(selected, stats, (*required, *present), chosen)
    chosen |= found
    stats = stats.select_sources(chosen)
    warnings = [*source_warnings, *data_warnings(stats, (*required, *present))]
    return ScreenedLog(log, Screening(stats, chosen, tuple(warnings)))


def _require_channels(stats: LogStats, required: Sequence[str], purpose: str) -> None:
    missing = [name for name in required if name not in stats]
    if missing:
        present = ", ".join(sorted({channel.name for channel in stats}))
        raise LogError(
            f"no channel {missing[0]!r} in {stats.name}; it has {present or 'no channels'}; "
            f"{purpose} needs {', '.join(required)}"
        )
