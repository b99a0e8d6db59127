"""The errors of filters and smoothers are as large as their covariances state, over many runs."""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
import pytest
from filter_runs import (
    SMOOTHABLE,
    disturbed,
    estimates_of,
    five_states,
    measured_as,
    pushes,
    signals_of,
    smoothed_run,
    steered,
    straight,
    three_states,
)
from gaussian import band, draws, normalised_squared

from analysis.filters.factory import make_filter
from analysis.filters.noise_model import NoiseModel, Wave
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import Vessel
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

SEEDS = 60
AT = (0, 20, 65, 120, 199)
COUNT, DT = 200, 0.5
SPREAD, FIRST = np.array([1e-3, 0.5]), np.array([2e-3, 8.0])
STDS = np.array([1e-4, 0.1])
OF_FIVE = NoiseModel(STDS, np.array([1e-2, 1e-2]))
OF_THREE = NoiseModel(STDS, np.array([1e-4, 1e-3]))
AMONG_WAVES = replace(OF_THREE, wave=Wave(frequency=0.6, damping=0.1, std=4e-4, evidence=1.0))


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Errors and covariances, (m, n, s) and (m, n, s, s), and errors of the output, (m, n, 5)."""

    errors: np.ndarray
    covariances: np.ndarray
    outputs: np.ndarray

    def squares(self, at: int) -> float:
        """The normalised squared errors of all runs at an instant, summed."""
        return float(np.sum(normalised_squared(self.errors[:, at], self.covariances[:, at])))


Pair = tuple[Ensemble, Ensemble]  # filtered, smoothed


def seen_of(count: int) -> np.ndarray:
    """The speed is measured three times as seldom, the yaw rate not for a while."""
    seen = measured_as("slow speed", np.ones((count, 2)))
    seen[50:70, 0] = np.nan
    return seen


def stats_of(c: Coefficients, inputs: np.ndarray, dt: float, **known: float) -> SignalStats:
    result = signal_stats(signals_of(seen_of(len(inputs)), *inputs.T, dt), c)
    return replace(result, first=FIRST, std=SPREAD, **known)


def linear(c: Coefficients, settings: FilterSettings, noise: NoiseModel) -> Pair:
    """Runs drawn from the filter's own model; without the wave's states."""
    inputs = np.column_stack(steered(COUNT, DT))
    stats = stats_of(c, inputs, DT)
    if settings.chosen == "pseudo-input":
        run = five_states(c, noise, stats, *inputs.T)
    else:
        stds = None if settings.chosen == "extended" else noise.measurement_std
        run = three_states(c, noise, stats, *inputs.T, stds)
    drawn = [run.drawn(np.random.default_rng(seed)) for seed in range(SEEDS)]
    return judged(c, settings, noise, stats, inputs, drawn)


def nonlinear(c: Coefficients, settings: FilterSettings, noise: NoiseModel) -> Pair:
    """Runs of the nonlinear ship, disturbed by a random yaw moment and surge force."""
    dt, count, ahead, turning = 0.1, 1000, 7.0, 4e-3
    inputs = np.column_stack(steered(count, dt))
    stats = stats_of(c, inputs, dt, median_speed=ahead, yaw_rate_rms=turning)
    rng = np.random.default_rng(3)
    rate = (abs(c.a) + 1e-3) * (SPREAD[0] + 1e-9)
    first = draws(rng, np.diag([SPREAD[0], rate, SPREAD[1]]) ** 2, SEEDS)
    moved = draws(rng, pushes(c, noise, stats), SEEDS * (count - 1))
    moved = moved.reshape(SEEDS, count - 1, 3)
    true = disturbed(c, first + np.array([FIRST[0], 0, FIRST[1]]), inputs, dt, moved)
    measured = true[:, :, [0, 2]] + STDS * rng.standard_normal((SEEDS, count, 2))
    drawn = list(zip(true, measured, strict=True))
    return judged(c, settings, noise, stats, inputs, drawn)


def judged(
    c: Coefficients,
    settings: FilterSettings,
    noise: NoiseModel,
    stats: SignalStats,
    inputs: np.ndarray,
    drawn: list[tuple[np.ndarray, np.ndarray]],
) -> Pair:
    """The errors over the runs drawn."""
    own = 5 if settings.chosen == "pseudo-input" else 3
    result: tuple[list, list] = [], []
    new = make_filter(c, noise, stats, settings)
    for true, measured in drawn:
        signals = signals_of(measured * seen_of(len(measured)), *inputs.T, stats.dt_secs)
        filtering = deepcopy(new)
        _, trace, smoothed = smoothed_run(filtering, signals)
        expected = true if own == 5 else estimates_of(c, true[:, :3], *inputs.T, stats.dt_secs)
        ways = (trace.states, trace.covariances), smoothed
        for kept, (x, P) in zip(result, ways, strict=True):
            outputs, *_ = filtering.to_estimates(signals, last_inputs(signals), x, P)
            kept.append((x[:, :own] - true[:, :own], P[:, :own, :own], outputs - expected))
    filtered, smoothed = (Ensemble(*map(np.array, zip(*runs, strict=True))) for runs in result)
    return filtered, smoothed


CASES = {
    "pseudo-input": (linear, "pseudo-input", OF_FIVE),
    "extended": (linear, "extended", OF_THREE),
    "extended among waves": (linear, "extended", AMONG_WAVES),
    "extended, the nonlinear ship": (nonlinear, "extended", OF_THREE),
    "steady-state": (linear, "steady-state", OF_THREE),
    "steady-state among waves": (linear, "steady-state", AMONG_WAVES),
    "quality": (linear, "quality", OF_THREE),
    "per-tick": (linear, "per-tick", OF_THREE),
    "per-tick among waves": (linear, "per-tick", AMONG_WAVES),
}


WITH_SMOOTHER = [case for case, (_, kind, _) in CASES.items() if kind in SMOOTHABLE]


@pytest.fixture(scope="module")
def ensembles(request: pytest.FixtureRequest, vessel: Vessel) -> Pair:
    made, kind, noise = CASES[request.param]
    c = vessel.coefficients if made is nonlinear else straight(vessel.coefficients)
    return made(c, FilterSettings(kind=kind), noise)


@pytest.mark.parametrize("ensembles", CASES, indirect=True)
def test_a_filters_errors_are_as_large_as_their_covariances_state(ensembles: Pair) -> None:
    of_all(ensembles[0])


@pytest.mark.parametrize("ensembles", WITH_SMOOTHER, indirect=True)
def test_a_smoothers_errors_are_as_large_as_their_covariances_state(ensembles: Pair) -> None:
    of_all(ensembles[1])


@pytest.mark.parametrize("ensembles", WITH_SMOOTHER, indirect=True)
def test_a_smoother_is_no_further_from_the_truth_than_the_filter_in_any_state(
    ensembles: Pair,
) -> None:
    filtered, smoothed = (np.sqrt(np.mean(one.outputs**2, axis=(0, 1))) for one in ensembles)
    assert np.all(smoothed <= filtered * (1 + 1e-12)), (filtered, smoothed)


def of_all(one: Ensemble) -> None:
    """The normalised squared errors are chi-squared, at 99 %."""
    low, high = band(SEEDS * one.errors.shape[-1])
    squares = [one.squares(at) for at in AT]
    assert low < min(squares), squares
    assert max(squares) < high, squares
