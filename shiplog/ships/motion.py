"""A ship's motion under a recorded rudder: one compiled loop for all models, with sensitivities.

A model states its equations for a type of its own (`equations`, `observations`), written so that
they hold for real numbers, with which a ship is sailed, and for complex ones too. A derivative is
then had by moving a parameter along the imaginary axis by next to nothing (Squire and Trapp, "Using
complex variables to estimate derivatives of real functions", 1998): exact to the last digit, with
no step to choose and nothing to derive by hand. So |x| is `magnitude(x)`, e^x `exponential(x)`, the
square root `root(x)`, and powers are products: numba's power of a complex number goes by its
logarithm, and loses what is next to nothing.
"""

from collections.abc import Callable
from math import exp, sqrt
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled_in_caller, overload_for
from shiplog.types import FloatArray

ComplexArray = NDArray[np.complex128]
F = TypeVar("F", bound=Callable[..., object])

MODEL_OUTPUTS = ("yaw_rate", "speed", "sway", "heading")  # what `observed` gives, in this order


class Forcing(NamedTuple):
    """What a ship is given at an instant."""

    delta: complex  # rad, as all here: real where the state is
    delta_dot: complex  # rad/s
    n: float  # rpm


class InputPath(NamedTuple):
    """What a ship is given over a run, in m steps on which the rudder moves evenly."""

    secs: FloatArray  # (m,) how long each is
    delta: FloatArray  # (m,) rad, as it begins
    delta_dot: FloatArray  # (m,) rad/s
    rpm: FloatArray  # (m,)
    sample: NDArray[np.int64]  # (m,) the number of the sample it ends at, -1 between samples
    samples: NDArray[np.int64]  # (m,) how many lie evenly within it, that one the last; or 0


def state_rates(c: Any, x: Any, u: Forcing) -> tuple[complex, ...]:  # noqa: ANN401
    """The rates of the state's values `x`, under the coefficients `c`: a model's equations."""
    raise NotImplementedError(f"no equations for {type(c).__name__}")


def observed(c: Any, x: Any) -> tuple[complex, complex, complex, complex]:  # noqa: ANN401
    """What would be measured in a state, in the order of `MODEL_OUTPUTS`."""
    raise NotImplementedError(f"no observations for {type(c).__name__}")


def equations(kind: type) -> Callable[[F], F]:
    """Make a function the `motion` of a model whose coefficients are a `kind`."""
    return overload_for(state_rates, kind)


def observations(kind: type) -> Callable[[F], F]:
    """Make a function what is `observed` of a model whose coefficients are a `kind`."""
    return overload_for(observed, kind)


@compiled_in_caller
def magnitude(x: complex) -> complex:
    """|x| of what is real but for a derivative along the imaginary axis."""
    return x if x.real >= 0 else -x


def exponential(x: complex) -> complex:
    """The same of e^x, at a fraction of the cost of a complex one."""
    return complex(exp(x.real), exp(x.real) * x.imag)


def root(x: complex) -> complex:
    """The same of the square root."""
    size = sqrt(x.real)
    return complex(size, x.imag / (2 * size))


overload_for(exponential, complex)(exponential)
overload_for(root, complex)(root)


@overload_for(exponential, float)
def _real_exponential(x: float) -> float:
    return exp(x)


@overload_for(root, float)
def _real_root(x: float) -> float:
    return sqrt(x)


@compiled_in_caller
def integrate(
    c: Any,  # noqa: ANN401
    x: ComplexArray,
    offset: complex,
    path: InputPath,
    samples: int,
) -> ComplexArray:
    """The outputs at so many samples, (samples, 4), of a run that begins in the state `x`.

    `x` is left where the run ends, NaN where it ran away. `offset` is added to the rudder. One
    Runge-Kutta step of order four for each step of the path; where there are samples between its
    ends, Hermite's cubic by the rates there. A run that leaves the numbers ends in NaN.
    """
    out = np.full((samples, 4), np.nan + 0j)
    between, after, at_sample = x.copy(), x.copy(), x.copy()
    _note(out, 0, observed(c, x))
    for k in range(len(path.secs)):
        h, rate, n = path.secs[k], path.delta_dot[k], path.rpm[k]
        delta = path.delta[k] + offset
        at_start = Forcing(delta, rate + 0j, n)
        halfway = Forcing(delta + rate * (h / 2), rate + 0j, n)
        at_end = Forcing(delta + rate * h, rate + 0j, n)
        after[:] = x
        leaving = state_rates(c, x, at_start)
        _add(after, x, leaving, h / 6, between, h / 2)
        _add(after, x, state_rates(c, between, halfway), h / 3, between, h / 2)
        _add(after, x, state_rates(c, between, halfway), h / 3, between, h)
        _add(after, x, state_rates(c, between, at_end), h / 6, between, 0.0)
        if not abs(after[0].real) < 1e6:  # it has run away; NaN too
            x[:] = np.nan
            break
        count = path.samples[k]
        if count > 1:
            arriving = state_rates(c, after, at_end)
            for j in range(1, count):
                _interpolate(at_sample, x, leaving, after, arriving, h, j / count)
                _note(out, path.sample[k] - count + j, observed(c, at_sample))
        x[:] = after
        if count > 0:
            _note(out, path.sample[k], observed(c, x))
    return out


# numba would take the real factor of a complex number for a complex one, at twice the cost


@compiled_in_caller
def _add(
    after: ComplexArray,
    x: ComplexArray,
    rates: tuple[complex, ...],
    weight: float,
    between: ComplexArray,
    reach: float,
) -> None:
    """One stage's rates: their share in the step, and where the next stage looks."""
    for i in range(len(x)):
        real, imag = rates[i].real, rates[i].imag
        after[i] += complex(weight * real, weight * imag)
        between[i] = x[i] + complex(reach * real, reach * imag)


@compiled_in_caller
def _interpolate(
    found: ComplexArray,
    x: ComplexArray,
    leaving: tuple[complex, ...],
    after: ComplexArray,
    arriving: tuple[complex, ...],
    h: float,
    s: float,
) -> None:
    """The state a share s of the way through a step."""
    first, last = (1 + 2 * s) * (1 - s) ** 2, s * s * (3 - 2 * s)
    out, into = h * s * (1 - s) ** 2, h * s * s * (s - 1)
    for i in range(len(x)):
        a, b, f, g = x[i], after[i], leaving[i], arriving[i]
        found[i] = complex(
            first * a.real + last * b.real + out * f.real + into * g.real,
            first * a.imag + last * b.imag + out * f.imag + into * g.imag,
        )


@compiled_in_caller
def _note(out: ComplexArray, k: int, values: tuple[complex, complex, complex, complex]) -> None:
    for i in range(4):
        out[k, i] = values[i]
