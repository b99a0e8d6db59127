"""The identification paper's equations of motion, on which filters and observers are built.

A second-order nonlinear Nomoto model of yaw, coupled with surge. `shiplog.ships.burylin` has the
same equations as a ship model for simulation and identification; both give the same numbers to the
last bit.

    w'' = a w' + b1 w + b2 w|w| + b3 w^3 + ks (d delta + e delta')
    v'  = f w^2 + g v^2 + h n
    ks  = alpha1 v + alpha2 n exp(-alpha3 v)

w is the yaw rate in rad/s, v the speed ahead in m/s, delta the rudder in rad, n the propeller's
revolutions in rpm. `ks` has no unit where the paper's time constants and gains are used: its
alpha1 is in s/m, its alpha2 in 1/rpm and its alpha3 in s/m. The model holds for a ship going ahead:
g v^2 has no sign, so that astern it would accelerate the ship.

References
----------
Ya. V. Burylin, "Continuous identification of a nonlinear vessel movement model with an estimator",
equations (1) to (4).
"""

from math import exp, sqrt
from typing import NamedTuple

import numpy as np

from shiplog.compiled import compiled
from shiplog.types import FloatArray


class Coefficients(NamedTuple):
    """The model's coefficients, in the units of `COEFFICIENT_UNITS`.

    Attributes
    ----------
    a
        Damping of the yaw acceleration.
    b1, b2, b3
        The linear, quadratic and cubic term in the yaw rate.
    d, e
        The effect of the rudder and of its rate.
    f
        The loss of speed in a turn.
    g
        The resistance.
    h
        The thrust.
    alpha1, alpha2, alpha3
        The rudder effectiveness by the ship's speed and by the propeller's slipstream.
    """

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
PAPER_OUTPUTS = ("yaw_rate", "speed")
PAPER_INPUTS = ("rudder", "rpm")
YAW_COEFFICIENTS = ("a", "b1", "b2", "b3", "d", "e")
SURGE_COEFFICIENTS = ("f", "g", "h")


@compiled
def rudder_effect(c: Coefficients, v: float, n: float) -> float:
    """Compute the rudder effectiveness ks at a speed `v`, m/s, and `n` rpm, equation (3).

    Examples
    --------
    >>> from shiplog import load_vessel
    >>> round(rudder_effect(load_vessel("table1")[0].paper_coefficients, 9.0, 80.0), 4)
    0.2205
    """
    return c.alpha1 * v + c.alpha2 * n * exp(-c.alpha3 * v)


@compiled
def rudder_effects(c: Coefficients, v: FloatArray, n: FloatArray) -> FloatArray:
    """Compute ks over a run.

    Parameters
    ----------
    c
        The coefficients.
    v, n
        (n,) the speed ahead, m/s, and the revolutions, rpm.

    Returns
    -------
    (n,) array
        ks; NaN where the speed or the revolutions are NaN.
    """
    effects = np.empty(len(v))
    for k in range(len(v)):
        effects[k] = rudder_effect(c, v[k], n[k])
    return effects


@compiled
def rudder_effect_rate(c: Coefficients, v: float, v_dot: float, n: float, n_dot: float) -> float:
    """Compute the time derivative of ks, 1/s, at the rates `v_dot`, m/s², and `n_dot`, rpm/s."""
    slipstream = c.alpha2 * exp(-c.alpha3 * v)
    return c.alpha1 * v_dot + slipstream * (n_dot - c.alpha3 * n * v_dot)


@compiled
def yaw_acceleration_rate(
    c: Coefficients, w: float, w_dot: float, v: float, n: float, delta: float, delta_dot: float
) -> float:
    """Compute w'' of equation (4), rad/s³.

    Parameters
    ----------
    c
        The coefficients.
    w, w_dot
        The yaw rate, rad/s, and the yaw acceleration, rad/s².
    v, n
        The speed ahead, m/s, and the revolutions, rpm.
    delta, delta_dot
        The rudder, rad, and its rate, rad/s.
    """
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * abs(w) + c.b3 * w * w * w
    return hull + rudder_effect(c, v, n) * (c.d * delta + c.e * delta_dot)


@compiled
def yaw_stiffness(c: Coefficients, w: float) -> float:
    """Compute d w'' / dw at a yaw rate, 1/s²: b1 and the share of the nonlinear terms."""
    return c.b1 + 2 * c.b2 * abs(w) + 3 * c.b3 * w * w


@compiled
def surge_acceleration(c: Coefficients, w: float, v: float, n: float) -> float:
    """Compute v' of equation (4), m/s²."""
    return c.f * w * w + c.g * v * v + c.h * n


def steady_speed(c: Coefficients, n: float) -> float:
    """Compute the steady speed ahead, m/s, of a straight run at `n` rpm; 0 astern or stopped.

    Examples
    --------
    >>> from shiplog import load_vessel
    >>> round(steady_speed(load_vessel("table1")[0].paper_coefficients, 80.0), 2)
    10.33
    """
    return sqrt(c.h * n / -c.g) if c.h * n > 0 and c.g < 0 else 0.0
