"""The model's equations in integral form: coefficients from data without differentiating noise.

Burylin's regression, eq. (7), has w'' and v' on its left side, which no sensor measures. He takes
them from the filter, whose w'' and v' are copies of the model it was given, and so finds that
model again. Here each equation is multiplied by a smooth bump phi that vanishes at its ends, and
integrated by parts: the derivatives go over to phi,

    int phi'' w = -a int phi' w + b1 int phi w + b2 int phi w|w| + b3 int phi w^3
                  + d int phi ks delta + e int phi ks delta',
    -int phi' v = f int phi w^2 + g int phi v^2 + h int phi n,

and only what was measured remains. One bump gives one row of a linear regression.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
BUMP_SECS = 60.0  # long against the noise, short against the ship's turning
STRIDE_SECS = 1.0
MIN_RUDDER_RANGE = np.radians(2.0)  # a rudder that moves less tells nothing of yaw,
MIN_RELATIVE_SPEED_RANGE = (
    0.02  # nor does a speed that changes by a smaller share of itself tell of surge
)
SLIPSTREAM = "slipstream"  # a regressor: what the rudder does in the propeller's race
BUMP_POWER = 4  # (1 - s^2)^4: three derivatives vanish at the ends


@dataclass(frozen=True)
class Equation:
    """What a regression's rows have in common, a row a bump."""

    names: tuple[str, ...]  # of the p regressors
    stride_secs: float  # from one bump to the next
    bump_secs: float  # the length of one

    @property
    def overlap(self) -> int:
        """How many rows on either side share a bump's data."""
        return max(1, int(self.bump_secs / self.stride_secs))

    def with_constant(self) -> "Equation":
        """The same with one more regressor: a disturbance that never changes."""
        return replace(self, names=(*self.names, "constant"))

    def with_slipstream(self) -> "Equation":
        """The same with one more regressor, for a rudder of which nothing is known."""
        return replace(self, names=(*self.names, SLIPSTREAM))


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of one equation's regression; those that touch a gap are NaN."""

    equation: Equation
    centres_secs: FloatArray  # (m,) since the signals' start
    target: FloatArray  # (m,)
    regressors: FloatArray  # (m, p)
    excitation: FloatArray  # (m,) what must move for the rows to tell anything
    min_excitation: float  # by how much, at the least

    def part(self, start: int, stop: int) -> "Rows":
        """The rows from `start` to before `stop`."""
        cut = slice(start, stop)
        return replace(
            self,
            centres_secs=self.centres_secs[cut],
            target=self.target[cut],
            regressors=self.regressors[cut],
            excitation=self.excitation[cut],
        )


def weak_form(signals: Signals, model: Coefficients) -> tuple[Rows, Rows]:
    """The rows of the yaw and of the surge equation of signals that are all there.

    Of `model` only the alphas are used. `signals` must have NaN in `rudder` and `rpm` too where
    they were not measured.
    """
    steps = (np.diff(np.flatnonzero(np.isfinite(signals[name]))) for name in CHANNELS)
    usual = [float(np.median(step)) if len(step) else 1.0 for step in steps]
    fastest = float(np.nanmax(np.abs(signals["speed"])))
    return WeakForm(model, len(signals), signals.dt_secs, usual).step(signals, fastest)


class WeakForm:
    """Makes rows of signals that come in chunks, `count` instants in all.

    `intervals` (4,) are the usual numbers of instants from one sample of `CHANNELS` to the next.
    """

    def __init__(
        self, model: Coefficients, count: int, dt: float, intervals: Sequence[float]
    ) -> None:
        self._model, self._count, self._dt = model, count, dt
        longest = [gap_threshold_secs(interval * dt) / dt for interval in intervals]
        self._longest = dict(zip(CHANNELS, longest, strict=True))
        self._reach = int(max(self._longest.values())) + 2  # over which a sample has influence
        self._half = max(2, round(min(BUMP_SECS, count * dt / 5) / dt / 2))
        self._stride = max(1, round(STRIDE_SECS / dt))
        self._bump = _bump(self._half, dt)
        stride_secs, bump_secs = self._stride * dt, 2 * self._half * dt
        self.yaw = Equation(YAW_COEFFICIENTS, stride_secs, bump_secs)
        self.surge = Equation(SURGE_COEFFICIENTS, stride_secs, bump_secs)
        self._row, self._first = 0, 0  # the next row, and the first sample that is kept for it
        self._kept = {name: np.zeros(0) for name in CHANNELS}

    @property
    def row_count(self) -> int:
        """How many rows there will be in all."""
        return max(0, (self._count - self._width) // self._stride + 1)

    def step(self, chunk: Signals, fastest: float) -> tuple[Rows, Rows]:
        """The rows of yaw and of surge that the next chunk makes possible.

        `fastest` is the greatest speed of the trial, m/s, as far as it is known: what is judged by
        it is judged by that of the last rows.
        """
        self._kept = {n: np.concatenate((kept, chunk[n])) for n, kept in self._kept.items()}
        end = self._first + len(self._kept["speed"])
        settled = end if end == self._count else end - self._reach
        until = max(self._row, (settled - self._width) // self._stride + 1)
        first = self._row
        sums = self._integrals(first * self._stride - self._first, until - first)
        self._row = until
        drop = max(until * self._stride - self._reach - self._first, 0)
        self._kept = {name: kept[drop:] for name, kept in self._kept.items()}
        self._first += drop
        centres = (self._half + self._stride * np.arange(first, until)) * self._dt
        yaw, surge = sums[:, :8], sums[:, 8:]  # each: target, excitation, regressors
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
        return 2 * self._half + 1

    def _integrals(self, start: int, count: int) -> FloatArray:
        """The integrals of `_integrated` over `count` bumps, the first from sample `start` on."""
        if not count:
            return np.zeros((0, 13))
        w, v, delta, n = (_bridged(self._kept[name], self._longest[name]) for name in CHANNELS)
        delta_dot = np.gradient(delta, self._dt)
        needed = slice(start, start + (count - 1) * self._stride + self._width)
        w, v, delta, delta_dot, n = (x[needed] for x in (w, v, delta, delta_dot, n))
        ks = rudder_effects(self._model, v, n)
        with np.errstate(invalid="ignore", over="ignore"):  # a model that runs away
            steering, steering_rate = ks * delta, ks * delta_dot
        return _integrated(
            w, v, delta, n, steering, steering_rate, *self._bump, self._stride, count
        )


@compiled
def _integrated(
    w: FloatArray,
    v: FloatArray,
    delta: FloatArray,
    n: FloatArray,
    steering: FloatArray,
    steering_rate: FloatArray,
    phi: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
    stride: int,
    count: int,
) -> FloatArray:
    """The two equations' integrals over each bump, (count, 13): targets, excitation, regressors.

    NaN where anything integrated is.
    """
    rows = np.empty((count, 13))
    for k in range(count):
        yaw = yaw_moved = a = b1 = b2 = b3 = d = e = 0.0
        surge = surge_moved = f = g = h = 0.0
        for j in range(len(phi)):
            i = stride * k + j
            square = w[i] * w[i]
            yaw += curvature[j] * w[i]
            yaw_moved += phi[j] * delta[i]
            a -= slope[j] * w[i]
            b1 += phi[j] * w[i]
            b2 += phi[j] * (w[i] * abs(w[i]))
            b3 += phi[j] * (square * w[i])
            d += phi[j] * steering[i]
            e += phi[j] * steering_rate[i]
            surge -= slope[j] * v[i]
            surge_moved += phi[j] * v[i]
            f += phi[j] * square
            g += phi[j] * (v[i] * v[i])
            h += phi[j] * n[i]
        rows[k] = (yaw, yaw_moved, a, b1, b2, b3, d, e, surge, surge_moved, f, g, h)
    return rows


def with_constant(rows: Rows) -> Rows:
    """The same with one more regressor: a disturbance that never changes."""
    ones = np.ones((len(rows.target), 1))
    regressors = np.hstack((rows.regressors, ones))
    return replace(rows, equation=rows.equation.with_constant(), regressors=regressors)


def with_slipstream(yaw: Rows, surge: Rows) -> Rows:
    """The rows of yaw with one more regressor: the rudder in proportion to the revolutions.

    `yaw` takes it in proportion to the speed alone, as a first model does; `surge` knows both.
    """
    d, g, h = yaw.equation.names.index("d"), *map(surge.equation.names.index, ("g", "h"))
    speed, revolutions = np.sqrt(surge.regressors[:, g]), surge.regressors[:, h]
    with np.errstate(divide="ignore", invalid="ignore"):
        rudder = np.where(speed > 0, yaw.regressors[:, d] / speed, 0.0) * revolutions
    regressors = np.column_stack((yaw.regressors, rudder))
    return replace(yaw, equation=yaw.equation.with_slipstream(), regressors=regressors)


def _bump(half: int, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """phi, phi' and phi'' on 2 half + 1 samples, of unit area; times dt, to sum as an integral."""
    s = np.arange(-half, half + 1) / half
    width = half * dt
    p, base = BUMP_POWER, 1 - s**2
    phi = base**p
    first = -2 * p * s * base ** (p - 1) / width
    second = (-2 * p * base ** (p - 1) + 4 * p * (p - 1) * s**2 * base ** (p - 2)) / width**2
    per_area = 1 / np.sum(phi)
    return phi * per_area, first * per_area, second * per_area


def _bridged(values: FloatArray, longest: float) -> FloatArray:
    """The signal with the instants between a sensor's samples filled in, its gaps left open.

    A gap is more than `longest` instants from sample to sample.
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
