"""Conclusions about speed and heading zero from fixes, and about ranges of rudder and rpm."""

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from shiplog.checks.channel_stats import LogStats
from shiplog.types import FloatArray

from .coarse_record import COURSE_WINDOW_SECS, CoarseSignals
from .findings import Finding
from .ground_velocity import GroundVelocity
from .unit_factors import GEOGRAPHIC_UNITS, LENGTH_UNITS, SPEED_UNITS, in_words, misread_units

WINDOW_SECS = 20.0  # over which the speed over ground is measured
MAX_WINDOW_TURN = np.radians(60.0)  # of the course; up to it the chord is 5 % below the distance
MAX_CURRENT = 2.5  # m/s
MIN_SPEED_RATIO, MAX_SPEED_RATIO = 0.62, 1.6  # of speed and fixes, beyond which a unit is wrong
RADIANS_RATIOS = 15.0, 70.0  # of speed and fixes, with degrees of longitude up to latitude 75
MAX_ADVANCE, MIN_ADVANCE = 30.0, 0.15  # m per revolution
MIN_RPM_SHARE = 0.2  # of the largest rpm: below it the propeller counts as stopped
MIN_DIRECTION_SHARE = 0.8  # of the samples: otherwise the propeller turns to either side
STEADY_SECS, MAX_SPEED_CHANGE = 60.0, 0.1  # a speed is steady if it changes less, relative
MAX_RUDDER, RADIANS_READ_AS_DEGREES = np.radians(50.0), np.radians(0.7)
MIN_OFFSET_DEG = 30.0  # of heading against course: less may be drift or current
MIN_FITTED_OFFSET_DEG = 5.0  # of heading against velocity, drift and current eliminated
MIN_OFFSET_ERRORS = 4.0  # standard errors by which the offset must exceed that
MIN_LAG_SECS, MIN_LAG_ERRORS = 2.0, 6.0
MAX_SCALE_ERROR = 0.05  # relative, of a scale that replaces the ratio of the medians


def speed_findings(signals: CoarseSignals, velocity: GroundVelocity | None) -> Iterator[Finding]:
    """Compare the speed with that of the fixes.

    Parameters
    ----------
    signals
        The channels of the log.
    velocity
        The fit with the current eliminated, where there is one; otherwise the medians are compared
        and a difference up to `MAX_CURRENT` may be a current.
    """
    speeds = _ground_and_water_speed(signals)
    if speeds is None:
        return
    ground, water = (float(np.median(each)) for each in speeds)
    ratio, allowance = water / ground, MAX_CURRENT
    if velocity and velocity.scale_error < MAX_SCALE_ERROR * velocity.scale:
        ratio, allowance = 1 / velocity.scale, 0.0
    if MIN_SPEED_RATIO < ratio < MAX_SPEED_RATIO or abs(water - ground) < allowance:
        return
    low, high = np.percentile(speeds[1] / speeds[0], [25, 75])
    causes, remedy = _speed_causes(signals, ratio)
    yield Finding(
        "unit",
        "speed",
        f"{signals.topics['speed']}: {water:.3g} m/s where the fixes move by {ground:.3g} m/s "
        f"(ratio {ratio:.3g}, quartiles {low:.3g} to {high:.3g}); likely "
        f"{causes}; change in the layout: {remedy}",
    )


def _speed_causes(signals: CoarseSignals, ratio: float) -> tuple[str, str]:
    """Return the likely causes of a ratio of speed to fixes, and what to change in the layout."""
    low, high = RADIANS_RATIOS
    if signals.datum and np.abs(signals.datum).max() <= np.pi and low < ratio < high:
        return "latitude and longitude in rad read as deg", "the unit of the position"
    position_units = GEOGRAPHIC_UNITS if signals.datum else LENGTH_UNITS
    speed_pairs = misread_units(ratio, SPEED_UNITS, 0.12)
    position_pairs = misread_units(1 / ratio, position_units, 0.12)
    causes = [f"[speed] {in_words(speed_pairs)}"] if speed_pairs else []
    causes += [f"[position] {in_words(position_pairs)}"] if position_pairs else []
    remedies = [f'[speed] unit = "{speed_pairs[0][0]}"'] if speed_pairs else []
    remedies += ["unit or form of [position]"] if position_pairs or not speed_pairs else []
    return " or ".join(causes) or "a wrong unit of speed, position or times", " or ".join(remedies)


def speed_lag_findings(
    signals: CoarseSignals, velocity: GroundVelocity | None, stats: LogStats
) -> Iterator[Finding]:
    """Report a speed that lags the velocity of the fixes, or precedes it."""
    speed, fixes = stats.get("speed"), stats.get("position")
    if velocity is None or speed is None or fixes is None:
        return
    lag, error = velocity.lag_secs, velocity.lag_error_secs
    resolution = max(speed.interval_secs, fixes.interval_secs, MIN_LAG_SECS)
    if not abs(lag) > max(resolution, MIN_LAG_ERRORS * error):
        return
    late, early = ("speed", "position") if lag > 0 else ("position", "speed")
    yield Finding(
        "lag",
        late,
        f"{signals.topics[late]}: lags {signals.topics[early]} by {abs(lag):.1f} ± {2 * error:.1f}"
        " s; likely a filter or a late time stamp in the recorder; correct its times by that delay "
        "(--sensor-delay)",
    )


def heading_zero_findings(
    signals: CoarseSignals, sense: int, velocity: GroundVelocity | None
) -> Iterator[Finding]:
    """Compare the heading with the direction in which the ship moves over ground.

    Parameters
    ----------
    signals
        The channels of the log.
    sense
        -1 where the heading was found to increase to port.
    velocity
        The fit with drift and current eliminated, where there is one; otherwise only large offsets
        on straight stretches are reported.
    """
    if velocity:
        offset, error = velocity.offset_deg, velocity.offset_error_deg
        limit = MIN_FITTED_OFFSET_DEG + MIN_OFFSET_ERRORS * error
        basis, figure = "with drift and current eliminated", f"{offset:+.0f} ± {2 * error:.1f}"
    else:
        offset, limit = _straight_offset_deg(signals, sense), MIN_OFFSET_DEG
        basis, figure = "on straight stretches", f"{offset:+.0f}"
    if abs(offset) < limit:
        return
    kind, cause = "zero", "a wrong zero"
    if abs(offset) < MIN_OFFSET_DEG:
        cause = "magnetic variation not corrected, or a misaligned compass"
    elif abs(abs(offset) - 90) < 20:
        kind, cause = "sign", "counted from east or west instead of north"
    elif abs(offset) > 160:
        cause = "counted from south, or a ship that goes astern with a positive speed"
    yield Finding(
        kind,
        "heading",
        f"{signals.topics['heading']}: the course of the fixes differs from it by {figure} deg "
        f"{basis}; likely {cause}; add {offset:.0f} deg to the heading",
    )


def range_findings(signals: CoarseSignals) -> Iterator[Finding]:
    """Check the range of the rudder and the advance per revolution of the propeller."""
    yield from _rudder_range_findings(signals)
    yield from _advance_findings(signals)


def _ground_and_water_speed(signals: CoarseSignals) -> tuple[FloatArray, FloatArray] | None:
    """Return speed over ground and through the water where both are known, each (m,) m/s.

    In a tight turn the fixes are nearer to each other than the distance covered, so that windows
    with a larger turn than `MAX_WINDOW_TURN` are not used.
    """
    dt, north, east, speed = signals.dt_secs, signals.north, signals.east, signals.speed
    n = max(round(WINDOW_SECS / dt), 1)
    if len(speed) <= 2 * n:
        return None
    ground = np.hypot(north[n:] - north[:-n], east[n:] - east[:-n]) / (n * dt)
    water = np.abs(speed[n // 2 : n // 2 + len(ground)])
    turns = np.ptp(sliding_window_view(signals.course, n + 1)[:, :: max(n // 10, 1)], axis=1)
    known = np.isfinite(ground + water) & (turns < MAX_WINDOW_TURN) & (ground > 0) & (water > 0)
    return (ground[known], water[known]) if np.count_nonzero(known) >= 3 * n else None


def _straight_offset_deg(signals: CoarseSignals, sense: int) -> float:
    """Return course minus heading while the ship goes straight ahead, deg; 0 if undetermined.

    It is undetermined for a ship so slow that a current changes its course by `MIN_OFFSET_DEG`.
    """
    heading, speed = sense * signals.heading, signals.speed
    n = max(round(WINDOW_SECS / signals.dt_secs), 1)
    if len(heading) <= 2 * n:
        return 0.0
    turn = np.full_like(heading, np.nan)
    turn[n:-n] = np.abs(heading[2 * n :] - heading[: -2 * n])
    ahead = ~(speed <= 0.2 * np.nanmedian(np.abs(speed))) if np.isfinite(speed).any() else True
    known = np.isfinite(signals.course + turn) & ahead & (turn < np.radians(20.0))
    if np.count_nonzero(known) < 3 * n or _typical_speed(signals, known) < 2 * MAX_CURRENT:
        return 0.0
    mean = np.mean(np.exp(1j * (signals.course - heading)[known]))
    return float(np.degrees(np.angle(mean))) if abs(mean) >= 0.8 else 0.0


def _typical_speed(signals: CoarseSignals, known: NDArray[np.bool_]) -> float:
    """Return the median speed at some instants, m/s; that of the fixes without a speed."""
    speeds = np.abs(signals.speed[known])
    if not np.isfinite(speeds).any():
        half = max(round(COURSE_WINDOW_SECS / signals.dt_secs / 2), 1)
        at, track = np.flatnonzero(known), signals.north + 1j * signals.east
        speeds = np.abs(track[at + half] - track[at - half]) / (2 * half * signals.dt_secs)
    return float(np.nanmedian(speeds))


def _rudder_range_findings(signals: CoarseSignals) -> Iterator[Finding]:
    rudder = signals.rudder[np.isfinite(signals.rudder)]
    if not len(rudder):
        return
    largest = float(np.percentile(np.abs(rudder), 99.5))
    degrees, topic = np.degrees(largest), signals.topics["rudder"]
    if largest > MAX_RUDDER:
        yield Finding(
            "unit",
            "rudder",
            f"{topic}: up to {degrees:.0f} deg, beyond what a rudder reaches; likely per cent of "
            "its maximum or tenths of a degree read as deg, to be converted in the table; or deg "
            'read as rad; then change in the layout: [rudder] unit = "deg"',
        )
    elif 0 < largest < RADIANS_READ_AS_DEGREES and signals.swing > np.radians(15.0):
        yield Finding(
            "unit",
            "rudder",
            f"{topic}: never beyond {degrees:.2g} deg while the heading swings by "
            f"{np.degrees(signals.swing):.0f} deg; likely rad read as deg; change in the layout: "
            '[rudder] unit = "rad"',
        )


def _advance_findings(signals: CoarseSignals) -> Iterator[Finding]:
    turning = _propeller_turns(signals.rpm)
    driven = turning & _speed_is_steady(signals)
    if not driven.any():
        return
    topic, speeds, revolutions = signals.topics["rpm"], signals.speed[driven], signals.rpm[driven]
    ahead_share = float(np.mean(revolutions > 0))
    if max(ahead_share, 1 - ahead_share) < MIN_DIRECTION_SHARE:
        return
    speed, rpm = float(np.median(speeds)), float(np.median(revolutions))
    advance = abs(60 * speed / rpm)
    reversed_share = float(np.mean(speeds * revolutions < 0))
    # a ship that stops by its propeller moves against it for a while
    one_direction = len(np.unique(np.sign(signals.rpm[turning]))) == 1
    if reversed_share > 0.9 and one_direction:
        yield Finding(
            "sign",
            "rpm",
            f"{topic}: {rpm:.3g} rpm while the speed is {speed:.3g} m/s in "
            f"{reversed_share:.0%} of the samples at steady speed; likely the sign of one is "
            "reversed; change in the layout: sign = -1 of [rpm] or of [speed]",
        )
    if abs(speed) > 1.0 and MAX_ADVANCE < advance < 60 * MAX_ADVANCE:
        yield Finding(
            "unit",
            "rpm",
            f"{topic}: {rpm:.3g} rpm at {speed:.3g} m/s is an advance of {advance:.0f} m "
            f"per revolution; likely rev/s read as rpm ({advance / 60:.2g} m), or rad/s; change in "
            'the layout: [rpm] unit = "rev/s"',
        )
    elif abs(speed) > 3.0 and 0 < advance < MIN_ADVANCE:
        yield Finding(
            "unit",
            "rpm",
            f"{topic}: {rpm:.4g} rpm at {speed:.3g} m/s is an advance of {advance:.2g} m "
            "per revolution; likely rpm read as rev/s; change in the layout: "
            '[rpm] unit = "rpm"',
        )


def _propeller_turns(rpm: FloatArray) -> NDArray[np.bool_]:
    """Return where the propeller turns by more than the noise of a stopped shaft, (n,)."""
    largest = float(np.max(np.abs(rpm), where=np.isfinite(rpm), initial=0.0))
    return np.asarray(np.abs(rpm) > MIN_RPM_SHARE * largest)


def _speed_is_steady(signals: CoarseSignals) -> NDArray[np.bool_]:
    """Return where the speed hardly changes within `STEADY_SECS` around an instant, (n,)."""
    speed, half = signals.speed, max(round(STEADY_SECS / 2 / signals.dt_secs), 1)
    steady = np.zeros(len(speed), bool)
    if len(speed) > 2 * half:
        change = np.abs(speed[2 * half :] - speed[: -2 * half])
        steady[half:-half] = change < MAX_SPEED_CHANGE * np.abs(speed[half:-half])
    return steady
