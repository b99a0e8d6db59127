"""The paper's model with speed scaling, propeller slipstream and drift.

    rho'' = a nu rho' + b1 nu^2 rho + b2 nu rho|rho| + ks (nu delta + T3 delta')
    ks    = k ((1 - m) nu^2 + m eta^2)
    nu'   = f rho^2 + g nu^2 + h eta
    sigma = c1 rho + c2 rho|rho| / nu

rho is the yaw rate times L/U0, nu the speed over U0 and sigma the sway over U0, eta the
revolutions over theirs, time is in L/U0. Three effects, seen in the trials of a tanker, extend the
paper's model: the hull terms scale with the speed, so that a slower ship turns more slowly in time
but not over the distance covered; the rudder works in the propeller's slipstream when the ship has
lost speed; and the course over ground differs from the heading by the drift. b3 is omitted: it is
collinear with b2.
"""

from typing import NamedTuple

from shiplog.compiled import compiled

from .model import Model, Parameter, StateValue
from .motion import (
    ComplexArray,
    Forcing,
    InputPath,
    equations,
    integrate,
    magnitude,
    observations,
    root,
)


class Slipstream(NamedTuple):
    """The coefficients of the equations, dimensionless.

    Attributes
    ----------
    a
        Damping of the yaw acceleration.
    b1, b2
        The linear and the quadratic term in the yaw rate.
    k
        The effectiveness of the rudder.
    m
        The propeller's fraction of the stream in which the rudder works.
    T3
        The time constant of the rudder's rate.
    f
        The loss of speed in a turn.
    g
        The resistance.
    h
        The thrust.
    c1, c2
        The linear and the quadratic drift by the yaw rate.
    """

    a: complex
    b1: complex
    b2: complex
    k: complex
    m: complex
    T3: complex
    f: complex
    g: complex
    h: complex
    c1: complex
    c2: complex


@equations(Slipstream)
def _motion(c: Slipstream, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, rho_dot, nu = x[0], x[1], x[2]
    ks = c.k * ((1 - c.m) * nu * nu + c.m * u.n * u.n)
    hull = c.a * nu * rho_dot + c.b1 * nu * nu * rho + c.b2 * nu * rho * magnitude(rho)
    return (
        rho_dot,
        hull + ks * (nu * u.delta + c.T3 * u.delta_dot),
        c.f * rho * rho + c.g * nu * nu + c.h * u.n,
        rho,
    )


@observations(Slipstream)
def _observed(c: Slipstream, x: ComplexArray) -> tuple[complex, complex, complex, complex]:
    rho, nu = x[0], x[2]
    sway = c.c1 * rho + c.c2 * rho * magnitude(rho) / nu
    return rho, root(nu * nu - sway * sway), sway, x[3]


@compiled
def _integrate(
    c: Slipstream, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


YAW = (
    Parameter("a", "1", -2.0),
    Parameter("b1", "1", 0.5),
    Parameter("b2", "1", -3.0),
    Parameter("k", "1", 0.9),
    Parameter("m", "1", 0.3, prior_std=0.5),
    Parameter("T3", "1", 1.0),
)
SURGE = (
    Parameter("f", "1", -0.3),
    Parameter("g", "1", -0.05, highest=0.0),
    Parameter("h", "1", 0.05),
)
SLIPSTREAM = Model(
    "slipstream", "the paper's model with speed scaling, slipstream and drift", Slipstream,
    (*YAW, *SURGE, Parameter("c1", "1", -0.4), Parameter("c2", "1", 0.0, typical=0.3)),
    (
        StateValue("rho", "yaw_rate"),
        StateValue("rho_dot", prior_std=0.5),
        StateValue("nu", "speed"),
        StateValue("psi", "heading"),
    ),
    _integrate, outputs=("yaw_rate", "speed", "sway", "heading"),
)  # fmt: skip
