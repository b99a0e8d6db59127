"""Choice among several sources of one quantity, by comparing them over the whole log."""

from collections.abc import Iterable, Mapping

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.types import ChunkedLog

from .compared_source import ComparedSource, sources_on_one_clock
from .source_rules import SourceComparison, best_source
from .source_warning import choice_warning

_ORDER = ("heading", "position", "yaw_rate")  # quantities with which others are compared


def choose_sources(
    log: ChunkedLog, stats: LogStats, names: Iterable[str], chosen: Mapping[str, str]
) -> tuple[dict[str, str], list[str]]:
    """Choose a source of each quantity that has several, and compare it with the others.

    A source that does not vary, or is mostly missing, is not used. Among the others the first that
    is decisive of these counts: agreement with another quantity (yaw rate with the heading's
    derivative, speed with the fixes), with the median of three or more sources, the zero of a
    rudder on a straight course, the sampling rate, and the order of the file.

    Parameters
    ----------
    log
        The log as recorded; read once more if a quantity has several sources.
    stats
        Statistics of all its channels.
    names
        The quantities that are used.
    chosen
        Sources chosen by the user, which are kept.

    Returns
    -------
    sources
        The source, by the name of each quantity that has several.
    warnings
        For each of these the choice, the reason, and how far the sources disagree.
    """
    several = {
        name: channels
        for name in dict.fromkeys(names)
        if len(channels := [c for c in stats if c.name == name and _is_comparable(c)]) > 1
    }
    if not several:
        return {}, []
    # yaw rate and speed are compared with heading and position, the rudder with the yaw rate
    order = sorted(several, key=lambda name: _ORDER.index(name) if name in _ORDER else len(_ORDER))
    compared = dict.fromkeys((*order, *_ORDER))
    used = [c for c in stats if c.name in compared and _is_comparable(c)]
    clock, sources = sources_on_one_clock(log, used)
    by_name: dict[str, list[ComparedSource]] = {}
    for source in sources:
        by_name.setdefault(source.stats.name, []).append(source)
    references: dict[str, ComparedSource] = {}
    result, warnings = {}, []
    for name in dict.fromkeys((*_ORDER, *order)):
        candidates = by_name.get(name, [])
        if name in several and name not in chosen:
            best, reason = best_source(SourceComparison(name, candidates, references, clock))
            result[name] = best.stats.source
            warnings.append(choice_warning(name, best, reason, candidates))
            references[name] = best
        elif candidates and not candidates[0].is_dead:
            references[name] = candidates[0]
    return result, warnings


def _is_comparable(channel: ChannelStats) -> bool:
    return not channel.fields or channel.name == "position"
