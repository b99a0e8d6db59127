"""Current, and the systematic errors of log and compass, from straight runs and full turns.

On a straight run the velocity over the ground is R(ψ)·(u, v) + c; the positions of a long turn show
the current without a log (`turn_current`). All equations are solved together by least squares,
with the assumed sizes of the systematic errors as prior knowledge.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from shiplog.types import FloatArray

from .found_manoeuvre import FoundManoeuvre
from .sailed_manoeuvre import ManoeuvreKind
from .trial_signals import TrialSignals
from .turn_current import POSITION_DRIFT, current_in_turn

APPROACH_SECS = 60.0  # before an execute
MIN_STRAIGHT_SECS = 15.0
MAX_STRAIGHT_YAW = radians(6.0)  # range of the heading on a stretch that counts as straight
MAX_MEAN_DRIFT = 0.004  # of the speed: sway of a ship that is steered straight
BLOCK_SECS, MAX_BLOCK_YAW = 30.0, radians(10.0)  # of a log with a measured sway
WIDE_CURRENT_STD = 1.5  # m/s, before any equation


@dataclass(frozen=True, eq=False)
class VelocityErrors:
    """Current and systematic errors of a trial, with their joint covariance.

    Attributes
    ----------
    mean
        (4,) current north and east, m/s; scale error of the log; bias of the compass, rad. True
        speed is the measured one over 1 + scale, true heading the measured one less the bias.
    covariance
        (4, 4) of these.
    method
        How the current was found; empty where nothing determines it.
    """

    mean: FloatArray
    covariance: FloatArray
    method: str

    @property
    def current(self) -> FloatArray:
        """North and east, (2,) m/s."""
        return self.mean[:2]


@dataclass(frozen=True)
class AssumedErrors:
    """Assumed standard deviations, as in `analysis.trial.trial_options.TrialOptions`."""

    compass_bias_std: float = radians(0.5)
    speed_scale_std: float = 0.02
    current_std: float = 0.25


@dataclass(frozen=True, eq=False)
class _Equation:
    """Rows of an equation in the four unknowns, with the standard deviations of its values."""

    matrix: FloatArray
    values: FloatArray
    stds: FloatArray


def velocity_errors(
    signals: TrialSignals, found: Sequence[FoundManoeuvre], assumed: AssumedErrors
) -> VelocityErrors:
    """Estimate current, scale of the log and bias of the compass.

    Parameters
    ----------
    signals
        Without NaN where measured.
    found
        The manoeuvres.
    assumed
        Standard deviations before the trial.
    """
    straight: list[_Equation] = []
    turns: list[_Equation] = []
    if signals.has("positions") and signals.has("heading"):
        turns = [each for one in found for each in _turn_equations(signals, one)]
        if signals.has("speed"):
            straight = list(_straight_equations(signals, found))
    informed = bool(straight or turns)
    prior = np.array([
        *([WIDE_CURRENT_STD if informed else assumed.current_std] * 2),
        assumed.speed_scale_std, assumed.compass_bias_std,
    ])  # fmt: skip
    information, vector = np.diag(prior**-2), np.zeros(4)
    for each in (*straight, *turns):
        weighted = each.matrix / each.stds[:, None] ** 2
        information = information + each.matrix.T @ weighted
        vector = vector + weighted.T @ each.values
    covariance = np.linalg.inv(information)
    sources = [
        f"{len(turns)} turn{'s' * (len(turns) > 1)} of more than 540°" * bool(turns),
        f"ground and water speed on {len(straight)} straight stretch{'es' * (len(straight) > 1)}"
        * bool(straight),
    ]
    return VelocityErrors(covariance @ vector, covariance, " and ".join(filter(None, sources)))


def _straight_equations(
    signals: TrialSignals, found: Sequence[FoundManoeuvre]
) -> Iterator[_Equation]:
    """Yield an equation for each approach and each straight run."""
    ends = [0]
    if signals.has("sway"):  # then the velocity through the water is known in turns, too
        block = round(BLOCK_SECS / signals.dt_secs)
        for first in range(0, len(signals) - block + 1, block):
            equation = _straight_equation(signals, first, first + block, max_yaw=MAX_BLOCK_YAW)
            if equation is not None:
                yield equation
        return
    for each in found:
        if each.kind in (ManoeuvreKind.STRAIGHT, ManoeuvreKind.SPEED_RUN):
            span = each.execute, each.end
        else:
            first = each.execute - round(APPROACH_SECS / signals.dt_secs)
            span = max(first, *ends, 0), each.execute + 1
        ends.append(each.end)
        equation = _straight_equation(signals, *span)
        if equation is not None:
            yield equation


def _straight_equation(
    signals: TrialSignals, first: int, end: int, *, max_yaw: float = MAX_STRAIGHT_YAW
) -> _Equation | None:
    dt, secs = signals.dt_secs, (end - 1 - first) * signals.dt_secs
    heading = signals.heading[first:end]
    if secs < MIN_STRAIGHT_SECS or np.ptp(heading) > max_yaw:
        return None
    time = np.arange(end - first) * dt
    if np.ptp(heading) > MAX_STRAIGHT_YAW:  # a line through a bent track is not its chord
        north, east = (signals.positions[end - 1] - signals.positions[first]) / secs
    else:
        north, east = np.polyfit(time, signals.positions[first:end], 1)[0]
    count = max(2.0, secs / signals.interval("position"))
    position_noise = signals.noise.get("position", 0.0)
    std = float(np.hypot(position_noise * np.sqrt(12 / count), POSITION_DRIFT)) / secs
    ahead = signals.speed[first:end]
    sway = signals.sway[first:end] if signals.has("sway") else np.zeros(end - first)
    moved = (ahead + 1j * sway) * np.exp(1j * heading)
    water, speed = complex(np.mean(moved)), float(np.mean(ahead))
    log_noise = signals.noise.get("speed", 0.0) / np.sqrt(secs / signals.interval("speed"))
    drift = 0.0 if signals.has("sway") else MAX_MEAN_DRIFT * abs(speed)
    spread = float(np.sqrt(std**2 + log_noise**2 + drift**2))
    # measured water velocity (1 + s)·exp(i b) of the true one: ground = water·(1 - s - i b) + c
    matrix = np.array([
        [1.0, 0.0, -water.real, water.imag],
        [0.0, 1.0, -water.imag, -water.real],
    ])  # fmt: skip
    values = np.array([north - water.real, east - water.imag])
    return _Equation(matrix, values, np.full(2, max(spread, 1e-4)))


def _turn_equations(signals: TrialSignals, found: FoundManoeuvre) -> Iterator[_Equation]:
    """Yield the current that a long turning circle shows."""
    if found.kind is not ManoeuvreKind.TURNING_CIRCLE:
        return
    estimate = current_in_turn(signals, found)
    if estimate is not None:
        current, std = estimate
        yield _Equation(np.eye(2, 4), current, np.full(2, max(std, 1e-4)))


def corrected_signals(
    signals: TrialSignals, errors: FloatArray, antenna: tuple[float, float]
) -> TrialSignals:
    """Return the signals corrected for current, log and compass, with the track of the midship.

    Parameters
    ----------
    signals
        As measured.
    errors
        (4,) as `VelocityErrors.mean`.
    antenna
        Place of the antenna ahead and to starboard of the midship point, m.
    """
    north, east, scale, bias = errors
    heading = signals.heading - bias
    time = np.arange(len(signals)) * signals.dt_secs
    drifted = np.column_stack((north * time, east * time))
    return replace(
        signals,
        heading=heading,
        speed=signals.speed / (1 + scale),
        positions=signals.positions - drifted - _lever(heading, antenna),
    )


def _lever(heading: FloatArray, antenna: tuple[float, float]) -> FloatArray:
    """Return the antenna's place from the midship point, north and east, (n, 2) m."""
    if antenna == (0.0, 0.0):
        return np.zeros((len(heading), 2))
    arm = complex(*antenna) * np.exp(1j * heading)
    return np.column_stack((arm.real, arm.imag))
