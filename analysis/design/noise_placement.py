"""Multi-level pole placement that uses what the poles leave free to keep the noise low.

With several measurements many gains place the same poles, and their errors differ by orders of
magnitude. The poles of Zubov et al. fix the spectra of Φ_k; the free numbers are chosen here.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_lyapunov
from scipy.optimize import minimize

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_symmetric_matrix
from .multilevel import Multilevel
from .placement import checked_poles, placements
from .riccati import kalman_gain

STARTS = 4  # of the search; the first is the gain of `place_multilevel`
MAX_ITERATIONS = 200  # of each search
GRADIENT_TOLERANCE = 1e-3  # of the logarithm of a variance
STEP = 1e-6  # of a central difference
ROUNDING = 1e-20  # of the sensors' noise: a smaller variance is zero
VARIANCE_FLOOR = 1e-8  # of the sensors' noise: an error that can be zero is no further reward

Objective = Callable[[FloatArray], tuple[float, FloatArray]]


@dataclass(frozen=True, eq=False)
class NoisePlacement:
    """A gain with given poles and low noise, and what the poles cost.

    Attributes
    ----------
    gain
        L, (n, m).
    covariance
        P, (n, n): the covariance of the error.
    kalman_ratio
        (n,): standard deviation of each state's error over that of the Kalman filter, which is free
        to choose its poles. Infinite where only the error of the Kalman filter is zero; NaN where
        both are, or where it has no steady state: no noise drives a mode that does not decay.
    """

    gain: FloatArray
    covariance: FloatArray
    kalman_ratio: FloatArray

    @property
    def summary(self) -> str:
        """The price of the poles in one line."""
        known = self.kalman_ratio[~np.isnan(self.kalman_ratio)]
        if not len(known):
            return "no price: the Kalman filter has no steady state, or no state has an error"
        least, most = known.min(), known.max()
        return f"errors {least:.3g} to {most:.3g} times those of the Kalman filter"


def place_for_noise(
    A: ArrayLike, C: ArrayLike, poles: ArrayLike, W: ArrayLike, R: ArrayLike
) -> NoisePlacement:
    """Compute the observer gain L that gives A - L C the poles and keeps the noise low.

    Among all gains of multi-level placement it is one with the least product of the variances of
    the states' errors, which does not depend on the units of the states. The search starts from
    several gains and is repeatable. With one measurement the poles determine the gain.

    Parameters
    ----------
    A
        (n, n), 1/s: x' = A x + white noise of intensity W.
    C
        (m, n): y = C x + white noise of intensity R.
    poles
        (n,), 1/s: with negative real parts; complex with their conjugates.
    W
        (n, n): intensity of the state noise; zeros for none.
    R
        (m, m): intensity of the measurement noise, positive definite. Samples `dt` seconds apart
        with noise of variance r have the intensity R = r dt.

    Raises
    ------
    UsageError
        W or R does not fit or is not definite, a pole is not stable, or as in `place_multilevel`.

    Examples
    --------
    Heading and rate of turn measured alike, the poles at -1 and -2 1/s:

    >>> A, C = [[0, 1], [0, 0]], np.eye(2)
    >>> placed = place_for_noise(A, C, [-1, -2], W=np.eye(2), R=np.eye(2))
    >>> placed.kalman_ratio.round(2).tolist()
    [1.06, 1.01]
    """
    gains = placements(A, C, poles)
    n, m = gains.A.shape[0], gains.C.shape[0]
    checked_poles("poles", poles, n, stable=True)
    W, R = as_symmetric_matrix("W", W, n), as_symmetric_matrix("R", R, m, definite="positive")
    scales = np.outer(gains.units, gains.units)
    system = _NoisySystem(gains.A, gains.C, W / scales / gains.rate, R * gains.rate)
    L = _least_noise(system, gains.levels)
    try:
        own = system.covariance(L)
    except RuntimeWarning as warning:
        raise UsageError(
            f"poles {gains.poles.shape}: the covariance of the errors is lost in rounding"
            f" ({warning}); with A {gains.A.shape} and C {gains.C.shape} a mode is almost"
            " unobservable: measure more states, or use a Kalman gain"
        ) from None
    exact = np.diag(own) < ROUNDING * np.diag(system.R).min()
    covariance = np.where(exact | exact[:, None], 0.0, scales * own)
    return NoisePlacement(gains.placed(L), covariance, _kalman_ratio(A, C, W, R, covariance))


class _NoisySystem(NamedTuple):
    """A pair with its noise, in the natural units of `Placements`."""

    A: FloatArray
    C: FloatArray
    W: FloatArray
    R: FloatArray

    def covariance(self, L: FloatArray) -> FloatArray:
        """Compute the covariance (n, n) of the errors of a gain L (n, m)."""
        return _lyapunov(self.A - L @ self.C, self.W + L @ self.R @ L.T)


def _least_noise(system: _NoisySystem, levels: Multilevel) -> FloatArray:
    """Search the gain (n, m) with the least noise."""
    count = levels.freedom
    if not count:
        return levels.gain(np.zeros(0))
    starts = [np.zeros(count), *np.random.default_rng(0).standard_normal((STARTS - 1, count))]
    searches = []
    for k, start in enumerate(starts):
        turned = levels.mirrored(k)
        objective = _objective(system, turned)
        result = minimize(
            objective,
            start,
            method="BFGS",
            jac=True,
            options={"maxiter": MAX_ITERATIONS, "gtol": GRADIENT_TOLERANCE},
        )
        searches.append((float(result.fun), k, turned.gain(result.x)))
    return min(searches)[2]


def _objective(system: _NoisySystem, levels: Multilevel) -> Objective:
    """Return the logarithm of the product of the variances and its gradient."""
    one = STEP * np.eye(levels.freedom)
    steps = np.vstack((np.zeros(levels.freedom), one, -one))
    floor = VARIANCE_FLOOR * np.diag(system.R).min()

    def objective(free: FloatArray) -> tuple[float, FloatArray]:
        L, *beside = levels.gain(free + steps)
        try:
            P = system.covariance(L)
            variances = np.diag(P) + floor
            S = _lyapunov((system.A - L @ system.C).T, np.diag(1 / variances))
        except RuntimeWarning:  # a gain so large that the poles are lost in rounding
            return np.inf, np.zeros_like(free)
        by_gain = 2 * S @ (L @ system.R - P @ system.C.T)
        ahead, behind = np.split(np.array(beside), 2)
        slopes = np.sum(by_gain * (ahead - behind), axis=(1, 2)) / (2 * STEP)
        return float(np.log(variances).sum()), slopes

    return objective


def _lyapunov(F: FloatArray, noise: FloatArray) -> FloatArray:
    """Solve F P + P F' + noise = 0 for P, all (n, n); raise `RuntimeWarning` where it is lost."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        P: FloatArray = solve_continuous_lyapunov(F, -noise)
    if np.diag(P).min() < 0:
        raise RuntimeWarning("a variance is negative")
    return P


def _kalman_ratio(
    A: ArrayLike, C: ArrayLike, W: FloatArray, R: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Compute σ of each state's error over that of the Kalman filter, (n,), from the covariance."""
    try:
        optimum = np.diag(kalman_gain(A, np.eye(len(W)), C, W, R).covariance)
    except UsageError:  # no steady state, as where no noise drives a constant
        return np.full(len(W), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.diag(covariance) / optimum)
