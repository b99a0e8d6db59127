"""Filters and smoother of random ships, helms, noises and holes, against the joint Gaussian."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest
from filter_runs import (
    FILTERS,
    SMOOTHABLE,
    estimates_of,
    five_states,
    sailed,
    signals_of,
    smoothed_run,
    straight,
    three_states,
)
from gaussian import LinearRun, apart
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.filters.base import Filter
from analysis.filters.factory import make_filter
from analysis.filters.noise_model import NoiseModel
from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog import Signals, load_vessel
from shiplog.ships.paper import Coefficients
from shiplog.vessel.settings import FilterSettings

OFTEN = settings(derandomize=True, max_examples=25, deadline=None)
COUNT = 12
TABLE1 = load_vessel("table1")[0].coefficients


@dataclass(frozen=True, eq=False)
class Run:
    """A ship drawn at random, twelve instants of it, and the noise assumed."""

    c: Coefficients
    dt: float
    delta: np.ndarray
    n: np.ndarray
    measured: np.ndarray  # (12, 2), NaN where not
    ratios: np.ndarray
    stds: np.ndarray

    @property
    def signals(self) -> Signals:
        return signals_of(self.measured, self.delta, self.n, self.dt)

    @cached_property
    def stats(self) -> SignalStats:
        return signal_stats(self.signals, self.c)

    def noise(self, kind: str) -> NoiseModel:
        return NoiseModel(self.stds, self.ratios if kind == "pseudo-input" else self.ratios / 10)

    def filtering(self, kind: str) -> Filter:
        chosen = FilterSettings(kind=kind, gate=1e9)
        return make_filter(self.c, self.noise(kind), self.stats, chosen)

    def by_force(self, kind: str) -> LinearRun:
        run = five_states if kind == "pseudo-input" else three_states
        return run(self.c, self.noise(kind), self.stats, self.delta, self.n)


@st.composite
def runs(draw: st.DrawFn, *, linear: bool = True) -> Run:
    """Linear ships have no drag and a rudder that feels the propeller alone."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sizes = rng.uniform(0.3, 3.0, len(TABLE1))
    c = Coefficients(*(np.array(TABLE1) * sizes).tolist())
    if linear:
        # also unstable ones: b1 > 0
        c = straight(c)._replace(b1=draw(st.sampled_from([-1.0, 1.0])) * abs(c.b1))
    stds = np.array([1e-3, 0.1]) * rng.uniform(0.3, 3, 2)
    measured = rng.standard_normal((COUNT, 2)) * stds + [5e-3 * rng.standard_normal(), 8.0]
    missing = rng.random((COUNT, 2)) < draw(st.sampled_from([0.0, 0.3, 0.7]))
    for output in range(2):
        missing[rng.permutation(COUNT)[:2], output] = False  # of one sample no spread is known
    return Run(
        c=c,
        dt=draw(st.sampled_from([0.02, 0.05, 0.1])),  # beyond, Runge-Kutta's own error shows
        delta=0.3 * np.cumsum(rng.uniform(-0.2, 0.2, COUNT)),
        n=np.full(COUNT, rng.uniform(40, 120)),
        measured=np.where(missing, np.nan, measured),
        ratios=10.0 ** rng.uniform(-3, -1, 2),
        stds=stds,
    )


@pytest.mark.parametrize("kind", SMOOTHABLE)
@OFTEN
@given(run=runs())
def test_a_filter_is_the_joint_gaussian_given_what_was_measured_until_then(
    kind: str, run: Run
) -> None:
    _, trace = run.filtering(kind).trace(run.signals, last_inputs(run.signals))
    expected = run.by_force(kind).filtered(run.measured)
    assert max(apart((trace.states, trace.covariances), expected)) < 1e-9


@pytest.mark.parametrize("kind", SMOOTHABLE)
@OFTEN
@given(run=runs())
def test_a_smoother_is_the_joint_gaussian_given_all_that_was_measured(kind: str, run: Run) -> None:
    _, _, result = smoothed_run(run.filtering(kind), run.signals)
    assert max(apart(result, run.by_force(kind).given(run.measured))) < 1e-9


@pytest.mark.parametrize("kind", FILTERS)
@OFTEN
@given(run=runs(linear=False))
def test_with_everything_missing_a_filter_is_the_ships_own_motion(kind: str, run: Run) -> None:
    start = np.array([2e-3, 0.0, 7.0])
    stats = replace(run.stats, first=start[[0, 2]])
    nothing = replace(run, measured=np.full((COUNT, 2), np.nan)).signals
    filtering = make_filter(run.c, run.noise(kind), stats, FilterSettings(kind=kind))
    estimates = filtering.step(nothing, last_inputs(nothing))
    path = sailed(run.c, start, run.delta, run.n, run.dt)
    expected = estimates_of(run.c, path, run.delta, run.n, run.dt)
    assert np.isnan(estimates.innovations).all()
    for result, true in zip(estimates.states[:-1].T, expected[:-1].T, strict=True):
        assert result == pytest.approx(true, abs=1e-7 * np.abs(true).max())
