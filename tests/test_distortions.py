"""The matrix of distortions: a distorted trial gives right results, or the cause is reported."""

import pytest

from benchmarks.distorted_figures import judge_identification
from benchmarks.distortion_matrix import (
    NAMED,
    OTHER_REFUSAL,
    OTHER_WARNING,
    REFUSED,
    RIGHT_WITH_WARNINGS,
    SILENT,
    TRACEBACK,
    Outcome,
    counts_by_family,
    run_case,
    run_matrix,
)
from benchmarks.distortions import CASES, Case, cases, identified_cases
from benchmarks.undistorted import Condition, conditions, false_alarms


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return list(run_matrix())


def of_kind(outcomes: list[Outcome], kind: str) -> list[str]:
    return [f"{each.case}: {each.wrong} {each.messages}" for each in outcomes if each.kind == kind]


def test_cases_are_distinct_and_of_all_families() -> None:
    names = [str(case) for case in cases()]
    assert len(set(names)) == len(names) == CASES
    assert {case.family for case in cases()} == {
        "unit", "sign", "clock", "sampling", "sentinel", "source", "position", "table", "pair",
    }  # fmt: skip


def test_the_undistorted_trial_is_right_without_a_warning() -> None:
    outcome = run_case(Case(()))
    assert (outcome.kind, outcome.messages) == ("right", ())


@pytest.mark.slow
def test_no_wrong_result_is_silent(outcomes: list[Outcome]) -> None:
    assert of_kind(outcomes, SILENT) == [], counts_by_family(outcomes)


@pytest.mark.slow
def test_every_wrong_result_has_a_warning_that_names_the_cause(outcomes: list[Outcome]) -> None:
    for kind in (OTHER_WARNING, OTHER_REFUSAL):
        assert of_kind(outcomes, kind) == [], counts_by_family(outcomes)


@pytest.mark.slow
def test_no_distortion_ends_in_a_traceback(outcomes: list[Outcome]) -> None:
    assert of_kind(outcomes, TRACEBACK) == []


@pytest.mark.slow
@pytest.mark.usefixtures("fit_alone")
def test_an_identification_of_a_distorted_trial_is_right_or_names_the_cause() -> None:
    chosen = identified_cases()[::3]  # the benchmark runs all
    outcomes = list(run_matrix(chosen, judge_identification))
    assert [str(each) for each in outcomes if not each.is_acceptable] == []
    assert {each.kind for each in outcomes} >= {NAMED, REFUSED, RIGHT_WITH_WARNINGS}


def test_the_cases_that_are_identified_are_of_all_families() -> None:
    to_identify = identified_cases()
    assert {case.family for case in to_identify} == {case.family for case in cases()}
    assert len({str(case) for case in to_identify}) == len(to_identify) >= 30


@pytest.mark.parametrize("condition", conditions(), ids=lambda condition: condition.name)
def test_undistorted_trials_give_no_warning_in_any_condition(condition: Condition) -> None:
    assert list(false_alarms((3, 13), [condition])) == []
