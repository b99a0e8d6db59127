"""Equations of motion in integral (weak) form: regression without differentiating noisy data.

Burylin's regression, his eq. (7), has w'' and v' on its left side, which no sensor measures. He
takes them from the Kalman filter, whose w'' and v' are those of its own model; the regression
therefore returns the coefficients assumed in the filter. Here each equation is multiplied by a
smooth test function phi, a bump that vanishes with its derivatives at its ends, and integrated by
parts. The derivatives move to phi:

    int phi'' w = -a int phi' w + b1 int phi w + b2 int phi w|w| + b3 int phi w^3
                  + d int phi ks delta + e int phi ks delta',
    -int phi' v = f int phi w^2 + g int phi v^2 + h int phi n,

with w the yaw rate (rad/s), v the speed (m/s), delta the rudder angle (rad), n the propeller
revolutions (rpm) and ks the rudder's effectiveness (`shiplog.ships.paper.rudder_effects`). Only
measured signals remain, and delta' from the measured rudder. One bump gives one row of a linear
regression.

References
----------
Ya. V. Burylin: see `shiplog.ships.paper` and ``examples/papers/continuous_identification.py``.
D. A. Messenger and D. M. Bortz, "Weak SINDy: Galerkin-based data-driven model selection",
Multiscale Modeling and Simulation 19, 2021: test functions (1 - s^2)^p for regression in weak form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.compiled import compiled
from shiplog.ships.paper import (
    PAPER_INPUTS,
    PAPER_OUTPUTS,
    SURGE_COEFFICIENTS,
    YAW_COEFFICIENTS,
    Coefficients,
    rudder_effects,
)
from shiplog.types import FloatArray, Signals

CHANNELS = (*PAPER_OUTPUTS, *PAPER_INPUTS)
BUMP_SECS = 60.0  # long relative to the noise, short relative to the ship's turning
STRIDE_SECS = 1.0  # from one bump to the next
MIN_RUDDER_RANGE = np.radians(2.0)  # a smaller range of the rudder does not determine yaw
MIN_RELATIVE_SPEED_RANGE = 0.02  # of the largest speed; a smaller one does not determine surge
BUMP_POWER = 4  # phi = (1 - s^2)^4: three derivatives vanish at the ends
SLIPSTREAM = "slipstream"  # a regressor: rudder times propeller revolutions
INTEGRAL_COUNT = 13  # per bump: target, excitation and regressors of yaw (8) and of surge (5)
YAW_INTEGRALS = 8


@dataclass(frozen=True)
class Equation:
    """Regressors and bumps of one equation of motion.

    Attributes
    ----------
    names
        The names of the p regressors: of their coefficients, `SLIPSTREAM` or ``constant``.
    stride_secs
        Time from the centre of one bump to the next, s.
    bump_secs
        Length of a bump, s.

    Examples
    --------
    >>> Equation(("f", "g", "h"), stride_secs=1.0, bump_secs=60.0).overlap
    60
    """

    names: tuple[str, ...]
    stride_secs: float
    bump_secs: float

    @property
    def overlap(self) -> int:
        """The number of successive rows that share data."""
        return max(1, int(self.bump_secs / self.stride_secs))

    def with_constant(self) -> "Equation":
        """Return the equation with one more regressor: a constant disturbance."""
        return replace(self, names=(*self.names, "constant"))

    def with_slipstream(self) -> "Equation":
        """Return the equation with one more regressor: a rudder in the propeller's slipstream."""
        return replace(self, names=(*self.names, SLIPSTREAM))


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one equation's regression; NaN where a bump overlaps a gap in the data.

    Attributes
    ----------
    equation
        The equation.
    centres_secs
        (m,) centres of the bumps, s since the signals' start.
    target
        (m,) left sides of the equation.
    regressors
        (m, p) integrals beside the coefficients.
    excitation
        (m,) mean of the quantity that must vary for the rows to determine the coefficients: the
        rudder angle (rad) for yaw, the speed (m/s) for surge.
    min_excitation
        The range of `excitation` below which rows determine nothing.
    """

    equation: Equation
    centres_secs: FloatArray
    target: FloatArray
    regressors: FloatArray
    excitation: FloatArray
    min_excitation: float

    def part(self, start: int, stop: int) -> "Rows":
        """Return the rows from `start` to before `stop`."""
        cut = slice(start, stop)
        return replace(
            self,
            centres_secs=self.centres_secs[cut],
            target=self.target[cut],
            regressors=self.regressors[cut],
            excitation=self.excitation[cut],
        )


def weak_form(signals: Signals, model: Coefficients) -> tuple[Rows, Rows]:
    """Compute the rows of the yaw and the surge equation of a whole trial.

    Parameters
    ----------
    signals
        The resampled signals `CHANNELS`; NaN where a channel was not measured, also in the rudder
        and the revolutions.
    model
        The ship model; only alpha1 to alpha3 are used, for the rudder's effectiveness.

    Returns
    -------
    yaw, surge
        The rows of both equations.

    Examples
    --------
    >>> import numpy as np
    >>> from shiplog import Signals, load_vessel
    >>> t = np.arange(0, 200, 0.1)
    >>> signals = Signals(0, 0.1, {
    ...     "yaw_rate": 0.01 * np.sin(t / 20), "speed": np.full(len(t), 7.0),
    ...     "rudder": 0.2 * np.cos(t / 20), "rpm": np.full(len(t), 96.0)})
    >>> yaw, surge = weak_form(signals, load_vessel("table1")[0].paper_coefficients)
    >>> yaw.equation.names, yaw.equation.bump_secs, yaw.regressors.shape
    (('a', 'b1', 'b2', 'b3', 'd', 'e'), 40.0, (160, 6))
    """
    steps = (np.diff(np.flatnonzero(np.isfinite(signals[name]))) for name in CHANNELS)
    intervals = [float(np.median(step)) if len(step) else 1.0 for step in steps]
    fastest = float(np.nanmax(np.abs(signals["speed"])))
    return WeakForm(model, len(signals), signals.dt_secs, intervals).step(signals, fastest)


class Bump(NamedTuple):
    """A test function and its derivatives, (2 half + 1,) each.

    Multiplied by the time step and of unit area, so that a sum over samples is an integral.
    """

    phi: FloatArray
    first: FloatArray
    second: FloatArray


class Integrands(NamedTuple):
    """The signals that are integrated, (n,) each; `ks` is the rudder's effectiveness."""

    w: FloatArray
    v: FloatArray
    delta: FloatArray
    n: FloatArray
    ks_delta: FloatArray
    ks_delta_dot: FloatArray


class WeakForm:
    """Stage that computes the rows of both equations from signals that come in chunks.

    The rows are the same to the last bit however the signals are divided into chunks.

    Parameters
    ----------
    model
        The ship model; only alpha1 to alpha3 are used.
    count
        The number of instants of the whole trial.
    dt
        The time step, s.
    intervals
        (4,) the typical number of instants from one sample of each of `CHANNELS` to the next.

    Attributes
    ----------
    yaw, surge
        The two equations. Of a trial shorter than five bumps, the bumps are shorter than
        `BUMP_SECS`.
    """

    def __init__(
        self, model: Coefficients, count: int, dt: float, intervals: Sequence[float]
    ) -> None:
        self._model, self._count, self._dt = model, count, dt
        longest = [gap_threshold_secs(interval * dt) / dt for interval in intervals]
        self._longest = dict(zip(CHANNELS, longest, strict=True))
        self._reach = int(max(self._longest.values())) + 2  # instants that a sample influences
        self._half = max(2, round(min(BUMP_SECS, count * dt / 5) / dt / 2))
        self._stride = max(1, round(STRIDE_SECS / dt))
        self._bump = _bump(self._half, dt)
        stride_secs, bump_secs = self._stride * dt, 2 * self._half * dt
        self.yaw = Equation(YAW_COEFFICIENTS, stride_secs, bump_secs)
        self.surge = Equation(SURGE_COEFFICIENTS, stride_secs, bump_secs)
        self._row, self._first = 0, 0  # the next row, and the first sample kept for it
        self._kept = {name: np.zeros(0) for name in CHANNELS}

    @property
    def row_count(self) -> int:
        """The number of rows of the whole trial."""
        return max(0, (self._count - self._width) // self._stride + 1)

    def step(self, chunk: Signals, fastest: float) -> tuple[Rows, Rows]:
        """Return the rows of yaw and surge whose data are complete with the next chunk.

        Parameters
        ----------
        chunk
            The next signals.
        fastest
            The largest speed of the trial so far, m/s, which scales the surge rows'
            `min_excitation`. Later stages use that of the last rows.
        """
        self._kept = {n: np.concatenate((kept, chunk[n])) for n, kept in self._kept.items()}
        end = self._first + len(self._kept["speed"])
        complete = end if end == self._count else end - self._reach
        until = max(self._row, (complete - self._width) // self._stride + 1)
        first = self._row
        sums = self._integrals(first * self._stride - self._first, until - first)
        self._row = until
        drop = max(until * self._stride - self._reach - self._first, 0)
        self._kept = {name: kept[drop:] for name, kept in self._kept.items()}
        self._first += drop
        centres = (self._half + self._stride * np.arange(first, until)) * self._dt
        yaw, surge = sums[:, :YAW_INTEGRALS], sums[:, YAW_INTEGRALS:]
        return (
            Rows(self.yaw, centres, yaw[:, 0], yaw[:, 2:], yaw[:, 1], MIN_RUDDER_RANGE),
            Rows(
                self.surge,
                centres,
                surge[:, 0],
                surge[:, 2:],
                surge[:, 1],
                MIN_RELATIVE_SPEED_RANGE * fastest,
            ),
        )

    @property
    def _width(self) -> int:
        """The number of samples of a bump."""
        return 2 * self._half + 1

    def _integrals(self, start: int, count: int) -> FloatArray:
        """Integrate over `count` bumps; the first starts at sample `start` of those kept."""
        if not count:
            return np.zeros((0, INTEGRAL_COUNT))
        w, v, delta, n = (_interpolate(self._kept[name], self._longest[name]) for name in CHANNELS)
        delta_dot = np.gradient(delta, self._dt)
        needed = slice(start, start + (count - 1) * self._stride + self._width)
        w, v, delta, delta_dot, n = (x[needed] for x in (w, v, delta, delta_dot, n))
        ks = rudder_effects(self._model, v, n)
        with np.errstate(invalid="ignore", over="ignore"):  # a model that diverges
            integrands = Integrands(w, v, delta, n, ks * delta, ks * delta_dot)
        return _integrate(integrands, self._bump, self._stride, count)


@compiled
def _integrate(signals: Integrands, bump: Bump, stride: int, count: int) -> FloatArray:
    """Integrate both equations over each of `count` bumps, `stride` samples apart.

    Returns (count, 13): target, excitation and regressors of yaw, then those of surge. NaN where a
    signal is NaN.
    """
    phi, first, second = bump.phi, bump.first, bump.second
    w, v, delta, n = signals.w, signals.v, signals.delta, signals.n
    rows = np.empty((count, INTEGRAL_COUNT))
    for k in range(count):
        yaw = mean_rudder = a = b1 = b2 = b3 = d = e = 0.0
        surge = mean_speed = f = g = h = 0.0
        for j in range(len(phi)):
            i = stride * k + j
            square = w[i] * w[i]
            yaw += second[j] * w[i]
            mean_rudder += phi[j] * delta[i]
            a -= first[j] * w[i]
            b1 += phi[j] * w[i]
            b2 += phi[j] * (w[i] * abs(w[i]))
            b3 += phi[j] * (square * w[i])
            d += phi[j] * signals.ks_delta[i]
            e += phi[j] * signals.ks_delta_dot[i]
            surge -= first[j] * v[i]
            mean_speed += phi[j] * v[i]
            f += phi[j] * square
            g += phi[j] * (v[i] * v[i])
            h += phi[j] * n[i]
        integrals = (yaw, mean_rudder, a, b1, b2, b3, d, e, surge, mean_speed, f, g, h)
        for c in range(INTEGRAL_COUNT):
            rows[k, c] = integrals[c]
    return rows


def with_constant(rows: Rows) -> Rows:
    """Return the rows with one more regressor: a constant disturbance."""
    ones = np.ones((len(rows.target), 1))
    regressors = np.hstack((rows.regressors, ones))
    return replace(rows, equation=rows.equation.with_constant(), regressors=regressors)


def with_slipstream(yaw: Rows, surge: Rows) -> Rows:
    """Return the yaw rows with one more regressor: rudder times propeller revolutions.

    Parameters
    ----------
    yaw
        The yaw rows, with a rudder effectiveness proportional to the speed, as in a first model.
    surge
        The surge rows of the same bumps, from which the mean speed and revolutions are taken.

    Returns
    -------
    rows
        Their last regressor is ``int phi ks delta / v_rms * n_mean``, an approximation of
        ``int phi n delta`` to a few per cent.
    """
    d, g, h = yaw.equation.names.index("d"), *map(surge.equation.names.index, ("g", "h"))
    speed, revolutions = np.sqrt(surge.regressors[:, g]), surge.regressors[:, h]
    with np.errstate(divide="ignore", invalid="ignore"):
        rudder = np.where(speed > 0, yaw.regressors[:, d] / speed, 0.0) * revolutions
    regressors = np.column_stack((yaw.regressors, rudder))
    return replace(yaw, equation=yaw.equation.with_slipstream(), regressors=regressors)


def _bump(half: int, dt: float) -> Bump:
    """Return the bump on ``2 half + 1`` samples with a time step `dt`."""
    s = np.arange(-half, half + 1) / half
    width = half * dt
    p, base = BUMP_POWER, 1 - s**2
    phi = base**p
    first = -2 * p * s * base ** (p - 1) / width
    second = (-2 * p * base ** (p - 1) + 4 * p * (p - 1) * s**2 * base ** (p - 2)) / width**2
    per_area = 1 / np.sum(phi)
    return Bump(phi * per_area, first * per_area, second * per_area)


def _interpolate(values: FloatArray, longest: float) -> FloatArray:
    """Interpolate a signal linearly between its samples, except in gaps.

    A gap is more than `longest` instants from one sample to the next; it stays NaN.
    """
    at = np.flatnonzero(np.isfinite(values))
    if len(at) == len(values):
        return values
    if len(at) < 2:
        return np.full(len(values), np.nan)
    filled = np.interp(np.arange(len(values)), at, values[at])
    for i in np.flatnonzero(np.diff(at) > longest):
        filled[at[i] + 1 : at[i + 1]] = np.nan
    filled[: at[0]] = np.nan
    filled[at[-1] + 1 :] = np.nan
    return filled
