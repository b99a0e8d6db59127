"""First-order Nomoto with quadratic damping of yaw, and surge.

    rho' = a rho + a2 rho|rho| + k delta
    nu'  = f rho^2 + g nu^2 + h eta

With the ship's length L and the approach speed U0, rho is the yaw rate times L/U0, nu the speed
over U0, eta the revolutions over those of the approach, and time is in L/U0.
"""

from typing import NamedTuple

from shiplog.compiled import compiled
from shiplog.ships import Model, Parameter, StateValue
from shiplog.ships.motion import (
    ComplexArray,
    Forcing,
    InputPath,
    equations,
    integrate,
    magnitude,
    observations,
)


class Quadratic(NamedTuple):
    """The coefficients of the equations."""

    a: complex
    a2: complex
    k: complex
    f: complex
    g: complex
    h: complex


@equations(Quadratic)
def _state_rates(c: Quadratic, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, nu = x[0], x[1]
    return (
        c.a * rho + c.a2 * rho * magnitude(rho) + c.k * u.delta,
        c.f * rho * rho + c.g * nu * nu + c.h * u.n,
        rho,
    )


@observations(Quadratic)
def _observed(c: Quadratic, x: ComplexArray) -> tuple[complex, complex, complex, complex]:
    return x[0], x[1], 0 * x[0], x[2]  # yaw rate, speed ahead, sway, heading


@compiled
def _integrate(
    c: Quadratic, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


QUADRATIC = Model(
    name="quadratic",
    title="first-order Nomoto with quadratic damping",
    kind=Quadratic,
    parameters=(
        Parameter("a", "1", start=-0.4),
        Parameter("a2", "1", start=-0.5, highest=0.0),
        Parameter("k", "1", start=0.3),
        Parameter("f", "1", start=-0.3),
        Parameter("g", "1", start=-0.05, highest=0.0),
        Parameter("h", "1", start=0.05),
    ),
    state=(
        StateValue("rho", "yaw_rate"),
        StateValue("nu", "speed"),
        StateValue("psi", "heading"),
    ),
    compiled=_integrate,
)
