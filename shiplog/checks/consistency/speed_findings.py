"""Conclusions about speed, revolutions, rudder range and heading zero, from fixes and limits."""

from collections.abc import Iterator, Mapping
from math import isfinite

import numpy as np

from shiplog.types import FloatArray
from shiplog.units import conversion_factor

from .findings import Finding
from .unit_factors import LENGTH_UNITS, SPEED_UNITS, in_words, misread_units

WINDOW_SECS = 20.0  # over which the speed over ground is measured
MAX_CURRENT = 2.5  # m/s
MAX_ADVANCE, MIN_ADVANCE = 30.0, 0.15  # m per revolution
MAX_RUDDER, RADIANS_READ_AS_DEGREES = np.radians(50.0), np.radians(0.7)
MIN_RADIANS_RATIO, MAX_RADIANS_RATIO = 15.0, 65.0  # of speeds, for positions in rad read as deg
MIN_OFFSET_DEG = 30.0  # of heading against course: less may be drift or current


def speed_findings(
    dt: float,
    speed: FloatArray,
    north: FloatArray,
    east: FloatArray,
    topics: Mapping[str, str],
    *,
    geographic: bool,
) -> Iterator[Finding]:
    """Compare the speed with that of the fixes."""
    n = max(round(WINDOW_SECS / dt), 1)
    if len(speed) <= 2 * n:
        return
    ground = np.hypot(north[n:] - north[:-n], east[n:] - east[:-n]) / (n * dt)
    mean = np.abs(speed[n // 2 : n // 2 + len(ground)])
    known = np.isfinite(ground) & np.isfinite(mean) & (ground > 0) & (mean > 0)
    if np.count_nonzero(known) < 3 * n:
        return
    ground_speed, water_speed = float(np.median(ground[known])), float(np.median(mean[known]))
    ratio = water_speed / ground_speed
    low, high = np.percentile(mean[known] / ground[known], [25, 75])
    if 0.62 < ratio < 1.6 or abs(water_speed - ground_speed) < min(MAX_CURRENT, water_speed):
        return
    speed_units = misread_units(ratio, SPEED_UNITS, 0.12)
    length_units = misread_units(1 / ratio, LENGTH_UNITS, 0.12)
    if 0.75 < ratio / conversion_factor("rad", "deg") ** -1 < 1.33:
        length_units = []
    causes = [f"[speed] {in_words(speed_units)}"] if speed_units else []
    causes += [f"[position] {in_words(length_units)}"] if length_units else []
    # near 0 deg of latitude the meridians are farther apart than where the ship was
    if geographic and MIN_RADIANS_RATIO < ratio < MAX_RADIANS_RATIO:
        causes.insert(0, "[position] latitude and longitude in rad read as deg")
    remedy = f'[speed] unit = "{speed_units[0][0]}"' if speed_units else "the unit of the positions"
    yield Finding(
        "unit",
        f"{topics['speed']}: {water_speed:.3g} m/s where the fixes move by {ground_speed:.3g} m/s "
        f"(ratio {ratio:.3g}, quartiles {low:.3g} to {high:.3g}); likely "
        f"{' or '.join(causes) or 'a wrong unit of speed or position'}; change in the layout: "
        f"{remedy}",
    )


def heading_zero_findings(
    dt: float, heading: FloatArray, speed: FloatArray, course: FloatArray, topics: Mapping[str, str]
) -> Iterator[Finding]:
    """Compare the heading with the course of the fixes while the ship goes straight ahead."""
    n = max(round(WINDOW_SECS / dt), 1)
    if len(heading) <= 2 * n:
        return
    turn = np.full_like(heading, np.nan)
    turn[n:-n] = np.abs(heading[2 * n :] - heading[: -2 * n])
    ahead = ~(speed <= 0.2 * np.nanmedian(np.abs(speed))) if np.isfinite(speed).any() else True
    known = np.isfinite(course + turn) & ahead & (turn < np.radians(20.0))
    if np.count_nonzero(known) < 3 * n:
        return
    mean = np.mean(np.exp(1j * (course - heading)[known]))
    offset = float(np.degrees(np.angle(mean)))
    if abs(mean) < 0.8 or abs(offset) < MIN_OFFSET_DEG:
        return
    cause = "a wrong zero"
    if abs(abs(offset) - 90) < 20:
        cause = "counted from east or west instead of north"
    elif abs(offset) > 160:
        cause = "counted from south, or a ship that goes astern with a positive speed"
    yield Finding(
        "zero",
        f"{topics['heading']}: the course of the fixes differs from it by {offset:+.0f} deg on "
        f"straight stretches; likely {cause}; add {offset:.0f} deg to the heading",
    )


def range_findings(
    record: Mapping[str, FloatArray], turned: float, topics: Mapping[str, str]
) -> Iterator[Finding]:
    """Check the rudder's range, and the advance per revolution.

    Parameters
    ----------
    record
        Values of rudder, speed and rpm on the clock.
    turned
        How far the heading swung, rad.
    """
    rudder = record["rudder"][np.isfinite(record["rudder"])]
    if "rudder" in topics and len(rudder):
        largest = float(np.percentile(np.abs(rudder), 99.5))
        degrees = np.degrees(largest)
        if largest > MAX_RUDDER:
            yield Finding(
                "unit",
                f"{topics['rudder']}: up to {degrees:.0f} deg, beyond what a rudder reaches; likely"
                ' per cent of its maximum or tenths of a degree read as deg, or deg read as rad; '
                'change in the layout: [rudder] unit = "deg"',
            )  # fmt: skip
        elif 0 < largest < RADIANS_READ_AS_DEGREES and turned > np.radians(15.0):
            yield Finding(
                "unit",
                f"{topics['rudder']}: never beyond {degrees:.2g} deg while the heading swings by "
                f"{np.degrees(turned):.0f} deg; likely rad read as deg; change in the layout: "
                '[rudder] unit = "rad"',
            )
    both = np.isfinite(record["speed"] + record["rpm"]) & (np.abs(record["rpm"]) > 0)
    if not both.any():
        return
    speed, rpm = (float(np.median(record[name][both])) for name in ("speed", "rpm"))
    advance = abs(60 * speed / rpm) if rpm else 0.0
    reversed_share = float(np.mean(record["speed"][both] * record["rpm"][both] < 0))
    if reversed_share > 0.9:
        yield Finding(
            "sign",
            f"{topics['rpm']}: {rpm:.3g} rpm while the speed is {speed:.3g} m/s in "
            f"{reversed_share:.0%} of the log; likely the sign of one is reversed; change in the "
            "layout: sign = -1 of [rpm] or of [speed]",
        )
    if isfinite(advance) and abs(speed) > 1.0 and advance > MAX_ADVANCE:
        yield Finding(
            "unit",
            f"{topics['rpm']}: {rpm:.3g} rpm at {speed:.3g} m/s is an advance of {advance:.0f} m "
            f"per revolution; likely rev/s read as rpm ({advance / 60:.2g} m), or rad/s; change in "
            'the layout: [rpm] unit = "rev/s"',
        )
    elif abs(speed) > 3.0 and 0 < advance < MIN_ADVANCE:
        yield Finding(
            "unit",
            f"{topics['rpm']}: {rpm:.4g} rpm at {speed:.3g} m/s is an advance of {advance:.2g} m "
            "per revolution; likely rpm read as rev/s; change in the layout: "
            '[rpm] unit = "rpm"',
        )
