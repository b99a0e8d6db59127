"""Shaping filters of coloured noise, and a plant augmented by them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, solve_continuous_lyapunov

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_finite_array, as_matrix, as_number, as_square_matrix
from .observability import ComplexArray

DOUBLE_ROOT_TOLERANCE = 1e-6  # relative distance of the two computed parts of a double root


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """H(s) = numerator / denominator: coefficients of descending powers of s."""

    numerator: FloatArray  # (m + 1,)
    denominator: FloatArray  # (n + 1,), the first being 1


@dataclass(frozen=True, eq=False)
class ShapedSystem:
    """x' = A x + B u + G n, y = C x, the shaping filter's k states being the last of x."""

    A: FloatArray  # (n + k, n + k)
    B: FloatArray  # (n + k, inputs)
    C: FloatArray  # (m, n + k)
    G: FloatArray  # (n + k, noises), the shaped one being the last


def spectral_factor(numerator: ArrayLike, denominator: ArrayLike) -> TransferFunction:
    """The stable minimum-phase H with |H(jω)|² = numerator(ω) / denominator(ω).

    Both are coefficients of descending powers of ω, (2m + 1,) and (2n + 1,), those of odd powers
    being zero. Where the spectrum touches zero H has zeros on the imaginary axis.

    Convention: H shapes white noise of unit two-sided intensity, and the variance of what comes
    out is the integral of the spectrum over all ω, divided by 2π (`shaped_variance`). For Dryden's
    2 L σ² (1 + 3 L² ω²) / (1 + L² ω²)² that is 2σ², not σ².

    Raises `UsageError` for a spectrum that is odd, negative somewhere, infinite at some ω, or
    that does not fall towards high ω. Source: Sakharov, Shergina, Chertkov, (14) to (16).
    """
    above = _even("numerator", numerator)
    below = _even("denominator", denominator)
    if len(above) > len(below):
        raise UsageError(
            f"numerator is of degree {2 * len(above) - 2}; expected no more than the"
            f" denominator's {2 * len(below) - 2}: the spectrum would grow without end"
        )
    if above[0] * below[0] < 0:
        raise UsageError("numerator over denominator is negative at high ω; expected a spectrum")
    zeros, poles = _left_roots("numerator", above), _left_roots("denominator", below)
    if np.any(poles.real == 0):
        peak = np.abs(poles[poles.real == 0].imag)[0]
        raise UsageError(f"denominator is zero at ω = {peak:.4g}; expected a finite spectrum")
    gain = np.sqrt(above[0] / below[0])
    return TransferFunction(
        gain * np.atleast_1d(np.real(np.poly(zeros))), np.atleast_1d(np.real(np.poly(poles)))
    )


def _even(name: str, coefficients: ArrayLike) -> FloatArray:
    """The coefficients in ω² of an even polynomial in ω."""
    found = np.trim_zeros(np.atleast_1d(as_finite_array(name, coefficients)), "f")
    if found.ndim != 1 or not len(found):
        raise UsageError(f"{name} is of shape {found.shape}; expected coefficients, not all zero")
    if len(found) % 2 == 0 or np.any(found[1::2]):
        raise UsageError(f"{name}, {found.shape}, has odd powers of ω; expected even ones alone")
    return found[::2]


def _left_roots(name: str, coefficients: FloatArray) -> ComplexArray:
    """The roots s = jω, none in the right half plane, of a polynomial in ω²; half of all."""
    squares = np.roots(coefficients).astype(complex)
    # roots within rounding of ω² > 0 are a double one each two: the polynomial touches zero there
    touching = (squares.real > 0) & (
        np.abs(squares.imag) <= DOUBLE_ROOT_TOLERANCE * np.abs(squares)
    )
    at = np.sort(squares[touching].real)
    if len(at) % 2 or np.any(at[1::2] - at[::2] > DOUBLE_ROOT_TOLERANCE * at[1::2]):
        raise UsageError(f"{name} changes sign near ω = {np.sqrt(at[0]):.4g}; expected none")
    axis = 1j * np.sqrt((at[1::2] + at[::2]) / 2)
    left = -np.sqrt(-squares[~touching])
    left.real[squares[~touching] == 0] = 0.0
    return np.concatenate((left, axis, -axis))


def wave_filter(variance: float, frequency: float, damping: float = 0.1) -> TransferFunction:
    """Waves about one frequency: kw s / (s² + 2 ζ ω0 s + ω0²), kw² = 4 ζ ω0 variance.

    `variance` is that of what comes out, `frequency` ω0 in rad/s. Raises `UsageError` unless
    frequency and damping are positive and the variance is not negative.
    """
    variance = as_number("variance", variance)
    frequency = as_number("frequency", frequency, least=np.finfo(float).tiny)
    damping = as_number("damping", damping, least=np.finfo(float).tiny)
    kw = np.sqrt(4 * damping * frequency * variance)
    return TransferFunction(
        np.array([kw, 0.0]), np.array([1.0, 2 * damping * frequency, frequency**2])
    )


def shaped_variance(shaping: TransferFunction) -> float:
    """The variance of white noise of unit two-sided intensity behind the shaping filter.

    Raises `UsageError` where it is infinite: H is not stable or passes white noise itself.
    """
    A, B, C, D = _realised(shaping)
    if D.any():
        raise UsageError("the shaping filter passes white noise; expected a strictly proper one")
    return float((C @ solve_continuous_lyapunov(A, -B @ B.T) @ C.T)[0, 0])


def augment_with_shaping(
    A: ArrayLike,
    B: ArrayLike,
    C: ArrayLike,
    G: ArrayLike,
    shaping: TransferFunction,
    *,
    at: Literal["state", "output"] = "state",
    noise: ArrayLike | None = None,
) -> ShapedSystem:
    """The plant x' = A x + B u, y = C x with a coloured disturbance w = H(s) n, n being white.

    A (n, n), B (n, inputs), C (m, n). At the state w enters as G w, G (n,) or (n, 1); at the
    output as y = C x + G w, G (m,) or (m, 1): what is then estimated of x is free of it, and the
    filter has a notch at its frequency. `noise` (n, q) is where white noise enters besides. For
    several disturbances augment again, `noise` being the G found so far.

    Raises `UsageError` for matrices that do not fit, a filter that is not stable or has more
    zeros than poles, and at the output one that passes white noise itself: that belongs to R.
    Source: Sakharov, Shergina, Chertkov, (17) to (19), with G0 Dw in the noise's block.
    """
    A = as_square_matrix("A", A)
    n = len(A)
    B, C = as_matrix("B", B, rows=n), as_matrix("C", C, columns=n)
    rows = n if at == "state" else len(C)
    G = as_finite_array("G", G)
    G = as_matrix("G", G[:, None] if G.ndim == 1 else G, rows, 1)
    white = np.zeros((n, 0)) if noise is None else as_matrix("noise", noise, rows=n)
    Aw, Bw, Cw, Dw = _realised(shaping)
    if at == "output" and Dw.any():
        raise UsageError("the shaping filter passes white noise to the output; give that to R")
    k = len(Aw)
    into_state, into_output = (G, np.zeros((len(C), 1))) if at == "state" else (np.zeros((n, 1)), G)
    return ShapedSystem(
        np.block([[A, into_state @ Cw], [np.zeros((k, n)), Aw]]),
        np.vstack((B, np.zeros((k, B.shape[1])))),
        np.hstack((C, into_output @ Cw)),
        np.hstack((block_diag(white, np.zeros((k, 0))), np.vstack((into_state @ Dw, Bw)))),
    )


def _realised(shaping: TransferFunction) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Aw (k, k), Bw (k, 1), Cw (1, k), Dw (1, 1) in controller form."""
    numerator = np.trim_zeros(np.atleast_1d(as_finite_array("numerator", shaping.numerator)), "f")
    denominator = np.trim_zeros(
        np.atleast_1d(as_finite_array("denominator", shaping.denominator)), "f"
    )
    if len(denominator) < 2 or len(numerator) > len(denominator):
        raise UsageError(
            f"the shaping filter has the degrees {len(numerator) - 1} over {len(denominator) - 1};"
            " expected no more zeros than poles, and a pole"
        )
    poles = np.roots(denominator)
    if poles.real.max() >= 0:
        raise UsageError(
            f"the shaping filter has a pole at {poles[np.argmax(poles.real)]:.4g}; expected a"
            " stable one"
        )
    from scipy.signal import tf2ss  # noqa: PLC0415 - scipy.signal takes long to import

    Aw, Bw, Cw, Dw = tf2ss(numerator if len(numerator) else [0.0], denominator)
    return Aw, Bw, Cw, Dw
