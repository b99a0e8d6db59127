"""Shaping filters of coloured noise, and a plant augmented by them.

Source: Sakharov, Shergina, Chertkov, eqs (14) to (19).
"""

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
    """A transfer function H(s) = numerator / denominator, in descending powers of s.

    Attributes
    ----------
    numerator
        (m + 1,).
    denominator
        (n + 1,), the first coefficient being one.
    """

    numerator: FloatArray
    denominator: FloatArray


@dataclass(frozen=True, eq=False)
class ShapedSystem:
    """The plant x' = A x + B u + G n, y = C x, augmented by the k states of a shaping filter.

    Attributes
    ----------
    A
        (n + k, n + k), 1/s; the states of the filter come last.
    B
        (n + k, inputs).
    C
        (m, n + k).
    G
        (n + k, noises): inputs of white noise, that of the shaping filter last.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    G: FloatArray


def spectral_factor(numerator: ArrayLike, denominator: ArrayLike) -> TransferFunction:
    """Compute the stable minimum-phase H with |H(jω)|² = numerator(ω) / denominator(ω).

    Where the spectrum touches zero, H has zeros on the imaginary axis.

    Convention: H shapes white noise of unit two-sided intensity, and the variance of its output is
    the integral of the spectrum over all ω, divided by 2π (`shaped_variance`). For Dryden's
    2 L σ² (1 + 3 L² ω²) / (1 + L² ω²)² this is 2σ², not σ².

    Parameters
    ----------
    numerator
        (2m + 1,): coefficients of descending powers of ω; those of odd powers are zero.
    denominator
        (2n + 1,): likewise.

    Raises
    ------
    UsageError
        The spectrum has odd powers, is negative somewhere, infinite at some ω, or grows towards
        high ω.

    References
    ----------
    Sakharov, Shergina, Chertkov, (14) to (16).

    Examples
    --------
    The spectrum 1 / (1 + ω²) belongs to H(s) = 1 / (s + 1):

    >>> spectral_factor([1.0], [1.0, 0.0, 1.0]).denominator.tolist()
    [1.0, 1.0]
    """
    top = _even("numerator", numerator)
    bottom = _even("denominator", denominator)
    if len(top) > len(bottom):
        raise UsageError(
            f"numerator is of degree {2 * len(top) - 2}; expected no more than the"
            f" denominator's {2 * len(bottom) - 2}: the spectrum would grow without end"
        )
    if top[0] * bottom[0] < 0:
        raise UsageError("numerator over denominator is negative at high ω; expected a spectrum")
    zeros, poles = _left_roots("numerator", top), _left_roots("denominator", bottom)
    if np.any(poles.real == 0):
        peak = np.abs(poles[poles.real == 0].imag)[0]
        raise UsageError(f"denominator is zero at ω = {peak:.4g}; expected a finite spectrum")
    gain = np.sqrt(top[0] / bottom[0])
    return TransferFunction(
        gain * np.atleast_1d(np.real(np.poly(zeros))), np.atleast_1d(np.real(np.poly(poles)))
    )


def _even(name: str, coefficients: ArrayLike) -> FloatArray:
    """Return the coefficients in ω² of an even polynomial in ω."""
    trimmed = np.trim_zeros(np.atleast_1d(as_finite_array(name, coefficients)), "f")
    if trimmed.ndim != 1 or not len(trimmed):
        raise UsageError(f"{name} is of shape {trimmed.shape}; expected coefficients, not all zero")
    if len(trimmed) % 2 == 0 or np.any(trimmed[1::2]):
        raise UsageError(f"{name}, {trimmed.shape}, has odd powers of ω; expected even ones alone")
    return trimmed[::2]


def _left_roots(name: str, coefficients: FloatArray) -> ComplexArray:
    """Compute the roots s = jω, not in the right half plane, of a polynomial in ω²: half of all."""
    squares = np.roots(coefficients).astype(complex)
    # two positive roots that agree up to rounding are a double root: the polynomial touches zero
    touching = (squares.real > 0) & (
        np.abs(squares.imag) <= DOUBLE_ROOT_TOLERANCE * np.abs(squares)
    )
    double = np.sort(squares[touching].real)
    upper, lower = double[1::2], double[::2]
    if len(double) % 2 or np.any(upper - lower > DOUBLE_ROOT_TOLERANCE * upper):
        raise UsageError(f"{name} changes sign near ω = {np.sqrt(double[0]):.4g}; expected none")
    axis = 1j * np.sqrt((upper + lower) / 2)
    left = -np.sqrt(-squares[~touching])
    left.real[squares[~touching] == 0] = 0.0
    return np.concatenate((left, axis, -axis))


def wave_filter(variance: float, frequency: float, damping: float = 0.1) -> TransferFunction:
    """Build the shaping filter of waves around one frequency: kw s / (s² + 2 ζ ω0 s + ω0²).

    The gain follows from the variance: kw² = 4 ζ ω0 variance.

    Parameters
    ----------
    variance
        Variance of the output, in squared units of the output.
    frequency
        ω0, rad/s.
    damping
        ζ.

    Raises
    ------
    UsageError
        Frequency or damping is not positive, or the variance is negative.

    Examples
    --------
    >>> round(shaped_variance(wave_filter(variance=4.0, frequency=0.8)), 6)
    4.0
    """
    variance = as_number("variance", variance)
    frequency = as_number("frequency", frequency, least=np.finfo(float).tiny)
    damping = as_number("damping", damping, least=np.finfo(float).tiny)
    kw = np.sqrt(4 * damping * frequency * variance)
    return TransferFunction(
        np.array([kw, 0.0]), np.array([1.0, 2 * damping * frequency, frequency**2])
    )


def shaped_variance(shaping: TransferFunction) -> float:
    """Compute the variance of the output of a filter driven by white noise of unit intensity.

    The intensity is two-sided. Raises `UsageError` where the variance is infinite: H is not stable
    or passes white noise directly.
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
    """Augment the plant x' = A x + B u, y = C x with a coloured disturbance w = H(s) n, n white.

    For several disturbances augment again, with the G of the result as `noise`.

    Parameters
    ----------
    A
        (n, n), 1/s.
    B
        (n, inputs).
    C
        (m, n).
    G
        Where w enters: as G w in x', G (n,) or (n, 1), or as G w in y, G (m,) or (m, 1).
    shaping
        H(s) with k poles.
    at
        "state" or "output". At the output the estimate of x is free of w, and the filter has a
        notch at the frequency of w.
    noise
        (n, q): where further white noise enters; none by default.

    Returns
    -------
    ShapedSystem
        n + k states, q + 1 noises.

    Raises
    ------
    UsageError
        The matrices do not fit; the filter is not stable or has more zeros than poles; or, at the
        output, it passes white noise directly, which belongs to R.

    References
    ----------
    Sakharov, Shergina, Chertkov, (17) to (19), with G0 Dw in the block of the noise.
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
    """Realise a transfer function: Aw (k, k), Bw (k, 1), Cw (1, k), Dw (1, 1), controller form."""
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
