"""Positions in a fit: the drift and the current of an independent ship are estimated."""

from dataclasses import replace

import numpy as np
import pytest
from reference_zigzags import CURRENT, mmg_fit, sailed, zigzag_segments

from analysis.identification.fit.output_error import make_problem
from analysis.identification.fit.segment import averaged
from shiplog.ships import ship_model


def test_the_current_of_each_run_is_estimated() -> None:
    fit = mmg_fit()
    for i in range(len(fit.problem.segments)):
        current = fit.problem.own(fit.minimum.unknowns, i).current
        assert current == pytest.approx(CURRENT, abs=0.1)


def test_the_sway_that_no_sensor_measured_is_that_of_the_ship() -> None:
    fit = mmg_fit()
    simulated = fit.problem.simulated(fit.minimum.unknowns, 1)
    time = fit.problem.segments[1].signals.time_secs
    true = sailed(20.0, 20.0)
    sway = np.interp(time, true.time, true.sway)
    assert np.std(sway) > 0.3
    assert np.sqrt(np.mean((simulated[:, 2] - sway) ** 2)) < 0.05


def test_the_jacobian_is_that_by_differences_for_every_unknown() -> None:
    segments = [replace(segment, antenna=(-40.0, 3.0)) for segment in zigzag_segments()]
    problem = make_problem(segments, ship_model("three-dof"), length=320.0)
    z = problem.start() + 0.01 * np.random.default_rng(0).normal(size=problem.size)
    jacobian = problem.jacobian(z, 1)
    for k, at in enumerate(problem.unknown_indices(1)):
        step = np.zeros(problem.size)
        step[at] = 1e-6
        by = (problem.predicted(z + step, 1) - problem.predicted(z - step, 1)) / 2e-6
        assert np.array_equal(np.isfinite(by), problem.measured_mask(1))
        scale = max(float(np.nanmax(np.abs(by))), 1e-9)
        assert np.nanmax(np.abs(by - jacobian[:, :, k])) < 1e-3 * scale


def test_a_model_without_drift_is_fitted_without_positions() -> None:
    problem = make_problem(zigzag_segments(), ship_model("norrbin"), length=320.0)
    assert problem.outputs == ("yaw_rate", "speed", "heading")
    assert problem.own_layout.current == 0


def test_means_of_samples_keep_levels_and_times() -> None:
    segment = zigzag_segments()[0]
    mean = averaged(segment, 10.0)
    assert mean.dt_secs == pytest.approx(10.0)
    first = segment.signals.start_ns + segment.signals.time_secs[:5].mean() * 1e9
    assert mean.signals.start_ns + mean.signals.time_secs[0] * 1e9 == pytest.approx(first)
    assert np.nanmean(mean.measured[:, 1]) == pytest.approx(
        np.nanmean(segment.measured[: 5 * len(mean), 1])
    )
    assert averaged(segment, 1.0) is segment
