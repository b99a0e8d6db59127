"""The check of all channels of a log against each other, chunk by chunk."""

import numpy as np

from shiplog.checks.channel_stats import ChannelStats, LogStats
from shiplog.checks.gyro_bias import GyroBiasCheck
from shiplog.checks.log_stats import compute_log_stats
from shiplog.checks.rudder_sign import SIGNIFICANT_ERRORS, RudderSignCheck
from shiplog.types import Channel, FloatArray, Log

from .coarse_record import CoarseRecord
from .findings import Finding
from .speed_findings import heading_zero_findings, range_findings, speed_findings
from .time_findings import time_findings
from .turning_findings import Pair, sense_explanations, sense_findings, unit_findings
from .turning_ratio import TurningRatio, turning_ratio

COURSE_WINDOW_SECS = 10.0  # over which the course of the fixes is measured
MIN_TURN = {"yaw_rate": 0.0, "heading": 0.0, "position": np.radians(5.0)}  # rad, of the changes
MIN_LAG_SECS, LAG_ERRORS = 0.5, 6.0
MIN_IMPOSSIBLE_SHARE = 0.2  # of the samples, from which the unit is the likely cause


def consistency_findings(log: Log) -> list[Finding]:
    """Return what the channels of a log contradict each other in.

    Examples
    --------
    >>> import shiplog
    >>> consistency_findings(shiplog.read("sample_data/zigzag_20_20.mcap"))
    []
    """
    check = ConsistencyCheck(compute_log_stats(log, strict=True))
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
        self._rudder, self._bias = RudderSignCheck(stats), GyroBiasCheck(stats)

    def add(self, chunk: tuple[Channel, ...]) -> None:
        """Add the next samples of the log."""
        for check in (self._record, self._rudder, self._bias):
            check.add(chunk)

    def result(self) -> list[Finding]:
        """Return the findings, once all samples were added."""
        findings = _impossible_findings(self._stats)
        if self._record.dt_secs == 0:
            return findings
        topics = {channel.name: channel.topic for channel in reversed(self._stats.channels)}
        dt = self._record.dt_secs
        yaw, heading, speed, rudder, rpm = (
            self._record.values(name) for name in ("yaw_rate", "heading", "speed", "rudder", "rpm")
        )
        north, east = self._record.track()
        course = _course(dt, north, east)
        series = {"yaw_rate": yaw, "heading": heading, "position": course}
        ratios = _ratios(dt, series)
        explanations = sense_explanations(self._senses(ratios))
        findings += sense_findings(explanations, topics)
        wrong_times = list(time_findings(dt, yaw, heading, speed, (north, east)))
        findings += wrong_times
        if not wrong_times:
            findings += unit_findings(ratios, topics)
            geographic = self._record.is_geographic
            findings += speed_findings(dt, speed, north, east, topics, geographic=geographic)
        swing = max((float(np.ptp(x[np.isfinite(x)])) for x in (yaw, heading)
                     if np.isfinite(x).any()), default=0.0)  # fmt: skip
        findings += range_findings({"speed": speed, "rpm": rpm, "rudder": rudder}, swing, topics)
        if not any(finding.kind == "unit" and "heading" in finding.text for finding in findings):
            sense = -1 if explanations and "heading" in explanations[0] else 1
            findings += heading_zero_findings(
                dt, sense * self._absolute(heading), speed, course, topics
            )
        pair = ratios.get(("yaw_rate", "heading"))
        if pair is None or 0.8 < pair.ratio < 1.25:
            bias = self._bias.result()
            findings += [Finding("bias", bias)] if bias else []
            findings += _lag_findings(pair, self._stats)
        return findings

    def _senses(self, ratios: dict[Pair, TurningRatio]) -> dict[Pair, int]:
        senses = {pair: 1 if each.ratio > 0 else -1 for pair, each in ratios.items()}
        significance = self._rudder.significance()
        if abs(significance) > SIGNIFICANT_ERRORS:
            senses["rudder", "yaw_rate"] = 1 if significance > 0 else -1
        return senses

    def _absolute(self, heading: FloatArray) -> FloatArray:
        """Return the continuous heading with the zero of the channel's first valid sample."""
        return heading + self._record.first_heading


def _ratios(dt: float, series: dict[str, FloatArray]) -> dict[Pair, TurningRatio]:
    """Compare each pair of the channels that turn."""
    ratios: dict[Pair, TurningRatio] = {}
    for x, y in (("yaw_rate", "heading"), ("yaw_rate", "position"), ("heading", "position")):
        ratio = turning_ratio(dt, series[x], series[y])
        turned = np.nanstd(series["position"]) if np.isfinite(series["position"]).any() else 0.0
        if ratio is None or ("position" in (x, y) and turned < MIN_TURN["position"]):
            continue
        if abs(ratio.ratio) > 4 * ratio.error:
            ratios[x, y] = ratio
    return ratios


def _course(dt: float, north: FloatArray, east: FloatArray) -> FloatArray:
    """Return the continuous course over ground, rad, (n,); NaN where the ship hardly moves."""
    n = max(round(COURSE_WINDOW_SECS / dt / 2), 1)
    course = np.full_like(north, np.nan)
    if len(north) <= 4 * n:
        return course
    dn, de = north[2 * n :] - north[: -2 * n], east[2 * n :] - east[: -2 * n]
    moved = np.hypot(dn, de)
    if not np.isfinite(moved).any():
        return course
    known = moved > max(0.3 * float(np.nanmedian(moved)), 1e-3)
    angle = np.full_like(dn, np.nan)
    angle[known] = np.unwrap(np.arctan2(de[known], dn[known]))
    course[n:-n] = angle
    return course


def _lag_findings(pair: TurningRatio | None, stats: LogStats) -> list[Finding]:
    """Report a heading and a yaw rate of which one lags the other."""
    gyro, compass = stats.get("yaw_rate"), stats.get("heading")
    if pair is None or gyro is None or compass is None or abs(pair.correlation) < 0.98:
        return []
    lag, error = pair.lag_secs, pair.lag_error_secs
    resolution = max(gyro.interval_secs, compass.interval_secs, MIN_LAG_SECS)
    if abs(lag) < max(resolution, LAG_ERRORS * error):
        return []
    late, early = (compass, gyro) if lag > 0 else (gyro, compass)
    return [
        Finding(
            "lag",
            f"{late.topic}: lags {early.topic} by {abs(lag):.2f} ± {2 * error:.2f} s; likely a "
            "filter or a late time stamp in the recorder; correct its times by that delay",
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
            f"{channel.topic}: {channel.impossible.count / channel.samples:.0%} of the samples are "
            f"impossible, up to {channel.impossible.extent:.4g} {channel.unit}; likely "
            f"{causes[channel.name][0]}; change in the layout: [{channel.name}] "
            f"{causes[channel.name][1]}",
        )
        for channel in stats.channels
        if channel.name in causes and _mostly_impossible(channel)
    ]


def _mostly_impossible(channel: ChannelStats) -> bool:
    return channel.impossible.count > MIN_IMPOSSIBLE_SHARE * max(channel.samples, 1)
