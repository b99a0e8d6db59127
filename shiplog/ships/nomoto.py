"""Nomoto's first-order model and Norrbin's cubic one, each with a surge equation beside it.

    rho' = a rho + a3 rho^3 + k delta          (Nomoto: a3 = 0)
    nu'  = f rho^2 + g nu^2 + h eta

With L the ship's length and U0 the approach speed, rho is the yaw rate times L/U0, nu the speed
over U0, eta the revolutions over those of the approach, time is in L/U0. a and k replace Nomoto's
T = -1/a and K = -k/a, which are infinite for a ship at the margin of stability, where full-form
tankers are.

References
----------
K. Nomoto and others, "On the steering qualities of ships", 1957.

N. H. Norrbin, "Theory and observations on the use of a mathematical model for ship manoeuvring in
deep and confined waters", 1971.
"""

from collections.abc import Sequence
from typing import NamedTuple

from shiplog.compiled import compiled

from .model import Model, Parameter, StateValue
from .motion import ComplexArray, Forcing, InputPath, equations, integrate, observations


class Norrbin(NamedTuple):
    """The coefficients of the equations, dimensionless.

    Attributes
    ----------
    a
        Linear damping of the yaw rate; negative for a course-stable ship.
    a3
        Cubic damping of the yaw rate; zero in Nomoto's model.
    k
        The yaw acceleration by the rudder.
    f
        The loss of speed in a turn.
    g
        The resistance.
    h
        The thrust.
    """

    a: complex
    a3: complex
    k: complex
    f: complex
    g: complex
    h: complex


@equations(Norrbin)
def _motion(c: Norrbin, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, nu = x[0], x[1]
    return (
        c.a * rho + c.a3 * rho * rho * rho + c.k * u.delta,
        c.f * rho * rho + c.g * nu * nu + c.h * u.n,
        rho,
    )


@observations(Norrbin)
def _observed(c: Norrbin, x: ComplexArray) -> tuple[complex, complex, complex, complex]:  # noqa: ARG001
    return x[0], x[1], 0 * x[0], x[2]


@compiled
def _integrate(
    c: Norrbin, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


def _without_cube(values: ComplexArray) -> Sequence[complex]:
    return (values[0], 0j, *values[1:])


_STATE = (
    StateValue("rho", "yaw_rate"),
    StateValue("nu", "speed"),
    StateValue("psi", "heading"),
)
_A, _K = Parameter("a", "1", -0.4), Parameter("k", "1", 0.3)
_SURGE = (
    Parameter("f", "1", -0.3),
    Parameter("g", "1", -0.05, highest=0.0),
    Parameter("h", "1", 0.05),
)
NOMOTO = Model(
    "nomoto", "first-order Nomoto with surge", Norrbin, (_A, _K, *_SURGE), _STATE, _integrate,
    expand=_without_cube,
)  # fmt: skip
NORRBIN = Model(
    "norrbin", "Norrbin's cubic with surge", Norrbin,
    (_A, Parameter("a3", "1", -0.5, highest=0.0), _K, *_SURGE), _STATE, _integrate,
)  # fmt: skip
