"""The matrix of distortions: a distorted trial gives right results, or the cause is reported."""

import pytest

from benchmarks.distortion_matrix import (
    OTHER_REFUSAL,
    OTHER_WARNING,
    SILENT,
    TRACEBACK,
    Outcome,
    counts_by_family,
    false_alarms,
    run_case,
    run_matrix,
)
from benchmarks.distortions import CASES, Case, cases

pytestmark = pytest.mark.xdist_group("distortions")


@pytest.fixture(scope="module")
def outcomes() -> list[Outcome]:
    return list(run_matrix())


def of_kind(outcomes: list[Outcome], kind: str) -> list[str]:
    return [f"{each.case}: {each.wrong} {each.messages}" for each in outcomes if each.kind == kind]


def test_cases_are_distinct_and_of_all_families() -> None:
    names = [str(case) for case in cases()]
    assert len(set(names)) == len(names) == CASES
    assert {case.family for case in cases()} == {
        "unit", "sign", "clock", "sampling", "sentinel", "source", "position", "pair",
    }  # fmt: skip


def test_the_undistorted_trial_is_right_without_a_warning() -> None:
    outcome = run_case(Case(()))
    assert (outcome.kind, outcome.messages) == ("right", ())


def test_no_wrong_result_is_silent(outcomes: list[Outcome]) -> None:
    assert of_kind(outcomes, SILENT) == [], counts_by_family(outcomes)


def test_every_wrong_result_has_a_warning_that_names_the_cause(outcomes: list[Outcome]) -> None:
    for kind in (OTHER_WARNING, OTHER_REFUSAL):
        assert of_kind(outcomes, kind) == [], counts_by_family(outcomes)


def test_no_distortion_ends_in_a_traceback(outcomes: list[Outcome]) -> None:
    assert of_kind(outcomes, TRACEBACK) == []


def test_undistorted_trials_of_other_seeds_give_no_warning() -> None:
    assert list(false_alarms(range(8))) == []
