"""Matrices of the ship's five-state model with pseudo-inputs."""

from math import exp

import numpy as np

from shiplog.ships.paper import Coefficients
from shiplog.types import FloatArray


def pseudo_input_matrices(c: Coefficients, side: float) -> tuple[FloatArray, FloatArray]:
    """Compute the matrices of the five-state model x' = A x + B u, with C = [e1, e4].

    x = (w, w', w'', v, v') with the yaw rate w and the speed v; u are the twenty pseudo-inputs of
    `pseudo_inputs`. These are Burylin's (5) without its misprints: u7 is v delta, u9 is n delta E,
    u19 contains n, w w' in the third row has the factor 2, and a twentieth input v' n delta E is
    added, without which A x + B u is not the derivative.

    Parameters
    ----------
    c
        Coefficients of the ship.
    side
        The sign of w, 1 or -1.

    Returns
    -------
    A
        (5, 5).
    B
        (5, 20).
    """
    A = np.zeros((5, 5))
    A[0, 1] = 1
    A[1, :2] = c.b1, c.a
    A[2, 1:3] = c.b1, c.a
    b4, b5, b6, b7 = c.alpha1 * c.d, c.alpha2 * c.d, c.alpha1 * c.e, c.alpha2 * c.e
    B = np.zeros((5, 20))
    B[1, [3, 4, 6, 7, 8, 9]] = c.b2 * side, c.b3, b4, b6, b5, b7
    B[2, [7, 9, 10, 11]] = b4, b5, b4, b5
    B[2, [13, 15, 16, 17]] = 2 * c.b2 * side, 3 * c.b3, b6, b7
    B[2, [18, 19]] = -c.alpha3 * b7, -c.alpha3 * b5
    B[3, [2, 3, 5]] = c.h, c.f, c.g
    B[4, [12, 13, 14]] = c.h, 2 * c.f, 2 * c.g
    return A, B


def printed_input_matrix(c: Coefficients) -> FloatArray:
    """Return B (5, 19) as printed in Burylin's (5) for w > 0, its short rows filled with zeros.

    For comparison with `pseudo_input_matrices`: with it A x + B u is not the derivative.
    """
    b4, b5, b6, b7 = c.alpha1 * c.d, c.alpha2 * c.d, c.alpha1 * c.e, c.alpha2 * c.e
    B = np.zeros((5, 19))
    B[1, [3, 4, 6, 7, 8, 9]] = c.b2, c.b3, b4, b6, b5, b7
    B[2, [6, 7, 8, 9, 10]] = b4, -b5 * c.alpha3, b5, b4, b5
    B[2, [12, 14, 15, 16, 17]] = c.b2, 3 * c.b3, b6, b7, -b7 * c.alpha3
    B[3, [2, 3, 5]] = c.h, c.f, c.g
    B[4, [10, 11, 12]] = c.h, 2 * c.f, 2 * c.g
    return B


def pseudo_inputs(
    x: FloatArray, delta: float, delta_dot: float, n: float, n_dot: float, alpha3: float
) -> FloatArray:
    """Compute the twenty pseudo-inputs u1 ... u20 of the five-state model.

    Parameters
    ----------
    x
        (5,): (w, w', w'', v, v').
    delta, delta_dot
        Rudder angle and its rate.
    n, n_dot
        Propeller speed and its rate.
    alpha3
        The coefficient in E = exp(-alpha3 v).

    Returns
    -------
    FloatArray
        (20,).
    """
    w, w_dot, _, v, v_dot = x
    E = exp(-v * alpha3)
    return np.array(
        [
            delta, delta_dot, n, w**2, w**3, v**2, v * delta, v * delta_dot, n * delta * E,
            n * delta_dot * E, v_dot * delta, n_dot * delta * E, n_dot, w * w_dot, v * v_dot,
            w**2 * w_dot, v_dot * delta_dot, n_dot * delta_dot * E, v_dot * n * delta_dot * E,
            v_dot * n * delta * E,
        ]
    )  # fmt: skip
