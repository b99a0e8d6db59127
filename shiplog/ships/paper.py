"""The paper's equations of motion, which filters and observers are built on.

`shiplog.ships.burylin` has them beside other models, for simulation and for identification; they
give the same to the last bit. The model is Burylin's, "Continuous identification of a nonlinear
vessel movement model with an estimator", eqs (1)-(4): a second-order nonlinear Nomoto model of yaw,
coupled with surge.

    w'' = a w' + b1 w + b2 w|w| + b3 w^3 + ks (d delta + e delta')
    v'  = f w^2 + g v^2 + h n
    ks  = alpha1 v + alpha2 n exp(-alpha3 v)

w is the yaw rate in rad/s, v the speed ahead in m/s, delta the rudder in rad, n the propeller's
revolutions in rpm. `ks` has no unit where the paper's time constants and gains are used: its
alpha1 is in s/m, its alpha2 in 1/rpm and its alpha3 in s/m. The model is one of a ship going ahead:
g v^2 has no sign, so that astern it drives her on.
"""

from math import exp, sqrt
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray


class Coefficients(NamedTuple):
    """The model's coefficients, in the units of `COEFFICIENT_UNITS`."""

    a: float
    b1: float
    b2: float
    b3: float
    d: float
    e: float
    f: float
    g: float
    h: float
    alpha1: float
    alpha2: float
    alpha3: float


COEFFICIENT_UNITS = {
    "a": "1/s",
    "b1": "1/s²",
    "b2": "1/(rad·s)",
    "b3": "1/rad²",
    "d": "1/s²",
    "e": "1/s",
    "f": "m/rad²",
    "g": "1/m",
    "h": "m/s²/rpm",
    "alpha1": "s/m",
    "alpha2": "1/rpm",
    "alpha3": "s/m",
}
PAPER_OUTPUTS = ("yaw_rate", "speed")  # what is measured of the ship,
PAPER_INPUTS = ("rudder", "rpm")  # and what she is given
YAW_COEFFICIENTS = ("a", "b1", "b2", "b3", "d", "e")
SURGE_COEFFICIENTS = ("f", "g", "h")


@compiled
def rudder_effect(c: Coefficients, v: float, n: float) -> float:
    """How well the rudder works at a speed and a rate of revolutions: ks of eq. (3)."""
    return c.alpha1 * v + c.alpha2 * n * exp(-c.alpha3 * v)


@compiled
def rudder_effects(c: Coefficients, v: FloatArray, n: FloatArray) -> FloatArray:
    """ks over a run, (n,); NaN where speed or revolutions are."""
    effects = np.empty(len(v))
    for k in range(len(v)):
        effects[k] = rudder_effect(c, v[k], n[k])
    return effects


@compiled
def rudder_effect_rate(c: Coefficients, v: float, v_dot: float, n: float, n_dot: float) -> float:
    """d ks / dt."""
    slipstream = c.alpha2 * exp(-c.alpha3 * v)
    return c.alpha1 * v_dot + slipstream * (n_dot - c.alpha3 * n * v_dot)


@compiled
def yaw_acceleration_rate(
    c: Coefficients, w: float, w_dot: float, v: float, n: float, delta: float, delta_dot: float
) -> float:
    """w'' of eq. (4), rad/s^3."""
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w * w * w
    return hull + rudder_effect(c, v, n) * (c.d * delta + c.e * delta_dot)


@compiled
def yaw_stiffness(c: Coefficients, w: float) -> float:
    """d w'' / dw at a yaw rate: b1 and what the nonlinear terms add to it, 1/s^2."""
    return c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w


@compiled
def surge_acceleration(c: Coefficients, w: float, v: float, n: float) -> float:
    """v' of eq. (4), m/s^2."""
    return c.f * w * w + c.g * v * v + c.h * n


def steady_speed(c: Coefficients, n: float) -> float:
    """The speed ahead, m/s, at which a straight run at `n` rpm settles; 0 astern or stopped."""
    return sqrt(c.h * n / -c.g) if c.h * n > 0 and c.g < 0 else 0.0
