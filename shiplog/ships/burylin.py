"""The identification paper's models: second-order nonlinear Nomoto with surge, free and tied.

    w'' = a w' + b1 w + b2 w|w| + b3 w^3 + ks (d delta + e delta')
    v'  = f w^2 + g v^2 + h n
    ks  = alpha1 v + alpha2 n exp(-alpha3 v)

in SI, n in rpm, as in `shiplog.ships.paper`. ``burylin`` has all coefficients as parameters, the
alphas fixed. ``burylin-tied`` ties them as the paper's derivation does, b1 = -d and e = T3 d, which
is singular for a ship at the margin of stability.
"""

from collections.abc import Sequence
from math import inf

from shiplog.compiled import compiled

from .model import Model, Parameter, StateValue
from .motion import (
    ComplexArray,
    Forcing,
    InputPath,
    equations,
    exponential,
    integrate,
    magnitude,
    observations,
)
from .paper import COEFFICIENT_UNITS, Coefficients


@equations(Coefficients)
def _motion(c: Coefficients, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    w, w_dot, v = x[0], x[1], x[2]
    ks = c.alpha1 * v + c.alpha2 * u.n * exponential(-c.alpha3 * v)
    hull = c.a * w_dot + c.b1 * w + c.b2 * w * magnitude(w) + c.b3 * w * w * w
    return (
        w_dot,
        hull + ks * (c.d * u.delta + c.e * u.delta_dot),
        c.f * w * w + c.g * v * v + c.h * u.n,
        w,
    )


@observations(Coefficients)
def _observed(c: Coefficients, x: ComplexArray) -> tuple[complex, complex, complex, complex]:  # noqa: ARG001
    return x[0], x[2], 0 * x[0], x[3]


@compiled
def _integrate(
    c: Coefficients, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


def _tied(values: ComplexArray) -> Sequence[complex]:
    a, b2, b3, d, t3, *others = values
    return (a, -d, b2, b3, d, t3 * d, *others)


def _parameter(
    name: str, start: float, highest: float = inf, *, fixed: bool = False, typical: float = 0.0
) -> Parameter:
    unit = COEFFICIENT_UNITS[name]
    return Parameter(name, unit, start, highest=highest, fixed=fixed, typical=typical)


_STATE = (
    StateValue("w", "yaw_rate"),
    StateValue("w_dot", prior_std=1e-3),
    StateValue("v", "speed"),
    StateValue("heading", "heading"),
)
# start values for a typical ship of 200 m
_A, _D = _parameter("a", -0.03), _parameter("d", 1.5e-4)
_NONLINEAR = (_parameter("b2", -0.05), _parameter("b3", 0.0, typical=5.0))
_OTHERS = (
    _parameter("f", -200.0),
    _parameter("g", -3e-4, highest=0.0),
    _parameter("h", 4e-4),
    _parameter("alpha1", 0.0171, fixed=True),
    _parameter("alpha2", 0.0015, fixed=True),
    _parameter("alpha3", 0.0654, fixed=True),
)
BURYLIN = Model(
    "burylin", "the paper's model", Coefficients,
    (_A, _parameter("b1", -1.5e-4), *_NONLINEAR, _D, _parameter("e", 1e-4), *_OTHERS),
    _STATE, _integrate, ("yaw_rate", "speed"), dimensionless=False,
)  # fmt: skip
BURYLIN_TIED = Model(
    "burylin-tied", "the paper's model, b1 = -d and e = T3 d", Coefficients,
    (_A, *_NONLINEAR, _D, Parameter("T3", "s", 1.0), *_OTHERS),
    _STATE, _integrate, ("yaw_rate", "speed"), dimensionless=False, expand=_tied,
)  # fmt: skip
