"""Decisions about what is used of a log, from statistics of the whole log."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from shiplog.checks.channel_stats import LogStats
from shiplog.checks.data_quality import data_warnings
from shiplog.errors import LogError
from shiplog.types import Log

from .derivation_plan import derivation_remedy, plan_derivations
from .derived_log import DerivedLog
from .screened_log import ScreenedLog
from .value_screen import screen_values


def screen_log(
    log: Log,
    required: Sequence[str],
    optional: Sequence[str] = (),
    *,
    purpose: str,
    sources: Mapping[str, str] | None = None,
    derive: Sequence[str] = (),
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
    derive
        Names of quantities that are derived from others where the log lacks them, some of
        ``yaw_rate`` and ``speed``.

    Raises
    ------
    UsageError
        A quantity cannot be derived.
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
    derivations = plan_derivations(log, derive, sources) if derive else ()
    whole = DerivedLog(log, derivations) if derivations else log
    screened = screen_values(whole, (*required, *optional), sources=sources)
    stats = screened.screening.stats
    _require_channels(whole, stats, required, purpose, sources)
    names = (*required, *(name for name in optional if name in stats))
    derived = (each.warning for each in derivations)
    warnings = (*derived, *screened.screening.warnings, *data_warnings(stats, names))
    screening = replace(screened.screening, warnings=warnings, derivations=derivations)
    return ScreenedLog(log, screening)


def _require_channels(
    log: Log,
    stats: LogStats,
    required: Sequence[str],
    purpose: str,
    sources: Mapping[str, str] | None,
) -> None:
    missing = [name for name in required if name not in stats]
    if missing:
        present = ", ".join(sorted({channel.name for channel in stats}))
        raise LogError(
            f"no channel {missing[0]!r} in {stats.name}; it has {present or 'no channels'}; "
            f"{purpose} needs {', '.join(required)}"
            f"{''.join(derivation_remedy(log, name, sources) for name in missing)}"
        )
