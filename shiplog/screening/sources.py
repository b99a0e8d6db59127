"""Choice among several sources of one quantity, by comparing them over the whole log."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.interpolate import Interpolator, valid_samples
from shiplog.geodesy import LocalFrame, positions_of
from shiplog.types import Channel, FloatArray, Log
from shiplog.units import CATALOGUE, display_conversion

MAX_INSTANTS = 20_000  # of the clock on which sources are compared
MIN_INSTANTS = 20  # at which two sources are known, to compare them
MIN_COVERAGE_SHARE = 0.5  # of the most complete source; one that has less is not used
DECISIVE_RATIO = 1.5  # between two sources' errors, or their rates, for one to be better
MAX_CURRENT = 2.5  # m/s, by which speeds through the water and over the ground may differ
GROUND_SOURCES = re.compile("sog|gps|gnss|ground|vtg|rmc|bottom")  # names of such sources
MIN_CORRELATION = 0.9  # of two sources, for one to be described as a multiple of the other
MIN_ZERO_DIFFERENCE = 0.5  # deg of rudder on a straight course
NOISE_ERRORS = 3.0  # standard deviations of noise that are no disagreement
# A smaller difference (rms) is no disagreement, in display units; of any other quantity 1 %.
MIN_DISAGREEMENT = {
    "yaw_rate": 0.02, "speed": 0.3, "rudder": 0.5, "heading": 1.0, "position": 30.0, "sway": 0.3,
}  # fmt: skip
_ORDER = ("heading", "position", "yaw_rate")  # quantities with which others are compared
SMOOTHING_SECS = 10.0  # a heading is differentiated over this time


@dataclass(frozen=True, eq=False)
class _Source:
    """One source of a quantity on the common clock.

    Attributes
    ----------
    stats
        Statistics of its channel.
    values
        (n,), or (n, 2) m for positions; NaN in gaps and beyond its ends. Headings are unwrapped.
    """

    stats: ChannelStats
    values: FloatArray

    @property
    def coverage(self) -> float:
        """Share of the clock at which the source is known."""
        return float(np.isfinite(self.values).reshape(len(self.values), -1).all(axis=1).mean())

    @property
    def is_dead(self) -> bool:
        """Whether the source does not vary; revolutions that are constant are dead only at 0."""
        known = self.values[np.isfinite(self.values)]
        if not len(known):
            return True
        return float(np.ptp(known)) == 0.0 and (self.stats.name != "rpm" or known[0] == 0)

    @property
    def noise(self) -> float:
        """Standard deviation of the white noise, from third differences on the clock."""
        differences = np.diff(self.values, 3, axis=0)
        known = differences[np.isfinite(differences)]
        return float(1.4826 * np.median(np.abs(known)) / np.sqrt(20)) if len(known) else 0.0


def choose_sources(
    log: Log, stats: LogStats, names: Iterable[str], chosen: Mapping[str, str]
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
    clock, sources = _on_one_clock(log, used)
    by_name: dict[str, list[_Source]] = {}
    for source in sources:
        by_name.setdefault(source.stats.name, []).append(source)
    references: dict[str, _Source] = {}
    result, warnings = {}, []
    for name in dict.fromkeys((*_ORDER, *order)):
        candidates = by_name.get(name, [])
        if name in several and name not in chosen:
            best, reason = _best(_Comparison(name, candidates, references, clock))
            result[name] = best.stats.source
            warnings.append(_warning(name, best, reason, candidates))
            references[name] = best
        elif candidates and not candidates[0].is_dead:
            references[name] = candidates[0]
    return result, warnings


def _is_comparable(channel: ChannelStats) -> bool:
    return not channel.fields or channel.name == "position"


# ---- the sources on one clock


def _on_one_clock(log: Log, channels: Sequence[ChannelStats]) -> tuple[FloatArray, list[_Source]]:
    """Interpolate channels at the instants of one clock, in one pass over the log.

    Returns
    -------
    clock
        (n,) s since its start.
    sources
        One for each channel, in their order.
    """
    alive = [channel for channel in channels if channel.valid > 1]
    start = min((c.valid_span_ns[0] for c in alive), default=0)
    span = (max((c.valid_span_ns[1] for c in alive), default=0) - start) * 1e-9
    intervals = [c.interval_secs for c in alive if c.interval_secs > 0]
    dt = max(min(intervals, default=1.0), span / MAX_INSTANTS, 1e-3)
    clock = np.arange(int(span / dt) + 1) * dt
    frames: dict[tuple[str, ...], LocalFrame] = {}
    gathered = [_Gathered(channel, clock, start, frames) for channel in channels]
    for chunk in log.chunks():
        for each in gathered:
            part = each.channel.select(chunk)
            if part is not None and len(part):
                each.add(part)
    return clock, [_Source(each.channel, each.result()) for each in gathered]


class _Gathered:
    """One channel on the clock, interpolated chunk by chunk; NaN beyond its ends.

    All positions of one kind, by their fields, share a local frame.
    """

    def __init__(
        self,
        channel: ChannelStats,
        clock: FloatArray,
        start_ns: int,
        frames: dict[tuple[str, ...], LocalFrame],
    ) -> None:
        self.channel, self._clock, self._start_ns = channel, clock, start_ns
        count = 2 if channel.fields else 1
        gap_secs = max(channel.gap_threshold_secs, 5.0 * channel.interval_secs)
        self._components = [
            Interpolator(clock, gap_secs, hold=channel.hold is not None) for _ in range(count)
        ]
        self._frames = frames
        self._angle: float | None = None

    def add(self, part: Channel) -> None:
        """Add the next samples, which are screened."""
        if part.fields:
            positions = positions_of(part.fields, part.values)
            known = positions.measured
            frame = self._frames.get(part.fields) or LocalFrame.at_first(positions)
            if frame is None or not known.any():
                return
            self._frames[part.fields] = frame
            times = (part.measured_ns[known] - self._start_ns) * 1e-9
            values = frame.north_east(positions)[known]
        else:
            times, column = valid_samples(part, self._start_ns)
            values = self._unwrapped(column)[:, None]
        order = np.argsort(times, kind="stable")
        for component, column in zip(self._components, values[order].T, strict=True):
            component.add(times[order], column)

    def result(self) -> FloatArray:
        """Return the values, (n,) or (n, 2)."""
        if self.channel.valid < 2:
            values = np.full((len(self._clock), len(self._components)), np.nan)
            return values if self.channel.fields else values[:, 0]
        first, last = ((t - self._start_ns) * 1e-9 for t in self.channel.valid_span_ns)
        values = np.column_stack([component.result() for component in self._components])
        values[(self._clock < first - 1e-6) | (self._clock > last + 1e-6)] = np.nan
        return values if self.channel.fields else values[:, 0]

    def _unwrapped(self, values: FloatArray) -> FloatArray:
        kind = CATALOGUE.get(self.channel.name)
        if kind is None or not kind.circular or not len(values):
            return values
        before = values[0] if self._angle is None else self._angle
        unwrapped = np.unwrap(np.concatenate(([before], values)))
        self._angle = float(unwrapped[-1])
        return unwrapped[1:]


# ---- the choice


@dataclass(frozen=True, eq=False)
class _Comparison:
    """Sources of one quantity to choose from, with the sources chosen of other quantities."""

    name: str
    sources: Sequence[_Source]
    references: Mapping[str, _Source]
    clock: FloatArray


# the sources that are kept, and why, in words; None where the rule does not apply
_Kept = tuple[list[_Source], str] | None


def _best(comparison: _Comparison) -> tuple[_Source, str]:
    """Return the source of a quantity to use, and why, in words."""
    sources, reason = comparison.sources, ""
    for rule in (
        _alive, _complete, _by_range, _by_other_quantity, _through_water, _by_median, _by_zero,
        _by_rate,
    ):  # fmt: skip
        kept = rule(replace(comparison, sources=sources))
        if kept is not None and 0 < len(kept[0]) < len(sources):
            sources, reason = kept[0], reason or kept[1]
        if len(sources) == 1:
            return sources[0], reason
    return sources[0], reason or "the first in the log"


def _alive(comparison: _Comparison) -> _Kept:
    alive = [source for source in comparison.sources if not source.is_dead]
    return alive, "the others are constant or not measured"


def _complete(comparison: _Comparison) -> _Kept:
    most = max(source.coverage for source in comparison.sources)
    kept = [s for s in comparison.sources if s.coverage >= MIN_COVERAGE_SHARE * most]
    return kept, f"measured for {most:.0%} of the time, the others less"


def _by_range(comparison: _Comparison) -> _Kept:
    """Keep the headings that turn with the ship; a stuck one may be noisy."""
    if comparison.name != "heading":
        return None
    ranges = [float(np.nanmax(s.values) - np.nanmin(s.values)) for s in comparison.sources]
    return _smallest(comparison, [-each for each in ranges], "the others hardly vary", ratio=0.2)


def _by_other_quantity(comparison: _Comparison) -> _Kept:
    """Keep the sources close to the heading's derivative, or to the speed of the fixes."""
    reference = comparison.references.get(
        {"yaw_rate": "heading", "speed": "position"}.get(comparison.name, "")
    )
    if reference is None:
        return None
    derivative = _derivative(reference.values, comparison.clock)
    if comparison.name == "speed":
        derivative = np.hypot(*derivative.T)
    smooth = [_smooth(source.values, comparison.clock) for source in comparison.sources]
    errors = [_rms(each - derivative) for each in smooth]
    if comparison.name == "speed":  # the fixes move over the ground: a current is no error
        words, least = "the others differ from the fixes by more than a current", MAX_CURRENT
        return _smallest(comparison, errors, words, ratio=1.0, margin=least)
    return _smallest(comparison, errors, "the closest to the heading")


def _through_water(comparison: _Comparison) -> _Kept:
    """Keep the speeds that are not over the ground by the name of their source."""
    if comparison.name != "speed":
        return None
    kept = [s for s in comparison.sources if not GROUND_SOURCES.search(s.stats.source.lower())]
    return kept, "through the water; the others are over the ground by their names"


def _by_median(comparison: _Comparison) -> _Kept:
    """Keep the sources close to the median of three or more."""
    sources = comparison.sources
    if len(sources) < 3 or sources[0].values.ndim > 1:
        return None
    values = np.column_stack([source.values for source in sources])
    known = np.isfinite(values).all(axis=1)
    if np.count_nonzero(known) < MIN_INSTANTS:
        return None
    middle = np.median(values[known], axis=1)
    errors = [_rms(source.values[known] - middle) for source in sources]
    return _smallest(comparison, errors, "the closest to the median of all")


def _by_zero(comparison: _Comparison) -> _Kept:
    """Keep the rudder that is nearest to zero where it does not turn the ship."""
    rate = comparison.references.get("yaw_rate")
    if comparison.name != "rudder" or rate is None:
        return None
    zeros = [_rudder_zero(s.values, rate.values, comparison.clock) for s in comparison.sources]
    zeros_deg = np.degrees(zeros)
    if not np.isfinite(zeros_deg).all() or np.ptp(np.abs(zeros_deg)) < MIN_ZERO_DIFFERENCE:
        return None
    best = int(np.argmin(np.abs(zeros_deg)))
    words = f"without effect at {zeros_deg[best]:+.1f} deg, the nearest to zero"
    return [comparison.sources[best]], words


def _rudder_zero(rudder: FloatArray, rate: FloatArray, clock: FloatArray) -> float:
    """Return the angle at which a rudder does not turn the ship, rad; NaN if undetermined.

    r(t + W) - r(t) = a ∫r + b ∫δ + c W is solved for a, b and c; the angle is -c / b.
    """
    known = np.isfinite(rudder) & np.isfinite(rate)
    dt = float(clock[1] - clock[0])
    width = max(round(SMOOTHING_SECS / dt), 1)
    if np.count_nonzero(known) < MIN_INSTANTS + width:
        return np.nan
    columns = np.column_stack((rate, rudder, np.ones_like(rate)))
    sums = np.cumsum(np.where(known[:, None], columns, 0.0), axis=0) * dt
    gaps = np.cumsum(~known)
    whole = (gaps[width:] == gaps[:-width]) & known[:-width]
    X, y = (sums[width:] - sums[:-width])[whole], (rate[width:] - rate[:-width])[whole]
    if len(y) < MIN_INSTANTS:
        return np.nan
    (_, effect, constant), _, rank, _ = np.linalg.lstsq(X, y, rcond=1e-9)
    return float(-constant / effect) if rank == 3 and effect != 0 else np.nan


def _by_rate(comparison: _Comparison) -> _Kept:
    """Keep the sources with the highest sampling rate."""
    intervals = [source.stats.interval_secs for source in comparison.sources]
    fastest = min(intervals)
    kept = [
        source
        for source, interval in zip(comparison.sources, intervals, strict=True)
        if interval < DECISIVE_RATIO * fastest
    ]
    return kept, f"the fastest: {1 / fastest:.3g} Hz" if fastest > 0 else ""


def _smallest(
    comparison: _Comparison,
    errors: Sequence[float],
    words: str,
    *,
    ratio: float = DECISIVE_RATIO,
    margin: float | None = None,
) -> _Kept:
    """Keep the sources whose error is about the smallest.

    Parameters
    ----------
    comparison
        The k sources.
    errors
        (k,) errors; NaN where unknown.
    words
        Why the sources that are kept are kept.
    ratio
        A source is kept whose error is at most so many times the smallest,
    margin
        or exceeds it by no more than this; by default as much as sources of the quantity may
        differ.
    """
    known = [error for error in errors if np.isfinite(error)]
    if len(known) < 2:
        return None
    allowed = _min_disagreement(comparison.name, comparison.sources) if margin is None else margin
    limit = max(ratio * min(known), min(known) + allowed)
    kept = [s for s, error in zip(comparison.sources, errors, strict=True) if error <= limit]
    worst = max(known)
    if min(known) >= 0 and len(kept) < len(errors):
        unit, factor = _display(comparison.sources[0].stats)
        words += f": {min(known) * factor:.2g} {unit} rms against {worst * factor:.2g} {unit}"
    return kept, words


# ---- the disagreement


def _warning(name: str, best: _Source, reason: str, sources: Sequence[_Source]) -> str:
    """Report the choice among the sources of a quantity, and how far the others differ."""
    others = [source for source in sources if source is not best]
    listed = ", ".join(source.stats.source for source in sources)
    differences = [text for other in others if (text := _difference(best, other, sources))]
    text = f"{name}: {len(sources)} sources ({listed}); {best.stats.source} is used ({reason})"
    if differences:
        text += f"; they disagree: {'; '.join(differences)}: check which is right"
    return f"{text}; --source {name}={others[0].stats.source} selects another"


def _difference(best: _Source, other: _Source, sources: Sequence[_Source]) -> str:
    """Describe how a source differs from the one used; empty within their noise."""
    unit, factor = _display(best.stats)
    if other.is_dead and not best.is_dead:
        known = other.values[np.isfinite(other.values)]
        value = f"constant at {known[0] * factor:.3g} {unit}" if len(known) else "not measured"
        return f"{other.stats.source} is {value}"
    both = np.isfinite((best.values + other.values).reshape(len(best.values), -1)).all(axis=1)
    if np.count_nonzero(both) < MIN_INSTANTS:
        return f"{other.stats.source} is never measured at the same time"
    a, b = best.values[both], other.values[both]
    difference = b - a
    kind = CATALOGUE.get(best.stats.name)
    if kind is not None and kind.circular:
        difference = difference - 2 * np.pi * np.round(np.median(difference) / (2 * np.pi))
        b = a + difference
    rms = _rms(difference)
    noise = float(np.hypot(best.noise, other.noise))
    if rms <= max(_min_disagreement(best.stats.name, sources), NOISE_ERRORS * noise):
        return ""
    text = f"{other.stats.source} differs by {rms * factor:.2g} {unit} rms"
    if a.ndim == 1 and min(np.ptp(a), np.ptp(b)) > 0:
        scale, offset = np.polyfit(a, b, 1)
        if abs(np.corrcoef(a, b)[0, 1]) > MIN_CORRELATION:
            multiple = f"{scale:.2f} x {best.stats.source} {offset * factor:+.2g} {unit}"
            text += f" ({other.stats.source} = {multiple})"
    return text


def _min_disagreement(name: str, sources: Sequence[_Source]) -> float:
    """Return the rms difference below which sources of a quantity agree, in its unit."""
    _, factor = _display(sources[0].stats)
    if name in MIN_DISAGREEMENT:
        return MIN_DISAGREEMENT[name] / factor
    known = np.concatenate([np.ravel(source.values) for source in sources])
    known = known[np.isfinite(known)]
    return 0.01 * float(np.max(np.abs(known))) if len(known) else 0.0


def _display(channel: ChannelStats) -> tuple[str, float]:
    """Return the unit in which a channel is shown, and the factor to it."""
    return ("m", 1.0) if channel.fields else display_conversion(channel.name, channel.unit)


def _rms(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) >= MIN_INSTANTS else np.nan


def _smooth(values: FloatArray, clock: FloatArray) -> FloatArray:
    """Return the mean over `SMOOTHING_SECS` about each instant; NaN near gaps and ends."""
    half = max(round(SMOOTHING_SECS / 2 / float(clock[1] - clock[0])), 1)
    known = np.isfinite(values)
    sums = np.concatenate(([0.0], np.cumsum(np.where(known, values, 0.0))))
    counts = np.concatenate(([0], np.cumsum(known)))
    smooth = np.full_like(values, np.nan)
    width = 2 * half + 1
    if len(values) < width:
        return smooth
    total, count = sums[width:] - sums[:-width], counts[width:] - counts[:-width]
    smooth[half:-half] = np.where(count == width, total / width, np.nan)
    return smooth


def _derivative(values: FloatArray, clock: FloatArray) -> FloatArray:
    """Return the central difference over `SMOOTHING_SECS`; NaN near gaps and ends."""
    dt = float(clock[1] - clock[0])
    half = max(round(SMOOTHING_SECS / 2 / dt), 1)
    result = np.full_like(values, np.nan)
    if len(values) > 2 * half:
        result[half:-half] = (values[2 * half :] - values[: -2 * half]) / (2 * half * dt)
    return result
