"""Per-tick observer of a nonlinear model: poles placed anew at the start of every tick.

A tick is one period of the observer. Source: Zubov, Mikrin, Oleinik, Ryabchenko, "Algorithms for
the synthesis of linear observers for nonlinear dynamic systems", (1.1) to (1.13). The corrections
ΔA* and ΔG* of the linearised model vanish at the start of a tick, and only there is the gain
computed: A is the Jacobian at the estimate. Within a tick the estimate is propagated by the
nonlinear model, not by its linearisation, whose error would remain.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shiplog.errors import UsageError
from shiplog.types import FloatArray

from .matrices import as_finite_array, as_matrix, as_number, as_square_matrix
from .observability import ComplexArray
from .placement import checked_poles, place_multilevel

Indices = NDArray[np.intp]
# a function of the state (n,) and the inputs (r,)
StateFunction = Callable[[FloatArray, FloatArray], FloatArray]

MAX_RATE_RATIO = 1e6  # a Jacobian this much faster than the poles is near a singular point
MAX_JACOBIAN_ENTRY = 1e10  # without a gain, a larger entry indicates a singular point
SINGULAR_HINT = (
    "the model is singular there (Euler angles are where cos θ = 0): use other coordinates"
)


@dataclass(frozen=True, eq=False)
class TickObserver:
    """A per-tick observer; its only state from tick to tick is the estimate x̂ (n,).

    x̂ = observer.init(guess, y), then x̂ = observer.step(x̂, y, u, tick_secs=...) for every tick.

    Attributes
    ----------
    rate
        f of x' = f(x, u): a function of x (n,) and u (r,) that returns (n,).
    jacobian
        ∂f/∂x at x and u: (n, n), 1/s.
    C
        (m, n): y = C x.
    poles
        1/s: (n,) for full order, (n - m,) for reduced order.
    reduced
        Whether only the unmeasured states are estimated.
    """

    rate: StateFunction
    jacobian: StateFunction
    C: FloatArray
    poles: ComplexArray
    reduced: bool

    def init(self, guess: ArrayLike, y: ArrayLike) -> FloatArray:
        """Return the first estimate (n,).

        Parameters
        ----------
        guess
            (n,).
        y
            (m,): the measurement; it replaces the measured states of a reduced-order observer.
        """
        x = _vector("guess", guess, self.C.shape[1])
        y = _vector("y", y, len(self.C))
        return x + self.C.T @ (y - self.C @ x) if self.reduced else x

    def gain(self, x: FloatArray, u: ArrayLike = ()) -> FloatArray:
        """Compute the gain of a tick that starts at the estimate x (n,) with the inputs u (r,).

        Returns
        -------
        FloatArray
            L (n, m), or N (n - m, m) for reduced order.

        Raises
        ------
        UsageError
            The model is singular at x, or its linearisation is not observable.
        """
        A = self._linearised(x, _vector("u", u))
        try:
            if not self.reduced:
                return place_multilevel(A, self.C, self.poles)
            measured, others = self._parts()
            A22, A12 = A[np.ix_(others, others)], A[np.ix_(measured, others)]
            return place_multilevel(A22, A12, self.poles)
        except UsageError as error:
            hint = f"; {SINGULAR_HINT}" if np.abs(A).max() > MAX_JACOBIAN_ENTRY else ""
            raise UsageError(f"no gain at x̂ = {_format_vector(x)}: {error}{hint}") from None

    def step(
        self, x: FloatArray, y: ArrayLike, u: ArrayLike = (), *, tick_secs: float
    ) -> FloatArray:
        """Propagate the estimate over one tick.

        Full order: x̂' = f(x̂, u) + L (y - C x̂). Reduced order: the measured states are y, the
        others z + N y with z' = f2 - N f1; z starts at ω̂ - N y, ω̂ being the estimate of the
        unmeasured states and N the gain of this tick.

        Parameters
        ----------
        x
            (n,): the estimate at the start of the tick.
        y
            (2k + 1, m): evenly spaced measurements of the tick, both ends included: the ends and
            midpoints of k Runge-Kutta steps.
        u
            (r,): inputs held over the tick, or (2k + 1, r) at the instants of y.
        tick_secs
            Duration of the tick, s.

        Returns
        -------
        FloatArray
            (n,): the estimate at the end of the tick.

        Raises
        ------
        UsageError
            Measurements or inputs do not fit, the estimate diverges, or as in `gain`.
        """
        y = as_matrix("y", y, columns=len(self.C))
        count = len(y)
        if count < 3 or count % 2 == 0:
            raise UsageError(f"y is of shape {y.shape}; expected an odd number of rows, at least 3")
        u = as_finite_array("u", u)
        u = np.outer(np.ones(count), u) if u.ndim == 1 else as_matrix("u", u, rows=count)
        h = 2 * as_number("tick_secs", tick_secs) / (count - 1)
        gain = self.gain(x, u[0])
        motion = self._reduced_motion(gain) if self.reduced else self._full_motion(gain)
        with np.errstate(all="ignore"):
            state = motion.start(x, y[0])
            for k in range(0, count - 1, 2):
                state = _runge_kutta(motion.rate, state, y[k : k + 3], u[k : k + 3], h)
            end = motion.estimate(state, y[-1])
        if not np.isfinite(end).all():
            raise UsageError(
                f"the estimate diverges in the tick from x̂ = {_format_vector(x)}; {SINGULAR_HINT}"
            )
        return end

    def _linearised(self, x: FloatArray, u: FloatArray) -> FloatArray:
        """Return the Jacobian (n, n) at x; raise if not finite or far faster than the poles."""
        n = self.C.shape[1]
        x = _vector("x", x, n)
        try:
            with np.errstate(all="ignore"):
                values = np.array(self.jacobian(x, u), dtype=np.float64)
        except ZeroDivisionError:
            values = np.full((n, n), np.nan)
        if not np.isfinite(values).all():
            raise UsageError(
                f"the Jacobian is not finite at x̂ = {_format_vector(x)}; {SINGULAR_HINT}"
            )
        A = as_square_matrix("jacobian", values, n)
        fastest = np.abs(np.linalg.eigvals(np.abs(A))).max()
        if fastest > MAX_RATE_RATIO * np.abs(self.poles).max():
            raise UsageError(
                f"the Jacobian has rates of {fastest:.1g} 1/s at x̂ = {_format_vector(x)};"
                f" {SINGULAR_HINT}"
            )
        return A

    def _parts(self) -> tuple[Indices, Indices]:
        """Return the indices of the measured and of the unmeasured states (reduced order)."""
        return np.argmax(self.C, axis=1), np.flatnonzero(~self.C.any(axis=0))

    def _full_motion(self, L: FloatArray) -> "_Motion":
        """Return the dynamics of the full-order observer with the gain L (n, m)."""

        def rate(x: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
            return self.rate(x, u) + L @ (y - self.C @ x)

        return _Motion(lambda x, _: x, rate, lambda x, _: x)

    def _reduced_motion(self, N: FloatArray) -> "_Motion":
        """Return the dynamics of the reduced-order observer with the gain N (n - m, m)."""
        measured, others = self._parts()

        def estimate(z: FloatArray, y: FloatArray) -> FloatArray:
            x = np.empty(self.C.shape[1])
            x[measured], x[others] = y, z + N @ y
            return x

        def rate(z: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
            f = self.rate(estimate(z, y), u)
            z_dot: FloatArray = f[others] - N @ f[measured]
            return z_dot

        return _Motion(lambda x, y: x[others] - N @ y, rate, estimate)


class _Motion(NamedTuple):
    """The dynamics of an observer's own state.

    Attributes
    ----------
    start
        The state at the start of a tick, from x̂ and y.
    rate
        The rate of change of the state, from the state, y and u.
    estimate
        x̂, from the state and y.
    """

    start: Callable[[FloatArray, FloatArray], FloatArray]
    rate: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    estimate: Callable[[FloatArray, FloatArray], FloatArray]


def tick_observer(
    rate: StateFunction,
    jacobian: StateFunction,
    C: ArrayLike,
    poles: ArrayLike,
    *,
    order: Literal["full", "reduced"] = "full",
) -> TickObserver:
    """Build the per-tick observer of x' = rate(x, u), y = C x, with x (n,) and u (r,).

    It gains nothing where the gain hardly depends on the state, as for a ship: a constant gain is
    as good there. Where several measurements leave the gain free, it is that of `place_multilevel`,
    not the one of the least noise, whose search takes too long for each tick.

    Parameters
    ----------
    rate
        f(x, u), (n,).
    jacobian
        ∂f/∂x at (x, u): (n, n), 1/s.
    C
        (m, n); for reduced order its rows are rows of the identity, fewer than n.
    poles
        1/s, placed as by `place_multilevel`: (n,) for full order, (n - m,) for reduced order.
    order
        "full" estimates all states, "reduced" only those that are not measured.

    Raises
    ------
    UsageError
        Matrices, poles or the order do not fit.

    References
    ----------
    Zubov et al., sections 1 and 2.

    Examples
    --------
    A pendulum x = (angle, rate) whose angle is measured; the gain depends on the angle:

    >>> rate = lambda x, u: np.array([x[1], -np.sin(x[0])])
    >>> jacobian = lambda x, u: np.array([[0.0, 1.0], [-np.cos(x[0]), 0.0]])
    >>> observer = tick_observer(rate, jacobian, [[1.0, 0.0]], [-1.0, -1.0])
    >>> observer.gain(np.array([np.pi / 3, 0.0])).round(6).tolist()
    [[2.0], [0.5]]
    """
    C = as_matrix("C", C)
    m, n = C.shape
    if order not in ("full", "reduced"):
        raise UsageError(f"order is {order!r}; expected full or reduced")
    if order == "reduced":
        single = np.all((C == 0) | (C == 1)) and np.all(C.sum(axis=1) == 1) and m < n
        if not single or C.sum(axis=0).max() > 1:
            raise UsageError(f"C, {C.shape}, mixes states; expected some rows of the identity")
    requested = checked_poles("poles", poles, n - m if order == "reduced" else n, stable=True)
    return TickObserver(rate, jacobian, C, requested, order == "reduced")


class BlockGains(NamedTuple):
    """The gains of both orders where y is the first half of the state.

    Attributes
    ----------
    N
        (m, m): reduced order, ω̂ = z + N y.
    L1
        (m, m): full order, for the measured half.
    L2
        (m, m): full order, for the unmeasured half.
    """

    N: FloatArray
    L1: FloatArray
    L2: FloatArray


def block_gains(A: ArrayLike, Phi0: ArrayLike, Phi1: ArrayLike) -> BlockGains:
    """Compute the gains in closed form where y is the first half of x and A12 is invertible.

    A - [L1; L2] [I 0] has the eigenvalues of Phi0 and Phi1, and A22 - N A12, the error dynamics of
    reduced order, those of Phi1. With z = ω̂ - N y, z must be reset whenever N changes.

    Parameters
    ----------
    A
        (2m, 2m), 1/s.
    Phi0, Phi1
        (m, m), 1/s.

    Raises
    ------
    UsageError
        The matrices do not fit, or A12 is singular.

    References
    ----------
    The levels of `place_multilevel`, of which there are two.

    Examples
    --------
    A double integrator with both poles at -1 1/s:

    >>> gains = block_gains([[0, 1], [0, 0]], [[-1]], [[-1]])
    >>> float(gains.N[0, 0]), float(gains.L1[0, 0]), float(gains.L2[0, 0])
    (1.0, 2.0, 1.0)
    """
    A, Phi0 = as_square_matrix("A", A), as_square_matrix("Phi0", Phi0)
    m = len(Phi0)
    A, Phi1 = as_square_matrix("A", A, 2 * m), as_square_matrix("Phi1", Phi1, m)
    A11, A12, A21, A22 = A[:m, :m], A[:m, m:], A[m:, :m], A[m:, m:]
    if np.linalg.cond(A12) > 1 / np.finfo(float).eps:
        raise UsageError(f"A12, {A12.shape}, of A {A.shape} is singular; {SINGULAR_HINT}")
    inverse = np.linalg.inv(A12)
    N = A22 @ inverse - inverse @ Phi1.T
    return BlockGains(N, A11 + A12 @ N - Phi0.T, A21 + A22 @ N - N @ Phi0.T)


def _runge_kutta(
    rate: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    x: FloatArray,
    y: FloatArray,
    u: FloatArray,
    h: float,
) -> FloatArray:
    """Integrate one Runge-Kutta step of order four and h seconds.

    y and u (3, ...) are those at its start, middle and end.
    """
    k1 = rate(x, y[0], u[0])
    k2 = rate(x + h / 2 * k1, y[1], u[1])
    k3 = rate(x + h / 2 * k2, y[1], u[1])
    k4 = rate(x + h * k3, y[2], u[2])
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _vector(name: str, values: ArrayLike, size: int | None = None) -> FloatArray:
    """Convert `values` to a vector of finite numbers, (size,); `None` accepts any size."""
    vector = as_finite_array(name, values)
    if vector.ndim != 1 or size not in (None, len(vector)):
        expected = "a vector" if size is None else f"({size},)"
        raise UsageError(f"{name} is of shape {vector.shape}; expected {expected}")
    return vector


def _format_vector(x: FloatArray) -> str:
    """Format a vector for a message."""
    return f"[{', '.join(f'{value:.4g}' for value in x)}]"
