"""The slipstream model with a lag of the drift, a propeller side force, and surge from sway.

    rho''  = a nu rho' + b1 nu^2 rho + b2 nu rho|rho| + ks (nu delta + T3 delta') + e0 nu eta^2
    ks     = k ((1 - m) nu^2 + m eta^2)
    nu'    = f rho^2 + f1 rho sigma + f2 sigma^2 + g nu^2 + h eta
    sigma' = (c1 nu rho + c2 rho|rho| - nu sigma) / Td

sigma is the sway over U0, all else as in `slipstream`. A single screw pushes the stern to one side:
e0 is its yaw moment with the rudder amidships. In a turn the drift slows the ship, mainly by the
term rho sigma, which is the inertia of its own mass moving sideways.
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
from .slipstream import SURGE, YAW


class DriftLag(NamedTuple):
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
    f, f1, f2
        The loss of speed by turning, by turning while drifting, and by drifting.
    g
        The resistance.
    h
        The thrust.
    c1, c2
        The linear and the quadratic drift in a steady turn.
    Td
        The time constant of the drift.
    e0
        The yaw moment of a single screw.
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
    Td: complex
    e0: complex
    f1: complex
    f2: complex


@equations(DriftLag)
def _motion(c: DriftLag, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, rho_dot, nu, sigma = x[0], x[1], x[2], x[3]
    ks = c.k * ((1 - c.m) * nu * nu + c.m * u.n * u.n)
    hull = c.a * nu * rho_dot + c.b1 * nu * nu * rho + c.b2 * nu * rho * magnitude(rho)
    slowed = c.f * rho * rho + c.f1 * rho * sigma + c.f2 * sigma * sigma
    return (
        rho_dot,
        hull + ks * (nu * u.delta + c.T3 * u.delta_dot) + c.e0 * nu * u.n * u.n,
        slowed + c.g * nu * nu + c.h * u.n,
        (c.c1 * nu * rho + c.c2 * rho * magnitude(rho) - nu * sigma) / c.Td,
        rho,
    )


@observations(DriftLag)
def _observed(c: DriftLag, x: ComplexArray) -> tuple[complex, complex, complex, complex]:  # noqa: ARG001
    rho, nu, sigma = x[0], x[2], x[3]
    return rho, root(nu * nu - sigma * sigma), sigma, x[4]


@compiled
def _integrate(
    c: DriftLag, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


DRIFT_LAG = Model(
    "drift-lag", "slipstream with drift lag, a sided propeller and surge from sway", DriftLag,
    (
        *YAW, *SURGE,
        Parameter("c1", "1", -0.4), Parameter("c2", "1", 0.0, typical=0.3),
        Parameter("Td", "1", 0.3, 0.02, 5.0, prior_std=0.5),
        Parameter("e0", "1", 0.0, prior_std=0.1),
        Parameter("f1", "1", 0.5, prior_std=1.0),
        Parameter("f2", "1", 0.0, prior_std=1.0),
    ),
    (
        StateValue("rho", "yaw_rate"),
        StateValue("rho_dot", prior_std=0.5),
        StateValue("nu", "speed"),
        StateValue("sigma", "sway", prior_std=0.1),
        StateValue("psi", "heading"),
    ),
    _integrate, ("yaw_rate", "speed", "sway", "heading"),
)  # fmt: skip
