"""Runs, fits and their uncertainty can be pickled and copied, as parallel computing requires."""

import pickle
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from fitted_runs import fitted
from trial_logs import as_log

from analysis.identification.fit.nuisance import Nuisance
from analysis.identification.runs import run_from_log
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import load_vessel

Copy = Callable[[Any], Any]


def through_pickle(value: Any) -> Any:  # noqa: ANN401
    return pickle.loads(pickle.dumps(value))  # noqa: S301


COPIES = (deepcopy, through_pickle)


@pytest.mark.parametrize("copy", COPIES, ids=("deepcopy", "pickle"))
def test_a_copied_fit_has_the_same_results(copy: Copy) -> None:
    fit, estimates = fitted("burylin-tied")
    copied = copy(fit)
    z = fit.minimum.unknowns
    assert np.array_equal(copied.parameters, fit.parameters)
    assert np.array_equal(copied.minimum.information, fit.minimum.information)
    assert np.array_equal(copied.problem.predicted(z, 0), fit.problem.predicted(z, 0))
    assert copied.problem.free_names == fit.problem.free_names
    assert copied.noises == fit.noises
    assert np.array_equal(copied.residual_stds[0].typical, fit.residual_stds[0].typical)
    other = copy(estimates)
    assert np.array_equal(other.std, estimates.std)
    assert other.agreement == estimates.agreement
    assert other.unidentifiable == estimates.unidentifiable


@pytest.mark.parametrize("copy", COPIES, ids=("deepcopy", "pickle"))
def test_a_copied_run_has_the_same_segments(copy: Copy) -> None:
    trial = simulate(
        load_vessel("table1")[0], "zigzag-20-20", duration_secs=100.0, sensors=suite("none")
    )
    run = run_from_log(as_log(trial, "z.mcap"))
    copied = copy(run)
    assert (copied.name, copied.warnings, copied.vessel) == (run.name, run.warnings, run.vessel)
    for segment, original in zip(copied.segments, run.segments, strict=True):
        assert np.array_equal(segment.measured, original.measured, equal_nan=True)
        assert np.array_equal(segment.signals["rudder"], original.signals["rudder"])


def test_priors_of_segments_can_be_copied() -> None:
    for nuisance in (Nuisance(), Nuisance.none()):
        assert through_pickle(nuisance) == nuisance
