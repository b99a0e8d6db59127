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

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import upfirdn

from shiplog.clock import longest_step_secs, usual_interval_secs
from shiplog.ship import Coefficients, rudder_effects
from shiplog.types import FloatArray, Signals

BUMP_SECS = 60.0  # long against the noise, short against the ship's turning
STRIDE_SECS = 1.0
LEAST_RUDDER = np.radians(2.0)  # a rudder that moves less tells nothing of yaw,
LEAST_SPEED = 0.02  # nor does a speed that changes by a smaller share of itself tell of surge
BUMP_POWER = 4  # (1 - s^2)^4: three derivatives vanish at the ends


@dataclass(frozen=True, eq=False)
class Rows:
    """One equation's regression, a row a bump; rows that touch a gap are NaN."""

    names: tuple[str, ...]
    centres_secs: FloatArray  # (m,) since the signals' start
    target: FloatArray  # (m,)
    regressors: FloatArray  # (m, p)
    stride_secs: float  # from one bump to the next
    bump_secs: float  # the length of one
    excitation: FloatArray  # (m,) what must move for the rows to tell anything
    least_excitation: float  # by how much, at the least

    @property
    def overlap(self) -> int:
        """How many rows on either side share a bump's data."""
        return max(1, int(self.bump_secs / self.stride_secs))


def weak_form(signals: Signals, model: Coefficients) -> tuple[Rows, Rows]:
    """The rows of the yaw and of the surge equation; of `model` only the alphas are used.

    `signals` must have NaN in `rudder` and `rpm` too where they were not measured.
    """
    dt = signals.dt_secs
    w, v, delta, n = (
        _bridged(signals[name], dt) for name in ("yaw_rate", "speed", "rudder", "rpm")
    )
    ks = rudder_effects(model, v, n)
    delta_dot = np.gradient(delta, dt)
    half = max(2, round(min(BUMP_SECS, len(signals) * dt / 5) / dt / 2))
    stride = max(1, round(STRIDE_SECS / dt))
    bump, slope, curvature = _bump(half, dt)

    def integral(values: FloatArray, weight: FloatArray) -> FloatArray:
        return _strided(values, weight * dt, stride)

    yaw = (
        ("a", -integral(w, slope)),
        ("b1", integral(w, bump)),
        ("b2", integral(w * np.abs(w), bump)),
        ("b3", integral(w**3, bump)),
        ("d", integral(ks * delta, bump)),
        ("e", integral(ks * delta_dot, bump)),
    )
    surge = (
        ("f", integral(w**2, bump)),
        ("g", integral(v**2, bump)),
        ("h", integral(n, bump)),
    )
    rows = []
    for columns, target, moved, least in (
        (yaw, integral(w, curvature), integral(delta, bump), LEAST_RUDDER),
        (surge, -integral(v, slope), integral(v, bump), LEAST_SPEED * float(np.nanmax(np.abs(v)))),
    ):
        names, values = zip(*columns, strict=True)
        centres = (half + stride * np.arange(len(target))) * dt
        regressors = np.column_stack(values)
        rows.append(
            Rows(names, centres, target, regressors, stride * dt, 2 * half * dt, moved, least)
        )
    return rows[0], rows[1]


def with_constant(rows: Rows) -> Rows:
    """The same with one more regressor: a disturbance that never changes."""
    ones = np.ones((len(rows.target), 1))
    return replace(
        rows, names=(*rows.names, "constant"), regressors=np.hstack((rows.regressors, ones))
    )


def _bump(half: int, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """phi, phi' and phi'' on 2 half + 1 samples, of unit area."""
    s = np.arange(-half, half + 1) / half
    width = half * dt
    p, base = BUMP_POWER, 1 - s**2
    phi = base**p
    first = -2 * p * s * base ** (p - 1) / width
    second = (-2 * p * base ** (p - 1) + 4 * p * (p - 1) * s**2 * base ** (p - 2)) / width**2
    area = np.sum(phi) * dt
    return phi / area, first / area, second / area


def _strided(values: FloatArray, weight: FloatArray, stride: int) -> FloatArray:
    """sum_j weight[j] values[k + j] at every `stride`-th k, NaN where any of them is."""
    known = np.isfinite(values)
    count = max(0, (len(values) - len(weight)) // stride + 1)
    start = len(weight) - 1  # of what does not reach beyond the ends

    def filtered(x: FloatArray, h: FloatArray) -> FloatArray:
        lead = -start % stride  # so that a multiple of the stride falls on `start`
        padded = np.concatenate((np.zeros(lead), x))
        out = np.asarray(upfirdn(h[::-1], padded, down=stride))
        first = (start + lead) // stride
        return out[first : first + count]

    sums = filtered(np.where(known, values, 0.0), weight)
    if known.all():
        return sums
    missing = filtered(1.0 - known, np.ones(len(weight)))
    return np.where(missing > 0.5, np.nan, sums)


def _bridged(values: FloatArray, dt: float) -> FloatArray:
    """The signal with the instants between a sensor's samples filled in, its gaps left open."""
    at = np.flatnonzero(np.isfinite(values))
    if len(at) < 2:
        return np.full(len(values), np.nan)
    longest = longest_step_secs(usual_interval_secs(values, dt)) / dt
    filled = np.interp(np.arange(len(values)), at, values[at])
    for i in np.flatnonzero(np.diff(at) > longest):
        filled[at[i] + 1 : at[i + 1]] = np.nan
    filled[: at[0]] = np.nan
    filled[at[-1] + 1 :] = np.nan
    return filled
