"""Regression over whole trials and sliding windows, on simulated trials and against numpy."""

import pickle
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from analysis.regression.coefficients import Coefficient, fit_coefficients
from analysis.regression.sliding import (
    MAX_CONDITION,
    CoefficientHistory,
    RegressionAccumulator,
    StandardErrorAccumulator,
    WindowedRegression,
    fit_regression,
)
from analysis.regression.weak_form import Equation, Rows, weak_form
from analysis.signals.concat import concatenate
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel, resample

NAMES = ("yaw_rate", "speed", "rudder", "rpm")


def rows_of(  # noqa: ANN201
    vessel: Vessel, manoeuvre: str = "zigzag-20-20", noise: str = "none", duration: float = 500.0
):
    trial = simulate(vessel, manoeuvre, duration_secs=duration, seed=2, sensors=suite(noise))
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    return weak_form(signals, vessel.coefficients)


def relative_error(vessel: Vessel, name: str, value: float) -> float:
    true = getattr(vessel.coefficients, name)
    return abs(value / true - 1)


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "zigzag-10-10", "pseudo-random"])
def test_clean_data_give_the_true_coefficients(vessel: Vessel, manoeuvre: str) -> None:
    for rows in rows_of(vessel, manoeuvre):
        for name, found in fit_coefficients(rows)[0].coefficients.items():
            assert relative_error(vessel, name, found.value) < 1e-3, name


@pytest.mark.parametrize(
    ("name", "percent"),
    # the median errors of identification.md section 5 for the weak form, threefold
    [("a", 0.4), ("b1", 45), ("b2", 22), ("b3", 12), ("d", 0.5), ("e", 26), ("f", 9), ("g", 3)],
)
def test_errors_with_the_papers_noise_are_within_three_times_the_published_medians(
    vessel: Vessel, name: str, percent: float
) -> None:
    yaw, surge = rows_of(vessel, noise="paper")
    found = fit_coefficients(yaw)[0].coefficients | fit_coefficients(surge)[0].coefficients
    assert 100 * relative_error(vessel, name, found[name].value) < percent
    assert abs(found[name].value - getattr(vessel.coefficients, name)) < 4 * found[name].std


def test_coefficients_do_not_depend_on_the_assumed_model(vessel: Vessel) -> None:
    """Only the alphas of the model are used; the paper's own scheme returns its prior."""
    trial = simulate(vessel, "zigzag-20-20", duration_secs=400.0, sensors=suite("paper"))
    signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
    c = vessel.coefficients
    wrong = c._replace(a=3 * c.a, b1=0.0, b2=-c.b2, d=5 * c.d, f=0.0, g=2 * c.g, h=0.0)
    for right_rows, wrong_rows in zip(
        weak_form(signals, c), weak_form(signals, wrong), strict=True
    ):
        assert (
            fit_coefficients(right_rows)[0].coefficients
            == fit_coefficients(wrong_rows)[0].coefficients
        )


def test_a_window_equals_numpys_solution_of_its_rows(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel, "pseudo-random", noise="paper")
    history = fit_coefficients(yaw)[1]
    k = 120
    inside = (yaw.centres_secs + 30 <= history.time_secs[k] + 1e-6) & (
        yaw.centres_secs - 30 >= history.time_secs[k] - 200 - 1e-6
    )
    expected = np.linalg.lstsq(yaw.regressors[inside], yaw.target[inside], rcond=1e-15)[0]
    assert history.values[k] == pytest.approx(expected, rel=1e-6)
    scaled = yaw.regressors[inside] / np.linalg.norm(yaw.regressors[inside], axis=0)
    assert history.conditions[k] == pytest.approx(np.linalg.cond(scaled), rel=1e-9)


def test_times_of_a_history_are_the_ends_of_its_windows(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel)
    history = fit_coefficients(yaw, window_secs=150.0)[1]
    assert history.time_secs[0] == pytest.approx(150.0)
    assert history.time_secs[-1] == pytest.approx(500.0, abs=1.0)


def test_a_trial_shorter_than_the_window_is_one_window(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel, duration=120.0)
    assert fit_coefficients(yaw)[1].values.shape == (1, 6)


def test_a_regressor_of_zeros_has_no_value(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel)
    regressors = yaw.regressors.copy()
    regressors[:, 5] = 0
    found = fit_regression(replace(yaw, regressors=regressors))
    assert np.isnan(found.values[5])
    assert np.isnan(found.stds[5])
    assert np.isfinite(found.values[:5]).all()


def test_collinear_regressors_determine_no_coefficient(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel)
    regressors = yaw.regressors.copy()
    regressors[:, 3] = regressors[:, 2] * (1 + 1e-9)
    found, history = fit_coefficients(replace(yaw, regressors=regressors))
    assert found.condition > MAX_CONDITION
    assert np.isnan(history.values).all()
    assert all(not c.determined for c in found.coefficients.values())


def test_missing_rows_are_ignored(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel)
    target = yaw.target.copy()
    target[100:140] = np.nan
    for name, found in fit_coefficients(replace(yaw, target=target))[0].coefficients.items():
        assert relative_error(vessel, name, found.value) < 1e-3


def in_chunks(rows: Rows, seed: int) -> list[Rows]:
    rng = np.random.default_rng(seed)
    cuts = np.sort(rng.integers(0, len(rows.target) + 1, 12)).tolist()
    return [
        rows.part(start, stop)
        for start, stop in zip([0, *cuts], [*cuts, len(rows.target)], strict=True)
    ]


def with_gaps(rows: Rows) -> Rows:
    target = rows.target.copy()
    target[100:140] = target[300::11] = np.nan
    return replace(rows, target=target)


@pytest.mark.parametrize("seed", range(3))
def test_windows_do_not_depend_on_the_chunks_to_the_last_bit(vessel: Vessel, seed: int) -> None:
    for rows in rows_of(vessel, "pseudo-random", "paper"):
        rows_with_gaps = with_gaps(rows)
        windows = WindowedRegression(rows_with_gaps.equation, len(rows_with_gaps.target))
        found = concatenate([windows.step(chunk) for chunk in in_chunks(rows_with_gaps, seed)])
        expected = fit_coefficients(rows_with_gaps)[1]
        assert np.isfinite(expected.stds).any()
        for name in ("time_secs", "values", "stds", "conditions"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


@pytest.mark.parametrize("seed", range(3))
def test_a_fit_does_not_depend_on_the_chunks_to_the_last_bit(vessel: Vessel, seed: int) -> None:
    for rows in rows_of(vessel, "pseudo-random", "paper"):
        rows_with_gaps = with_gaps(rows)
        regression = RegressionAccumulator(rows_with_gaps.equation)
        for chunk in in_chunks(rows_with_gaps, seed):
            regression.add(chunk)
        errors = StandardErrorAccumulator(regression.solve())
        for chunk in in_chunks(rows_with_gaps, seed + 10):
            errors.add(chunk)
        found, expected = errors.result(), fit_regression(rows_with_gaps)
        assert (found.values == expected.values).all()
        assert (found.stds == expected.stds).all()
        assert found.condition == expected.condition


def test_a_pass_also_solves_for_fewer_regressors(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel, noise="paper")
    regression = RegressionAccumulator(yaw.equation)
    regression.add(yaw)
    kept = [0, 1, 4]
    found = regression.solve(tuple(yaw.equation.names[i] for i in kept))
    expected = np.linalg.lstsq(yaw.regressors[:, kept], yaw.target, rcond=1e-16)[0]
    assert found.values == pytest.approx(expected, rel=1e-9)
    assert found.determined.all()


def test_there_are_no_windows_before_the_first_is_full(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel)
    history: CoefficientHistory = WindowedRegression(yaw.equation, len(yaw.target)).step(
        yaw.part(0, 10)
    )
    assert history.values.shape == history.stds.shape == (0, 6)
    assert history.time_secs.shape == history.conditions.shape == (0,)


def test_errors_allow_for_overlapping_rows() -> None:
    """Rows are moving sums of white noise; the textbook formula ignores their overlap."""
    rng, overlap, n = np.random.default_rng(0), 20, 600
    slopes, estimated, naive = [], [], []
    x = np.column_stack([np.sin(np.arange(n) / 25), np.cos(np.arange(n) / 40)])
    for _ in range(300):
        noise = np.convolve(rng.standard_normal(n + overlap - 1), np.ones(overlap), "valid")
        y = x @ [2.0, -1.0] + noise
        rows = Rows(
            Equation(("a", "d"), 1.0, float(overlap)), np.arange(float(n)), y, x, x[:, 0], 0.1
        )
        found = fit_regression(rows)
        slopes.append(found.values[0])
        estimated.append(found.stds[0])
        residual = y - x @ found.values
        naive.append(np.sqrt(residual @ residual / (n - 2) * np.linalg.inv(x.T @ x)[0, 0]))
    assert np.mean(estimated) == pytest.approx(np.std(slopes), rel=0.25)
    assert np.mean(naive) < 0.4 * np.std(slopes)


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "turning-circle", "pull-out"])
def test_two_standard_deviations_contain_the_truth_in_over_ninety_percent(
    vessel: Vessel, manoeuvre: str
) -> None:
    """Count over seeds and noises, for whole trials and for windows."""
    inside: dict[str, list[bool]] = {"whole": [], "windows": []}
    for seed in range(8):
        for noise in ("white", "paper"):
            sensors = suite(noise)
            trial = simulate(vessel, manoeuvre, duration_secs=500.0, seed=seed, sensors=sensors)
            signals = resample(TrialLog("trial", trial.channels), channels=NAMES)
            yaw, surge = weak_form(signals, vessel.coefficients)
            for found, history in (fit_coefficients(yaw, constant=True), fit_coefficients(surge)):
                true = np.array([getattr(vessel.coefficients, n) for n in history.names])
                for name, c in found.coefficients.items():
                    if np.isfinite(c.std):
                        error = c.value - getattr(vessel.coefficients, name)
                        inside["whole"].append(abs(error) < 2 * c.std)
                is_known = np.isfinite(history.stds)
                is_inside = np.abs(history.values - true) < 2 * history.stds
                inside["windows"] += is_inside[is_known].tolist()
    assert np.mean(inside["whole"]) > 0.9
    assert np.mean(inside["windows"]) > 0.9


def test_a_steady_turn_determines_no_window_and_neither_b1_nor_b2(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel, "turning-circle", "paper")
    found, history = fit_coefficients(yaw, constant=True)
    assert np.isnan(history.values).all()
    assert not found.coefficients["b1"].determined
    assert not found.coefficients["b2"].determined
    assert found.coefficients["a"].determined


def test_a_straight_run_does_not_determine_yaw(vessel: Vessel) -> None:
    still = simulate(vessel, "turning-circle", duration_secs=10.0, sensors=suite("paper"))
    signals = resample(TrialLog("still", still.channels), channels=NAMES)
    yaw, _ = weak_form(signals, vessel.coefficients)
    assert not any(c.determined for c in fit_coefficients(yaw)[0].coefficients.values())


def test_a_coefficient_is_determined_if_two_standard_deviations_from_zero() -> None:
    assert Coefficient(-3.0, 1.0, "1").determined
    assert not Coefficient(-1.5, 1.0, "1").determined
    assert not Coefficient(float("nan"), float("nan"), "1").determined


def test_results_can_be_pickled_and_copied(vessel: Vessel) -> None:
    yaw, _ = rows_of(vessel, noise="paper")
    fit, history = fit_coefficients(yaw)
    for copied, copied_history in (
        pickle.loads(pickle.dumps((fit, history))),  # noqa: S301
        deepcopy((fit, history)),
    ):
        assert copied.coefficients == fit.coefficients
        np.testing.assert_array_equal(copied.window_conditions, fit.window_conditions)
        assert copied_history.names == history.names
        np.testing.assert_array_equal(copied_history.values, history.values)
        np.testing.assert_array_equal(copied_history.stds, history.stds)
