"""The check of all channels of a log against each other, chunk by chunk."""

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.log_stats import compute_log_stats
from shiplog.types import Channel, ChunkedLog

from .coarse_record import COMPARED_CHANNELS, CoarseRecord, CoarseSignals
from .findings import Finding
from .ground_velocity import ground_velocity
from .gyro_bias import bias_findings
from .lags import MAX_RATIO, MIN_RATIO, Lag, heading_lag, speed_lag
from .rudder_effect import rudder_significance
from .speed_findings import (
    heading_zero_findings,
    range_findings,
    speed_findings,
    speed_lag_findings,
)
from .time_findings import time_findings
from .turning_findings import (
    Pair,
    column_findings,
    sense_explanations,
    sense_findings,
    unit_findings,
)
from .turning_ratio import TurningRatio, turning_ratio

__all__ = ["COMPARED_CHANNELS", "ConsistencyCheck", "consistency_findings"]

MIN_CORRELATION = 0.9  # of the turns of two channels that are compared
MIN_COURSE_STD = np.radians(5.0)  # of the course, below which it is not compared with turns
MIN_RUDDER_ERRORS = 3.0  # standard errors by which the rudder's effect must differ from zero
MIN_LAG_SECS, LAG_ERRORS = 0.5, 6.0
NO_FIX = "latitude", 91.0  # deg, which AIS prints
MIN_IMPOSSIBLE_SHARE = 0.2  # of the samples, from which the unit is the likely cause


def consistency_findings(log: ChunkedLog, stats: LogStats | None = None) -> list[Finding]:
    """Return what the channels of a log contradict each other in.

    Parameters
    ----------
    log
        The log.
    stats
        Its statistics, computed with `strict`; by default they are computed in a pass of their own.

    Examples
    --------
    >>> import shiplog
    >>> consistency_findings(shiplog.read("sample_data/zigzag_20_20.mcap"))
    []
    """
    check = ConsistencyCheck(stats or compute_log_stats(log, strict=True))
    for chunk in log.chunks():
        check.add(chunk)
    return check.result()


class ConsistencyCheck:
    """The check of `consistency_findings` for a log that comes chunk by chunk.

    Yaw rate, heading, course of the fixes and rudder are compared in pairs. Which channel is at
    fault follows from all pairs together: the smallest set of channels with reversed sense that
    explains them, fixes being the least likely one.

    Parameters
    ----------
    stats
        Statistics of the whole log.
    """

    def __init__(self, stats: LogStats) -> None:
        self._stats = stats
        self._record = CoarseRecord(stats)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        self._record.add(chunk)

    def result(self) -> list[Finding]:
        """Return the findings, once all samples were added."""
        findings = _impossible_findings(self._stats)
        if self._record.dt_secs == 0:
            return findings
        signals = self._record.result()
        compared = _turning_ratios(signals)
        ratios = _correlated(compared)
        explanations = sense_explanations(_senses(signals, ratios))
        turning = sense_findings(explanations, signals.topics)
        wrong_times = list(
            time_findings(
                signals.dt_secs,
                signals.yaw,
                signals.heading,
                signals.speed,
                (signals.north, signals.east),
            )
        )
        turning += wrong_times or unit_findings(ratios, signals.topics)
        velocity = None if turning else ground_velocity(signals)
        findings += turning
        findings += column_findings(compared.get(("yaw_rate", "heading")), signals.topics)
        # exchanged latitudes and longitudes distort distances; the speed is compared once corrected
        if not wrong_times and not (
            signals.datum and explanations and "position" in explanations[0]
        ):
            findings += speed_findings(signals, velocity)
        findings += range_findings(signals)
        wrong_units = {finding.channel for finding in turning if finding.kind == "unit"}
        if not wrong_units & {"heading", "time"}:
            sense = -1 if explanations and "heading" in explanations[0] else 1
            findings += heading_zero_findings(signals, sense, velocity)
        findings += speed_lag_findings(signals, velocity, self._stats)
        pair = ratios.get(("yaw_rate", "heading"))
        if pair is None or MIN_RATIO < pair.ratio < MAX_RATIO:
            findings += bias_findings(signals)
            findings += _lag_findings(heading_lag(pair), self._stats)
        return findings

    def lags(self) -> tuple[Lag, ...]:
        """Return the lags that the channels show, significant or not, in place of `result`."""
        if self._record.dt_secs == 0:
            return ()
        signals = self._record.result()
        pair = _correlated(_turning_ratios(signals)).get(("yaw_rate", "heading"))
        found = heading_lag(pair), speed_lag(ground_velocity(signals))
        return tuple(lag for lag in found if lag is not None)


def _senses(signals: CoarseSignals, ratios: dict[Pair, TurningRatio]) -> dict[Pair, int]:
    """Return for each pair of channels +1 where they agree and -1 where they contradict."""
    senses = {pair: 1 if each.ratio > 0 else -1 for pair, each in ratios.items()}
    significance = rudder_significance(signals)
    if abs(significance) > MIN_RUDDER_ERRORS:
        senses["rudder", "yaw_rate"] = 1 if significance > 0 else -1
    return senses


def _turning_ratios(signals: CoarseSignals) -> dict[Pair, TurningRatio]:
    """Compare each pair of the channels that turn."""
    series = {"yaw_rate": signals.yaw, "heading": signals.heading, "position": signals.course}
    known = signals.course[np.isfinite(signals.course)]
    course_turns = len(known) > 0 and float(np.std(known)) >= MIN_COURSE_STD
    pairs = [("yaw_rate", "heading")]
    pairs += [("yaw_rate", "position"), ("heading", "position")] if course_turns else []
    ratios = {(x, y): turning_ratio(signals.dt_secs, series[x], series[y]) for x, y in pairs}
    return {pair: ratio for pair, ratio in ratios.items() if ratio is not None}


def _correlated(ratios: dict[Pair, TurningRatio]) -> dict[Pair, TurningRatio]:
    """Return the ratios of channels that turn alike, which are determined."""
    return {
        pair: ratio
        for pair, ratio in ratios.items()
        if abs(ratio.correlation) >= MIN_CORRELATION and abs(ratio.ratio) > 4 * ratio.error
    }


def _lag_findings(found: Lag | None, stats: LogStats) -> list[Finding]:
    """Report a heading and a yaw rate of which one lags the other."""
    gyro, compass = stats.get("yaw_rate"), stats.get("heading")
    if found is None or gyro is None or compass is None:
        return []
    lag, error = found.secs, found.error_secs
    resolution = max(gyro.interval_secs, compass.interval_secs, MIN_LAG_SECS)
    if abs(lag) < max(resolution, LAG_ERRORS * error):
        return []
    late, early = (compass, gyro) if lag > 0 else (gyro, compass)
    return [
        Finding(
            "lag",
            late.name,
            f"{late.topic}: lags {early.topic} by {abs(lag):.2f} ± {2 * error:.2f} s; likely a "
            "filter or a late time stamp in the recorder; correct its times by that delay "
            "(--sensor-delay)",
        )
    ]


def _impossible_findings(stats: LogStats) -> list[Finding]:
    """Report channels of which so many values are impossible that the unit must be wrong."""
    causes = {
        "yaw_rate": ("deg/s or deg/min read as rad/s", 'unit = "deg/s" or "deg/min"'),
        "rudder": ("deg read as rad, or per cent or tenths of a degree read as deg",
                   'unit = "deg"'),
        "speed": ("cm/s or mm/s read as m/s", "unit of the column"),
        "rpm": ("rpm read as rev/s", 'unit = "rpm"'),
        "heading": ("deg read as rad", 'unit = "deg"'),
        "position": ("ddmm.mmmm read as degrees, or metres read as degrees",
                     "form or unit of the position"),
    }  # fmt: skip
    return [
        Finding(
            "unit",
            channel.name,
            f"{channel.topic}: {_impossible(channel)[0] / channel.samples:.0%} of the samples are "
            f"impossible, {_impossible(channel)[1]}; likely "
            f"{causes[channel.name][0]}; change in the layout: [{channel.name}] "
            f"{causes[channel.name][1]}",
        )
        for channel in stats.channels
        if channel.name in causes and _mostly_impossible(channel)
    ]


def _mostly_impossible(channel: ChannelStats) -> bool:
    """Whether so many different values are impossible that the unit must be wrong.

    One impossible value among possible ones, such as a heading of 3600 deg, is a sentinel; a
    constant channel in a wrong unit has no other values.
    """
    count = _impossible(channel)[0]
    one_value = 1 < channel.impossible_value[1] == count
    if one_value and channel.fixes is None and channel.valid > 1:
        return False
    return count > MIN_IMPOSSIBLE_SHARE * max(channel.samples, 1)


def _impossible(channel: ChannelStats) -> tuple[int, str]:
    """Return the number of impossible samples, and their size in words.

    Positions without a fix, such as latitude 91, are not counted.
    """
    if channel.fixes is None:
        return channel.impossible.count, f"up to {channel.impossible.extent:.4g} {channel.unit}"
    fixes = channel.fixes
    without_fix, others = 0, []
    for value, count in fixes.impossible.items():
        if NO_FIX in zip(fixes.fields, value, strict=False):
            without_fix += count
        else:
            others.append(value)
    example = fixes.in_words(others[0]) if others else ""
    return fixes.impossible_count - without_fix, f"such as {example}"
