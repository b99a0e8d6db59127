"""The time a fit takes, beside the same fit by `solve_ivp` and finite differences."""

from collections.abc import Callable
from statistics import median

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from analysis.identification.fit.initial_guess import initial_guesses
from analysis.identification.fit.least_squares import OUTLIER_STDS
from analysis.identification.fit.output_error import (
    OutputError,
    fit_problem,
    initial_residual_stds,
    make_problem,
    output_error,
)
from analysis.identification.fit.problem import Nuisance
from analysis.identification.fit.segment import Segment
from shiplog.ships import ship_model
from shiplog.types import FloatArray

from .measure import timed

ROUNDS = 3
ASKED = 50.0  # times as fast
SECONDS, HOUR = 500.0, 3600.0
TOLERANCE, DIFFERENCE = 1e-7, (1e-4,)  # tighter costs more, looser drowns the differences
LONGEST_STEP = 2.0  # s, that the peer does not step over a rudder's kink


def speed(sail: Callable[[float, str], Segment]) -> None:
    """Print the section; `sail` gives a trial of so many seconds under a noise of that name."""
    short, long, white = sail(SECONDS, "paper"), sail(HOUR, "paper"), sail(SECONDS, "white")
    ours = _ours(white)
    theirs = peer(white, ours)
    apart = np.abs(theirs - ours.minimum.unknowns[: len(theirs)]) / _stds(ours)
    pairs = [
        (timed(lambda: _ours(white))(), timed(lambda: peer(white, ours))()) for _ in range(ROUNDS)
    ]
    whole = median(timed(lambda: output_error([short], ship_model("burylin")))() for _ in range(5))
    hour = median(timed(lambda: output_error([long], ship_model("burylin")))() for _ in range(3))
    ratio = median(theirs / ours for ours, theirs in pairs)
    print(
        f"""
## How fast

Wall time on one core, machine code ready, a 20/20 zig-zag; the first two lines under the paper's
noise, with its wave, the third under white noise. The peer is the same fit, without wave, rudder's
zero and biases on either side: `scipy.optimize.least_squares` with finite differences over
`solve_ivp`, from the same start, with the weights and the loss of ours, which are given to it; ours
finds them as well. Both find the same, to {100 * float(np.max(apart)):.0f} % of a standard \
deviation at the worst.

| work | takes | goal | |
|---|---|---|---|
| 500 s at 10 Hz, the paper's model | {whole:.2f} s | < 1 s | {_met(whole < 1)} |
| an hour at 10 Hz | {hour:.2f} s | < 10 s | {_met(hour < 10)} |
| 500 s, against `solve_ivp` and finite differences, {median(p for _, p in pairs):.0f} s | \
{ratio:.0f} times as fast | ≥ {ASKED:.0f} | {_met(ratio >= ASKED)} |"""
    )


def _met(met: bool) -> str:
    return "met" if met else "**missed**"


def _ours(trial: Segment) -> OutputError:
    return fit_problem(
        make_problem([trial], ship_model("burylin"), nuisance=Nuisance.none()), waves=False
    )


def _stds(ours: OutputError) -> FloatArray:
    count = len(ours.problem.free) + 3
    return np.sqrt(np.diag(np.linalg.inv(ours.minimum.information[:count, :count])))


def peer(trial: Segment, ours: OutputError) -> FloatArray:
    """The nine coefficients and the first three states, found the straightforward way."""
    problem, dt = ours.problem, trial.dt_secs
    delta, rpm = trial.signals["rudder"], trial.signals["rpm"]
    slope = np.append(np.diff(delta), 0.0) / dt
    time, alphas = trial.signals.time_secs - trial.signals.time_secs[0], problem.values[9:]
    weights = 1 / ours.residual_stds[0].effective
    start = initial_guesses(problem, initial_residual_stds(problem))[0][:12]  # as ours begins
    known = np.isfinite(problem.measured(0))

    def simulated(z: FloatArray) -> FloatArray:
        a, b1, b2, b3, d, e, f, g, h = z[:9]

        def rates(t: float, x: FloatArray) -> list[float]:
            k = min(int(t / dt), len(delta) - 1)
            w, w_dot, v = x
            ks = alphas[0] * v + alphas[1] * rpm[k] * np.exp(-alphas[2] * v)
            rudder = delta[k] + slope[k] * (t - k * dt)
            hull = a * w_dot + b1 * w + b2 * w * abs(w) + b3 * w**3
            return [
                w_dot, hull + ks * (d * rudder + e * slope[k]), f * w * w + g * v * v + h * rpm[k]
            ]  # fmt: skip

        found = solve_ivp(
            rates, (0.0, time[-1]), z[9:12], t_eval=time, rtol=TOLERANCE, atol=1e-10,
            max_step=LONGEST_STEP,
        )  # fmt: skip
        return np.column_stack((found.y[0], found.y[2]))

    def off(z: FloatArray) -> FloatArray:
        return ((problem.measured(0) - simulated(z)) * weights)[known]

    solved = least_squares(
        off,
        start,
        x_scale=_stds(ours),
        loss="soft_l1",
        f_scale=OUTLIER_STDS,
        diff_step=DIFFERENCE * 12,
    )
    return np.asarray(solved.x)
