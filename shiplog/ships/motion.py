"""Integration of a ship model under recorded inputs: one compiled loop for all models.

A model registers its equations for its own type of coefficients (`equations`, `observations`). They
must hold for real numbers, with which a ship is simulated, and for complex ones: a derivative is
computed by the complex step, a tiny imaginary part of the parameter whose effect on the outputs is
taken from their imaginary parts. It is exact to rounding, has no step size to choose and needs no
derivation by hand. So the equations write |x| as `magnitude(x)`, e^x as `exponential(x)`, the
square root as `root(x)`, and powers as products: numba computes the power of a complex number by
its logarithm, which loses a tiny imaginary part.

References
----------
W. Squire and G. Trapp, "Using complex variables to estimate derivatives of real functions", SIAM
Review, 1998.
"""

from collections.abc import Callable
from math import exp, sqrt
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from shiplog.compiled import compiled_in_caller, copy_vector, element, overload_for
from shiplog.types import FloatArray

ComplexArray = NDArray[np.complex128]
DIVERGED = 1e6  # of a model's unit of yaw rate
F = TypeVar("F", bound=Callable[..., object])

MODEL_OUTPUTS = ("yaw_rate", "speed", "sway", "heading")  # the values of `observed`


class Forcing(NamedTuple):
    """The inputs of a ship at an instant, in the units of the equations.

    Attributes
    ----------
    delta, delta_dot
        The rudder in rad and its rate; real where the state is real.
    n
        The propeller's revolutions.
    """

    delta: complex
    delta_dot: complex
    n: float


class InputPath(NamedTuple):
    """The inputs of a run, in m steps on each of which the rudder moves at a constant rate.

    Attributes
    ----------
    secs
        (m,) the length of each step, s.
    delta, delta_dot
        (m,) the rudder at its start, rad, and its rate, rad/s.
    rpm
        (m,) the revolutions.
    sample
        (m,) the number of the sample at its end; -1 where it ends between samples.
    samples
        (m,) how many samples lie in it at equal intervals, the last at its end; 0 for none.
    """

    secs: FloatArray
    delta: FloatArray
    delta_dot: FloatArray
    rpm: FloatArray
    sample: NDArray[np.int64]
    samples: NDArray[np.int64]


def state_rates(c: Any, x: Any, u: Forcing) -> tuple[complex, ...]:  # noqa: ANN401
    """Compute the rates of the state `x` under the coefficients `c`: the model's equations.

    Compiled code calls the function that `equations` registered for the type of `c`.
    """
    raise NotImplementedError(f"no equations for {type(c).__name__}")


def observed(c: Any, x: Any) -> tuple[complex, complex, complex, complex]:  # noqa: ANN401
    """Compute the outputs of a state, in the order of `MODEL_OUTPUTS` and the equations' units.

    Compiled code calls the function that `observations` registered for the type of `c`.
    """
    raise NotImplementedError(f"no observations for {type(c).__name__}")


def equations(kind: type) -> Callable[[F], F]:
    """Register a function as `state_rates` for coefficients of the type `kind`."""
    return overload_for(state_rates, kind)


def observations(kind: type) -> Callable[[F], F]:
    """Register a function as `observed` for coefficients of the type `kind`."""
    return overload_for(observed, kind)


@compiled_in_caller
def magnitude(x: complex) -> complex:
    """Compute |x|; an imaginary part is carried as a derivative (so in the next two)."""
    return x if x.real >= 0 else -x


def exponential(x: complex) -> complex:
    """Compute e^x, at a fraction of the cost of the complex function."""
    return complex(exp(x.real), exp(x.real) * x.imag)


def root(x: complex) -> complex:
    """Compute the square root."""
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
    offset: ComplexArray,
    path: InputPath,
    samples: int,
) -> ComplexArray:
    """Integrate k runs under the same inputs and return their outputs at the samples.

    Each step of the path is one Runge-Kutta step of order four. Samples within a step are
    interpolated by Hermite's cubic, with the rates at its ends.

    Parameters
    ----------
    c
        The coefficients, a NamedTuple of a registered type, of (k,) complex arrays of one layout.
    x
        (k, s) the initial states in the units of the equations. They are overwritten by the states
        at the end, NaN where a run diverged.
    offset
        (k,) rudder added to that of the path, rad.
    path
        The inputs in the units of the equations.
    samples
        The number of samples, the first at the start.

    Returns
    -------
    (k, samples, 4) complex array
        The outputs in the order of `MODEL_OUTPUTS`; NaN from where a run diverges.
    """
    out = np.full((len(x), samples, 4), np.nan + 0j)
    for i in range(len(x)):
        _integrate_one(element(c, i), x[i], offset[i], path, out[i])
    return out


@compiled_in_caller
def _integrate_one(
    c: Any,  # noqa: ANN401
    x: ComplexArray,
    offset: complex,
    path: InputPath,
    out: ComplexArray,
) -> None:
    """Integrate one run and put its outputs, (samples, 4), into `out`."""
    between, after, at_sample = x.copy(), x.copy(), x.copy()
    _store(out, 0, observed(c, x))
    for k in range(len(path.secs)):
        h, rate, n = path.secs[k], path.delta_dot[k], path.rpm[k]
        delta = path.delta[k] + offset
        at_start = Forcing(delta, rate + 0j, n)
        halfway = Forcing(delta + rate * (h / 2), rate + 0j, n)
        at_end = Forcing(delta + rate * h, rate + 0j, n)
        copy_vector(after, x)
        leaving = state_rates(c, x, at_start)
        _add(after, x, leaving, h / 6, between, h / 2)
        _add(after, x, state_rates(c, between, halfway), h / 3, between, h / 2)
        _add(after, x, state_rates(c, between, halfway), h / 3, between, h)
        _add(after, x, state_rates(c, between, at_end), h / 6, between, 0.0)
        if not abs(after[0].real) < DIVERGED:  # NaN, too
            x[:] = np.nan
            break
        count = path.samples[k]
        if count > 1:
            arriving = state_rates(c, after, at_end)
            for j in range(1, count):
                _interpolate(at_sample, x, leaving, after, arriving, h, j / count)
                _store(out, path.sample[k] - count + j, observed(c, at_sample))
        copy_vector(x, after)
        if count > 0:
            _store(out, path.sample[k], observed(c, x))


# numba would make the real factor of a complex number complex, at twice the cost


@compiled_in_caller
def _add(
    after: ComplexArray,
    x: ComplexArray,
    rates: tuple[complex, ...],
    weight: float,
    between: ComplexArray,
    reach: float,
) -> None:
    """Add a stage's rates to the step, and put the state of the next stage into `between`."""
    for i in range(len(x)):
        real, imag = rates[i].real, rates[i].imag
        after[i] += complex(weight * real, weight * imag)
        between[i] = x[i] + complex(reach * real, reach * imag)


@compiled_in_caller
def _interpolate(
    at_sample: ComplexArray,
    x: ComplexArray,
    leaving: tuple[complex, ...],
    after: ComplexArray,
    arriving: tuple[complex, ...],
    h: float,
    s: float,
) -> None:
    """Put the state at the fraction s of a step into `at_sample`."""
    first, last = (1 + 2 * s) * (1 - s) ** 2, s * s * (3 - 2 * s)
    out, into = h * s * (1 - s) ** 2, h * s * s * (s - 1)
    for i in range(len(x)):
        a, b, f, g = x[i], after[i], leaving[i], arriving[i]
        at_sample[i] = complex(
            first * a.real + last * b.real + out * f.real + into * g.real,
            first * a.imag + last * b.imag + out * f.imag + into * g.imag,
        )


@compiled_in_caller
def _store(out: ComplexArray, k: int, values: tuple[complex, complex, complex, complex]) -> None:
    for i in range(4):
        out[k, i] = values[i]
