"""Decisions about derived channels: which are missing, from what they come, with which noise."""

from collections.abc import Mapping, Sequence

import numpy as np

from shiplog.checks.channel_stats import ChannelStats
from shiplog.errors import LogError, ShiplogError, UsageError
from shiplog.types import ChunkedLog, FloatArray, Log
from shiplog.units import did_you_mean

from .derived_log import Derivation
from .heading_rate import MAX_NOISE_SAMPLES, HeadingRate, choose_heading_rate
from .value_screen import screen_values

DERIVED_FROM = {"yaw_rate": "heading", "speed": "speed_over_ground"}


def plan_derivations(
    log: Log, names: Sequence[str], sources: Mapping[str, str] | None = None
) -> tuple[Derivation, ...]:
    """Decide how the channels that a log lacks are derived.

    Parameters
    ----------
    log
        The log.
    names
        Of `DERIVED_FROM`; channels that the log has are not derived.
    sources
        The source to derive from, by the name of a quantity that has several.

    Raises
    ------
    UsageError
        A name is none of `DERIVED_FROM`.
    LogError
        The log lacks the channel to derive from, or it is too coarse.

    Examples
    --------
    >>> import shiplog
    >>> log = shiplog.read("sample_data/zigzag_20_20.mcap", channels=["heading"])
    >>> (derivation,) = plan_derivations(log, ["yaw_rate"])
    >>> derivation.source, derivation.rate.samples
    ('derived.simulated', 5)
    """
    for name in names:
        if name not in DERIVED_FROM:
            raise UsageError(
                f"cannot derive {name!r}{did_you_mean(name, DERIVED_FROM)}; possible are "
                f"{', '.join(DERIVED_FROM)}"
            )
    bases = [DERIVED_FROM[name] for name in names]
    chosen = {name: source for name, source in (sources or {}).items() if name in bases}
    screened = screen_values(log, bases, sources=chosen)
    stats = screened.screening.stats
    found = []
    for name, base in zip(names, bases, strict=True):
        if name in stats:
            continue
        if base not in stats:
            raise LogError(f"no channel {base!r} to derive {name!r} from in {log.name}")
        rate = _heading_rate(screened, stats[base]) if base == "heading" else None
        found.append(Derivation(name, stats[base], rate))
    return tuple(found)


def _heading_rate(log: ChunkedLog, base: ChannelStats) -> HeadingRate:
    parts: list[FloatArray] = []
    for chunk in log.chunks():
        heading = base.select(chunk)
        if heading is not None:
            parts.append(heading.values[np.isfinite(heading.values)])
        if sum(map(len, parts)) >= MAX_NOISE_SAMPLES:
            break
    headings = np.concatenate([np.zeros(0), *parts])
    return choose_heading_rate(headings, base.interval_secs, base.topic)


def derivation_remedy(log: Log, name: str, sources: Mapping[str, str] | None = None) -> str:
    """Return how a missing channel can be derived, after a semicolon; empty where it cannot be."""
    if name not in DERIVED_FROM:
        return ""
    try:
        return "".join(f"; {each.remedy}" for each in plan_derivations(log, [name], sources))
    except ShiplogError:
        return ""
