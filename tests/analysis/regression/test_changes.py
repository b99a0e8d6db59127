"""Changes of coefficients within simulated trials and synthetic rows."""

import pickle
from copy import deepcopy
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from analysis.regression.changes import (
    MAX_BLOCKS,
    Change,
    ChangeTest,
    ShipChangeTest,
    determined_changes,
)
from analysis.regression.coefficients import Coefficient
from analysis.regression.first_model import SPEED_PROPORTIONAL_RUDDER
from analysis.regression.weak_form import (
    CHANNELS,
    Equation,
    Rows,
    WeakForm,
    weak_form,
    with_constant,
)
from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.report.replay_json import replay_json
from analysis.report.replay_tables import replay_markdown, replay_tables
from analysis.view.replay_panels import history_panels
from analysis.view.series_builder import SeriesBuilder
from benchmarks.changed_ship import changed_trial
from benchmarks.changes import Case, halfway, reported_changes, unchanged
from benchmarks.undistorted import Condition, undistorted_log, with_long_approach
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import Gust, RandomForcing
from shiplog import TrialLog, Vessel, load_vessel, resample

ZIGZAG = Case("table1", guessed=False, manoeuvre="zigzag-20-20", noise="paper")


@pytest.mark.parametrize("vessel", ["table1", "table1-rad"])
@pytest.mark.parametrize("guessed", [False, True])
@pytest.mark.parametrize(
    "manoeuvre", ["zigzag-20-20", "zigzag-10-10", "pseudo-random", "turning-circle"]
)
def test_no_change_is_reported_where_nothing_changed(
    vessel: str, guessed: bool, manoeuvre: str
) -> None:
    for noise in ("paper", "white"):
        case = Case(vessel, guessed, manoeuvre, noise)
        for secs in (600.0, 1200.0):
            assert reported_changes(unchanged(case, secs, seed=1), case) == ()


@pytest.mark.parametrize("name", ["d", "f", "b2"])
@pytest.mark.parametrize("guessed", [False, True])
@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "pseudo-random"])
def test_a_change_by_a_fifth_is_detected_with_its_instant_and_size(
    name: str, guessed: bool, manoeuvre: str
) -> None:
    case = Case("table1", guessed, manoeuvre, "white")
    for seed, factor in enumerate((0.8, 1.2)):
        changes = reported_changes(halfway(case, name, factor, seed), case)
        (found,) = [change for change in changes if change.name == name]
        assert abs(found.at_secs - 600) < 100
        assert abs(found.relative_change - (factor - 1)) < max(
            1.5 * found.relative_change_half_width, 0.01
        )
        assert abs(found.after / found.before - 1) == pytest.approx(abs(found.relative_change))
        assert (found.from_secs, found.until_secs) == pytest.approx((30, 1170), abs=2)


def test_random_forcing_is_not_a_change(vessel: Vessel) -> None:
    for seed in range(4):
        trial = simulate(
            vessel, "zigzag-20-20", duration_secs=1200.0, seed=seed, sensors=suite("paper"),
            random_forcing=RandomForcing(np.radians(0.2), 0.005),
        )  # fmt: skip
        assert reported_changes(TrialLog("random_forcing", trial.channels), ZIGZAG) == ()


def test_the_onset_of_a_steady_moment_is_not_a_change(vessel: Vessel) -> None:
    gusts = (Gust(np.radians(2.0), 500.0),)
    for seed in range(4):
        trial = simulate(
            vessel, "zigzag-20-20", duration_secs=1200.0, seed=seed, sensors=suite("paper"),
            gusts=gusts,
        )  # fmt: skip
        assert reported_changes(TrialLog("gust", trial.channels), ZIGZAG) == ()


@pytest.mark.parametrize("seed", [3, 12, 13, 19])
def test_a_manoeuvre_after_a_long_straight_approach_is_not_a_change(
    vessel: Vessel, seed: int
) -> None:
    """On the approach the regressors are noise, so that the coefficients there tend to zero."""
    log = undistorted_log(Condition("approach", with_long_approach, noise="white"), seed)
    assert analyse(log, ReadingOptions(vessel)).findings.changes == ()


def test_two_coefficients_that_change_together_are_both_reported(vessel: Vessel) -> None:
    log = changed_trial(
        vessel, "pseudo-random", {"a": 1.2, "d": 0.8}, at_secs=700.0, duration_secs=1500.0,
        sensors=suite("white"), seed=1,
    )  # fmt: skip
    changes = {
        change.name: change for change in reported_changes(log, replace(ZIGZAG, noise="white"))
    }
    assert set(changes) == {"a", "d"}
    assert changes["a"].relative_change == pytest.approx(0.2, abs=0.02)
    assert changes["d"].relative_change == pytest.approx(-0.2, abs=0.02)


def test_alternatives_of_a_change_are_reported() -> None:
    """In a 10/10 zig-zag the magnitude of the yaw rate is constant: f and h are equivalent."""
    case = replace(ZIGZAG, manoeuvre="zigzag-10-10")
    (found,) = reported_changes(halfway(case, "f", 0.8, seed=0), case)
    assert "f" in (found.name, *found.alternatives)
    assert found.alternatives
    assert str(found).startswith(" or ".join((found.name, *found.alternatives)) + " changed ")


def synthetic_rows(changes: dict[int, float], n: int = 3000, seed: int = 0) -> Rows:
    """Return rows with white noise; `changes` maps a row to the first coefficient from it on."""
    rng = np.random.default_rng(seed)
    X, slope = rng.standard_normal((n, 2)), np.full(n, 1.0)
    for start, value in changes.items():
        slope[start:] = value
    y = X[:, 0] * slope + X[:, 1] + 0.3 * rng.standard_normal(n)
    equation = Equation(("a", "d"), 1.0, 10.0)
    return Rows(equation, 5.0 + np.arange(n), y, X, X[:, 0], 0.1)


def detected_changes(rows: Rows, cuts: list[int] | None = None) -> tuple[Change, ...]:
    test = ChangeTest(rows.equation, len(rows.target))
    edges = [0, *(cuts or []), len(rows.target)]
    for start, stop in pairwise(edges):
        test.add(rows.part(start, stop))
    return test.result()


def test_a_temporary_change_is_reported_twice() -> None:
    found = detected_changes(synthetic_rows({1000: 1.5, 2000: 1.0}))
    assert [change.name for change in found] == ["a", "a"]
    assert [change.at_secs for change in found] == pytest.approx([1005, 2005], abs=20)
    assert [change.relative_change for change in found] == pytest.approx([0.5, -1 / 3], abs=0.07)
    assert found[0].until_secs < found[1].at_secs
    assert found[1].from_secs > found[0].at_secs


@pytest.mark.parametrize("seed", range(3))
def test_results_do_not_depend_on_the_chunks_to_the_last_bit(seed: int) -> None:
    rows = synthetic_rows({1200: 1.3}, seed=seed)
    rows.target[100:140] = np.nan
    cuts = np.sort(np.random.default_rng(seed).integers(0, 3001, 12)).tolist()
    assert detected_changes(rows, cuts) == detected_changes(rows)
    assert detected_changes(rows)


def test_a_change_can_be_pickled_and_copied() -> None:
    (change,) = detected_changes(synthetic_rows({1500: 1.3}))
    assert pickle.loads(pickle.dumps(change)) == change  # noqa: S301
    assert deepcopy(change) == change


def test_rows_in_a_gap_are_ignored() -> None:
    rows = synthetic_rows({1500: 1.3})
    rows.target[1400:1600] = np.nan
    (found,) = detected_changes(rows)
    assert abs(found.at_secs - 1505) < 130
    assert found.relative_change == pytest.approx(0.3, abs=0.06)


def test_a_change_below_one_percent_is_not_reported() -> None:
    rows = synthetic_rows({1500: 1.005})
    clear = replace(rows, target=rows.regressors @ [1.0, 1.0])
    clear.target[1500:] += 0.005 * rows.regressors[1500:, 0]
    assert detected_changes(clear) == ()


def test_memory_is_bounded_for_a_month_of_rows() -> None:
    yaw = Equation(("a", "b1", "b2", "b3", "d", "e", "constant"), 1.0, 60.0)
    test = ChangeTest(yaw, 31 * 86400)
    assert len(test._factors) <= MAX_BLOCKS
    assert ChangeTest(yaw, 0).result() == ()


@pytest.fixture(scope="module")
def changed() -> Analysis:
    vessel, text = load_vessel("table1")
    log = changed_trial(
        vessel, "zigzag-20-20", {"d": 0.8}, at_secs=600.0, duration_secs=1200.0,
        sensors=suite("paper"), seed=3, vessel_toml=text,
    )  # fmt: skip
    return analyse(log)


def test_a_replay_tells_of_it_in_words_in_a_table_and_in_numbers(changed: Analysis) -> None:
    (change,) = changed.findings.changes
    (warning,) = [text for text in changed.findings.warnings if " changed " in text]
    assert warning.startswith("d changed by -")
    assert " at 600 s: the ship, its loading" in warning
    assert "the model does not hold on both sides" in warning
    (section,) = [
        s for s in replay_tables(changed.findings) if s.title == "Changes within the trial"
    ]
    assert section.rows[0][0] == "d [1/s²]"
    assert section.title in replay_markdown(changed.findings)
    (summary,) = replay_json(changed.findings)["changes"]
    assert summary["at_secs"] == change.at_secs
    assert summary["relative_change"] == pytest.approx(-0.2, abs=0.01)


def test_values_before_and_after_are_drawn_and_meet_at_the_change(changed: Analysis) -> None:
    builder = SeriesBuilder(changed.findings.plan.clock, changed.findings.plan.stats)
    builder.add(changed.as_chunk())
    panels = {panel.name: panel for panel in history_panels(changed.findings, builder.result())}
    step = panels["coefficient_d"].series[-1]
    (change,) = changed.findings.changes
    assert step.time_secs.tolist() == [change.from_secs, change.at_secs, change.until_secs]
    before, after = (line.values for line in step.lines)
    np.testing.assert_array_equal(np.isnan(before), [False, False, True])
    np.testing.assert_array_equal(np.isnan(after), [True, False, False])
    assert after[1] / before[1] == pytest.approx(change.after / change.before)
    low, high = panels["coefficient_d"].limits
    assert low < after[1] < before[1] < high
    assert "→" in panels["coefficient_d"].title
    assert all(len(panels[f"coefficient_{name}"].series) == 2 for name in ("a", "f"))


def test_a_trial_without_a_change_has_no_table_of_changes(zigzag_analysis: Analysis) -> None:
    assert zigzag_analysis.findings.changes == ()
    assert replay_json(zigzag_analysis.findings)["changes"] == []
    assert len(replay_tables(zigzag_analysis.findings)) == 4


def test_a_ship_test_equals_the_tests_of_its_two_equations(vessel: Vessel) -> None:
    log = halfway(ZIGZAG, "f", 0.8, seed=0)
    signals = resample(log, channels=CHANNELS)
    yaw, surge = weak_form(signals, vessel.coefficients)
    found = detected_changes(with_constant(yaw)) + detected_changes(surge)
    assert found == reported_changes(log, ZIGZAG)
    equations = WeakForm(SPEED_PROPORTIONAL_RUDDER, len(signals), signals.dt_secs, (1, 1, 1, 1))
    assert ShipChangeTest(equations, model_is_fitted=True).result() == ()


@pytest.mark.parametrize(
    ("before", "after", "of_trial", "is_reported"),
    [
        ((1.0, 0.1), (1.2, 0.1), (1.1, 0.1), True),
        ((1.0, 0.1), (1.2, 0.1), (-0.1, 1.0), False),
        ((0.1, 0.1), (1.2, 0.1), (1.1, 0.1), False),
        ((1.0, 0.1), (0.1, 0.1), (1.1, 0.1), False),
    ],
)
def test_the_change_of_a_coefficient_that_is_not_determined_is_not_reported(
    before: tuple[float, float],
    after: tuple[float, float],
    of_trial: tuple[float, float],
    is_reported: bool,
) -> None:
    values = before[0], after[0], before[1], after[1]
    change = Change("g", "1/m", 0.0, 50.0, 100.0, *values, 0.2, 0.1, ())
    coefficients = {"g": Coefficient(*of_trial, "1/m")}
    assert bool(determined_changes([change], coefficients)) == is_reported
