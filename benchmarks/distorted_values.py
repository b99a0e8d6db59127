"""Distortions of values: units, signs, sentinel values, positions, and sources of one quantity."""

from collections.abc import Callable
from math import pi

import numpy as np

from shiplog.types import FloatArray

from .distortion import (
    Distortion,
    geographic,
    on_values,
    replaced,
    scaled,
    second_source,
    shares_of,
)

DEG = pi / 180
KNOT = 1852 / 3600
THIRD, SOME, ONE = slice(None, None, 3), slice(0.3, 0.4), slice(0.5, 0.5)
START, END, ALL = slice(None, 0.1), slice(0.9, None), slice(None)


def unit_distortions() -> list[Distortion]:
    """Return the units taken for others: the values are wrong by a factor."""
    cases = (
        # channel, the unit that is written, the one that it is taken for, factor
        ("yaw_rate", "deg/s", "rad/s", 1 / DEG),
        ("yaw_rate", "deg/min", "rad/s", 60 / DEG),
        ("yaw_rate", "deg/min", "deg/s", 60.0),
        ("yaw_rate", "rad/s", "deg/s", DEG),
        ("yaw_rate", "deg/s", "deg/min", 1 / 60),
        ("speed", "kn", "m/s", 1 / KNOT),
        ("speed", "km/h", "m/s", 3.6),
        ("speed", "m/s", "kn", KNOT),
        ("speed", "m/s", "km/h", 1 / 3.6),
        ("speed", "kn", "km/h", 1 / KNOT / 3.6),
        ("rudder", "deg", "rad", 1 / DEG),
        ("rudder", "rad", "deg", DEG),
        ("rpm", "rev/s", "rpm", 1 / 60),
        ("rpm", "rpm", "rev/s", 60.0),
        ("heading", "deg", "rad", 1 / DEG),
        ("heading", "rad", "deg", DEG),
        ("position", "km", "m", 1e-3),
        ("position", "ft", "m", 1 / 0.3048),
        ("position", "nmi", "m", 1 / 1852),
    )
    return [
        Distortion(
            "unit", f"{name} in {written} read as {taken}",
            (f"{name} {written} read", f"{name} {written} unit", f"{name} constant unit"),
            scaled(name, by=factor),
        )
        for name, written, taken, factor in cases
    ] + [
        Distortion(
            "unit", "rudder in per cent of 35 deg read as deg", ("rudder per cent",),
            scaled("rudder", by=100 / 35),
        ),
    ]  # fmt: skip


def sign_distortions() -> list[Distortion]:
    """Return the signs and senses that are contrary to the conventions."""
    signs = [
        Distortion("sign", f"{' and '.join(names)} reversed",
                   tuple(f"{name} {word}" for name in names
                         for word in ("sign", "sense", "reversed")),
                   scaled(*names, by=-1.0))
        for names in (
            ("yaw_rate",), ("rudder",), ("heading",), ("speed",), ("rpm",),
            ("yaw_rate", "rudder"), ("yaw_rate", "heading"), ("rudder", "heading"),
            ("yaw_rate", "rudder", "heading"),
        )
    ]  # fmt: skip
    mirrored = ("position mirrored", "position exchanged", "position swapped", "position sign")
    return [
        *signs,
        Distortion("sign", "heading clockwise from east", ("heading east", "heading zero"),
                   on_values("heading", lambda heading: heading - pi / 2)),
        Distortion("sign", "heading counter-clockwise from east", ("heading sense", "heading sign"),
                   on_values("heading", lambda heading: pi / 2 - heading)),
        Distortion("sign", "heading from south", ("heading south", "heading zero"),
                   on_values("heading", lambda heading: heading + pi)),
        Distortion("sign", "north reversed", mirrored,
                   on_values("position", lambda fixes: fixes * [-1, 1])),
        Distortion("sign", "east reversed", mirrored,
                   on_values("position", lambda fixes: fixes * [1, -1])),
        Distortion("sign", "north and east exchanged", mirrored,
                   on_values("position", lambda fixes: fixes[:, ::-1])),
    ]  # fmt: skip


def sentinel_distortions() -> list[Distortion]:
    """Return the values that stand for "not available", and stuck sensors."""
    cases = (
        ("heading", "511 deg in every third sample", 511 * DEG, THIRD),
        ("heading", "511 deg throughout", 511 * DEG, ALL),
        ("heading", "3600 deg at the start", 3600 * DEG, START),
        ("heading", "6.5535 rad in every third sample", 6.5535, THIRD),
        ("yaw_rate", "9999 deg/s once", 9999 * DEG, ONE),
        ("yaw_rate", "-128 deg/min in every third sample", -128 / 60 * DEG, THIRD),
        ("yaw_rate", "67.1 rad/s at the end", 67.1, END),
        ("speed", "102.3 kn in every third sample", 102.3 * KNOT, THIRD),
        ("speed", "655.35 m/s for a while", 655.35, SOME),
        ("speed", "-1 m/s in every third sample", -1.0, THIRD),
        ("speed", "0 m/s in every third sample", 0.0, THIRD),
        ("rudder", "9.99 rad once", 9.99, ONE),
        ("rudder", "127 deg for a while", 127 * DEG, SOME),
        ("rudder", "99.9 deg at the start", 99.9 * DEG, START),
        ("rudder", "0.9 rad in every third sample", 0.9, THIRD),
        ("rpm", "65535 rpm in every third sample", 65535.0, THIRD),
        ("rpm", "0 rpm in every third sample", 0.0, THIRD),
        ("rpm", "-1 rpm at the start", -1.0, START),
    )
    words = ("not available", "impossible", "not used", "jumps", "stuck", "negative", "constant")
    stuck = (("yaw_rate", slice(0.7, None)), ("speed", slice(0.4, None)), ("rudder", SOME),
             ("heading", slice(0.3, 0.7)))  # fmt: skip
    return [
        Distortion("sentinel", f"{name} {text}", tuple(f"{name} {word}" for word in words),
                   replaced(name, value, rows))
        for name, text, value, rows in cases
    ] + [
        Distortion("sentinel", f"{name} stuck", (f"{name} stuck",), on_values(name, _stuck(rows)))
        for name, rows in stuck
    ]  # fmt: skip


def _stuck(rows: slice) -> Callable[[FloatArray], FloatArray]:
    def apply(values: FloatArray) -> FloatArray:
        values = values.copy()
        at = shares_of(rows, len(values))
        values[at] = values[at.start]
        return values

    return apply


def position_distortions() -> list[Distortion]:
    """Return the forms of a position, and fixes that are none."""
    fix = ("position fix", "position impossible", "position not available", "position reach")
    form = ("position minutes", "position ddmm", "position unit", "position read as")
    mirrored = ("position mirrored", "position exchanged", "position swapped", "position sign")

    forms = (
        ("latitude and longitude without altitude", form, geographic()),
        ("latitude and longitude with altitude", form, geographic(altitude=25.0)),
        ("eastward over the antimeridian", form, geographic(datum=(-17.0, 179.999))),
        ("westward over the antimeridian", form, geographic(datum=(-17.0, -179.9999))),
        ("near the pole", form, geographic(datum=(89.9, 20.0))),
        ("91 and 181 for a while", fix, geographic(_in_rows((91.0, 181.0), SOME))),
        ("0 and 0 at the start", fix, geographic(_in_rows((0.0, 0.0), START))),
        ("0 and 0 in every third fix", fix, geographic(_in_rows((0.0, 0.0), THIRD))),
        ("a fix 10 km away", fix, on_values("position", _with_a_jump)),
        ("ddmm.mmmm read as degrees", form, geographic(_degrees_minutes)),
        ("ddmm.mmmm read as degrees near the equator", form,
         geographic(_degrees_minutes, datum=(0.6, 0.7))),
        ("degrees read as radians", form, geographic(lambda globe: globe * DEG)),
        ("latitude and longitude exchanged", mirrored, geographic(lambda globe: globe[:, ::-1])),
        ("west written without a sign", mirrored,
         geographic(np.abs, datum=(60.0, -20.0))),
        ("from a far origin", form, on_values("position", _from_afar)),
    )  # fmt: skip
    return [Distortion("position", name, causes, apply) for name, causes, apply in forms]


def _in_rows(values: tuple[float, float], rows: slice) -> Callable[[FloatArray], FloatArray]:
    def change(globe: FloatArray) -> FloatArray:
        globe[shares_of(rows, len(globe))] = values
        return globe

    return change


def _degrees_minutes(globe: FloatArray) -> FloatArray:
    """Return degrees as the numbers ddmm.mmmm."""
    whole = np.trunc(globe)
    return whole * 100 + (globe - whole) * 60


def _from_afar(fixes: FloatArray) -> FloatArray:
    moved: FloatArray = fixes + np.array([6.6e6, 5e5])
    return moved


def _with_a_jump(fixes: FloatArray) -> FloatArray:
    fixes = fixes.copy()
    fixes[len(fixes) // 2] += 10_000.0
    return fixes


def source_distortions() -> list[Distortion]:
    """Return the second sources of a quantity that differ from the right one."""

    def drifting(values: FloatArray) -> FloatArray:
        return values + 0.05 * DEG * np.linspace(0, 1, len(values))

    cases = (
        ("rudder", "slipping rudder", lambda v: 0.3 * v + 2 * DEG),
        ("rudder", "rudder in deg", lambda v: v / DEG),
        ("rudder", "rudder stuck", lambda v: 0 * v + v[0]),
        ("yaw_rate", "biased yaw rate", lambda v: v + 0.1 * DEG),
        ("yaw_rate", "drifting yaw rate", drifting),
        ("yaw_rate", "yaw rate to port", lambda v: -v),
        ("speed", "speed in kn", lambda v: v / KNOT),
        ("speed", "speed 5 % too high", lambda v: 1.05 * v),
        ("heading", "magnetic heading", lambda v: v - 8 * DEG),
        ("rpm", "rpm of the engine, geared 4 to 1", lambda v: 4 * v),
    )
    return [
        Distortion("source", f"{text} {'first' if first else 'last'}", (f"{name} source",
                   f"{name} differ", f"{name} second"), second_source(name, function, first=first))
        for name, text, function in cases
        for first in ((True, False) if text in {"slipping rudder", "biased yaw rate"} else (True,))
    ]  # fmt: skip
