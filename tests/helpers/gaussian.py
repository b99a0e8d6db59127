"""Linear Gaussian models without a recursion: all states of a run at once, and what they cost."""

from dataclasses import dataclass, fields

import numpy as np
from scipy.linalg import expm
from scipy.stats import chi2


def held(A: np.ndarray, Q: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """exp(A dt), and the covariance of white noise of intensity Q after dt, by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    at = dt / 2 * (1 + nodes)
    terms = [w * expm(A * t) @ Q @ expm(A * t).T for w, t in zip(weights, at, strict=True)]
    return expm(A * dt), dt / 2 * np.sum(terms, axis=0)


@dataclass(frozen=True, eq=False)
class LinearRun:
    """x about its mean: x+ = F x + noise of Q, the first of covariance P; y = C x + noise of r."""

    mean: np.ndarray  # (n, s) of the states, if nothing is measured
    F: np.ndarray
    Q: np.ndarray
    P: np.ndarray
    C: np.ndarray  # (m, s)
    r: np.ndarray  # (m,) variances

    def covariance(self) -> np.ndarray:
        """(n s, n s) of all states of the run."""
        n, s = self.mean.shape
        whole, own = np.empty((n, s, n, s), self.P.dtype), self.P
        for i in range(n):
            later = own
            for j in range(i, n):
                whole[j, :, i], whole[i, :, j] = later, later.T
                later = self.F @ later
            own = self.F @ own @ self.F.T + self.Q
        return whole.reshape(n * s, n * s)

    def in_extended_precision(self) -> "LinearRun":
        """The same with numbers of more digits than a float's, as far as the processor has them."""
        return LinearRun(*(getattr(self, each.name).astype(np.longdouble) for each in fields(self)))

    def given(self, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States (n, s) and covariances (n, s, s), all that is not NaN in (n, 2) being known."""
        n, s = self.mean.shape
        prior = self.covariance()
        seen = np.isfinite(measured).ravel()
        H = np.kron(np.eye(n), self.C)[seen]
        S = H @ prior @ H.T + np.diag(np.tile(self.r, n)[seen])
        solve = np.linalg.solve if S.dtype == float else eliminated
        gain = solve(S, H @ prior).T
        deviation = measured.ravel()[seen] - H @ self.mean.ravel()
        states = self.mean + (gain @ deviation).reshape(n, s)
        blocks = (prior - gain @ (H @ prior)).reshape(n, s, n, s)
        return states, np.array([blocks[k, :, k] for k in range(n)])

    def filtered(self, measured: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `given`, each instant's by what was measured until then."""
        states, covariances = [], []
        for k in range(len(measured)):
            known = np.where(np.arange(len(measured))[:, None] <= k, measured, np.nan)
            x, P = self.given(known)
            states.append(x[k])
            covariances.append(P[k])
        return np.array(states), np.array(covariances)

    def drawn(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """True states (n, s) and what is measured of them, (n, m), at every instant."""
        n, s = self.mean.shape
        deviation = np.empty((n, s))
        deviation[0] = draws(rng, self.P, 1)[0]
        for k, noise in enumerate(draws(rng, self.Q, n - 1)):
            deviation[k + 1] = self.F @ deviation[k] + noise
        states = self.mean + deviation
        return states, states @ self.C.T + np.sqrt(self.r) * rng.standard_normal((n, len(self.r)))


def eliminated(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A⁻¹ B of a positive definite A, by Gauss's elimination in whatever precision they have."""
    A, B = A.copy(), B.copy()
    for i in range(len(A)):
        factors = A[i + 1 :, i] / A[i, i]
        A[i + 1 :] -= np.outer(factors, A[i])
        B[i + 1 :] -= np.outer(factors, B[i])
    for i in range(len(A) - 1, -1, -1):
        B[i] = (B[i] - A[i, i + 1 :] @ B[i + 1 :]) / A[i, i]
    return B


def draws(rng: np.random.Generator, covariance: np.ndarray, count: int) -> np.ndarray:
    """(count, s) of a covariance that may be singular."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return rng.standard_normal((count, len(root))) @ root.T


def normalised_squared(errors: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """e' P^-1 e of errors (..., s), the units being any."""
    scale = np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))
    P = covariances / (scale[..., :, None] * scale[..., None, :])
    e = errors / scale
    return np.einsum("...i,...i->...", e, np.linalg.solve(P, e[..., None])[..., 0])


def apart(
    result: tuple[np.ndarray, np.ndarray], expected: tuple[np.ndarray, np.ndarray]
) -> tuple[float, float]:
    """How far states and covariances are from those expected, in these' standard deviations."""
    (x, P), (states, covariances) = result, expected
    scale = np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))
    deviation = np.abs(P - covariances) / (scale[..., :, None] * scale[..., None, :])
    return float(np.max(np.abs(x - states) / scale)), float(np.max(deviation))


def band(count: int) -> tuple[float, float]:
    """Where 99 % of chi-squared numbers of that many degrees of freedom are."""
    low, high = chi2.ppf([0.005, 0.995], count)
    return float(low), float(high)
