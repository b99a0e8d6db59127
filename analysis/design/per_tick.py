"""Per-tick observer of a nonlinear model: poles placed anew at the start of every tick.

Source: Zubov, Mikrin, Oleinik, Ryabchenko, "Algorithms for the synthesis of linear observers for
nonlinear dynamic systems", (1.1) to (1.13). Its corrections ΔA* and ΔG* of the linearised model
vanish where a tick starts, and only there is the gain found: A is the Jacobian at the estimate.
Within a tick the model itself moves the estimate, not its linearisation, whose error would stay.
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

MAX_RATE_RATIO = 1e6  # a Jacobian that much faster than the poles asked for is at a singular point
MAX_JACOBIAN_ENTRY = 1e10  # an entry of a Jacobian that without a gain speaks of a singular point
SINGULAR_HINT = (
    "the model is singular there (Euler angles are where cos θ = 0): take other coordinates"
)


@dataclass(frozen=True, eq=False)
class TickObserver:
    """A strategy: what it carries from tick to tick is the estimate x̂ (n,) alone.

    x̂ = observer.init(guess, y), then x̂ = observer.step(x̂, y, u, tick_secs) for every tick.
    """

    rate: StateFunction  # f of x' = f(x, u), (n,)
    jacobian: StateFunction  # df/dx, (n, n)
    C: FloatArray  # (m, n): y = C x
    poles: ComplexArray  # 1/s: (n,) of full order, (n - m,) of reduced order
    reduced: bool

    def init(self, guess: ArrayLike, y: ArrayLike) -> FloatArray:
        """The first estimate (n,): the guess (n,), of reduced order with what y (m,) measures."""
        x = _vector("guess", guess, self.C.shape[1])
        y = _vector("y", y, len(self.C))
        return x + self.C.T @ (y - self.C @ x) if self.reduced else x

    def gain(self, x: FloatArray, u: ArrayLike = ()) -> FloatArray:
        """The gain of a tick that starts at x̂ (n,): L (n, m), of reduced order N (n - m, m).

        Raises `UsageError` where the model is singular or its linearisation is not observable.
        """
        A = self._linearised(x, _vector("u", u))
        try:
            if not self.reduced:
                return place_multilevel(A, self.C, self.poles)
            seen, hidden = self._parts()
            return place_multilevel(A[np.ix_(hidden, hidden)], A[np.ix_(seen, hidden)], self.poles)
        except UsageError as error:
            why = f"; {SINGULAR_HINT}" if np.abs(A).max() > MAX_JACOBIAN_ENTRY else ""
            raise UsageError(f"no gain at x̂ = {_format_vector(x)}: {error}{why}") from None

    def step(
        self, x: FloatArray, y: ArrayLike, u: ArrayLike = (), *, tick_secs: float
    ) -> FloatArray:
        """The estimate (n,) at the end of a tick from that at its start.

        `y` (2k + 1, m) is what was measured through the tick, evenly spaced, both ends counted: the
        ends and middles of k Runge-Kutta steps. `u` (r,) is held, or of the same instants (2k + 1,
        r). Full order: x̂' = f(x̂, u) + L (y - C x̂). Reduced order: what is measured is y, the
        rest z + N y with z' = f2 - N f1; z starts as ω̂ - N y, N being this tick's.

        Raises `UsageError` for measurements and inputs that do not fit, and what `gain` raises.
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
                f"the estimate is lost in the tick from x̂ = {_format_vector(x)}; {SINGULAR_HINT}"
            )
        return end

    def _linearised(self, x: FloatArray, u: FloatArray) -> FloatArray:
        n = self.C.shape[1]
        x = _vector("x", x, n)
        try:
            with np.errstate(all="ignore"):
                found = np.array(self.jacobian(x, u), dtype=np.float64)
        except ZeroDivisionError:
            found = np.full((n, n), np.nan)
        if not np.isfinite(found).all():
            raise UsageError(
                f"the Jacobian is not finite at x̂ = {_format_vector(x)}; {SINGULAR_HINT}"
            )
        A = as_square_matrix("jacobian", found, n)
        fastest = np.abs(np.linalg.eigvals(np.abs(A))).max()
        if fastest > MAX_RATE_RATIO * np.abs(self.poles).max():
            raise UsageError(
                f"the Jacobian has rates of {fastest:.1g} 1/s at x̂ = {_format_vector(x)};"
                f" {SINGULAR_HINT}"
            )
        return A

    def _parts(self) -> tuple[Indices, Indices]:
        """Which states are measured, and which are not, of reduced order."""
        return np.argmax(self.C, axis=1), np.flatnonzero(~self.C.any(axis=0))

    def _full_motion(self, L: FloatArray) -> "_Motion":
        def rate(x: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
            return self.rate(x, u) + L @ (y - self.C @ x)

        return _Motion(lambda x, _: x, rate, lambda x, _: x)

    def _reduced_motion(self, N: FloatArray) -> "_Motion":
        seen, hidden = self._parts()

        def estimate(z: FloatArray, y: FloatArray) -> FloatArray:
            x = np.empty(self.C.shape[1])
            x[seen], x[hidden] = y, z + N @ y
            return x

        def rate(z: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
            f = self.rate(estimate(z, y), u)
            moved: FloatArray = f[hidden] - N @ f[seen]
            return moved

        return _Motion(lambda x, y: x[hidden] - N @ y, rate, estimate)


class _Motion(NamedTuple):
    """How an observer's own state starts, moves with y and u, and what it says of x."""

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
    """The per-tick observer of x' = rate(x, u), y = C x, x (n,), u (r,).

    `jacobian` is d rate / dx, (n, n); C (m, n); poles in 1/s, as `place_multilevel` places them:
    (n,) of full order, (n - m,) of reduced order, where C must show single states, as they are.
    Where a frozen gain does, as on a ship, relinearising gains nothing. Raises `UsageError` for
    what does not fit. Source: Zubov et al., sections 1 and 2.
    """
    C = as_matrix("C", C)
    m, n = C.shape
    if order not in ("full", "reduced"):
        raise UsageError(f"order is {order!r}; expected full or reduced")
    if order == "reduced":
        single = np.all((C == 0) | (C == 1)) and np.all(C.sum(axis=1) == 1) and m < n
        if not single or C.sum(axis=0).max() > 1:
            raise UsageError(f"C, {C.shape}, mixes states; expected rows of the identity, fewer")
    wanted = checked_poles("poles", poles, n - m if order == "reduced" else n, stable=True)
    return TickObserver(rate, jacobian, C, wanted, order == "reduced")


class BlockGains(NamedTuple):
    """Both orders' gains where y is the first half of the state."""

    N: FloatArray  # (m, m): ω̂ = z + N y, of reduced order
    L1: FloatArray  # (m, m): of full order, on the measured half
    L2: FloatArray  # (m, m): on the other


def block_gains(A: ArrayLike, Phi0: ArrayLike, Phi1: ArrayLike) -> BlockGains:
    """The gains in closed form where y is the first half of x and A12 is invertible.

    A (2m, 2m); Phi0 and Phi1 (m, m) give A - [L1; L2] [I 0] their eigenvalues, and Phi1 its own to
    the error A22 - N A12 of reduced order. With z = ω̂ - N y, z must be set anew whenever N
    changes. Raises `UsageError` for matrices that do not fit and where A12 is singular. Source:
    the levels of `place_multilevel`, there being two.
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
    """A step of order four, h seconds; y and u (3, ...) are of its start, middle and end."""
    k1 = rate(x, y[0], u[0])
    k2 = rate(x + h / 2 * k1, y[1], u[1])
    k3 = rate(x + h / 2 * k2, y[1], u[1])
    k4 = rate(x + h * k3, y[2], u[2])
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _vector(name: str, values: ArrayLike, count: int | None = None) -> FloatArray:
    found = as_finite_array(name, values)
    if found.ndim != 1 or count not in (None, len(found)):
        expected = "a vector" if count is None else f"({count},)"
        raise UsageError(f"{name} is of shape {found.shape}; expected {expected}")
    return found


def _format_vector(x: FloatArray) -> str:
    return f"[{', '.join(f'{value:.4g}' for value in x)}]"
