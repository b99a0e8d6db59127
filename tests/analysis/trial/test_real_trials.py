"""The indices of real and published runs, and what is found in logs that lack something."""

import pickle
from dataclasses import replace
from functools import cache
from math import degrees

import numpy as np
import pytest
from places import KVLCC2, PROJECT, SAMPLE_DATA
from tanker_logs import tanker_log

import shiplog
from analysis import TrialAnalysis, TrialOptions, analyse_trial
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.start_rules import StartRule
from analysis.manoeuvres.trial_index import Verdict
from analysis.replay.reading_options import ReadingOptions
from shiplog.layouts.layout import load_layout
from shiplog.tables.foreign import read_table

CASE_21 = PROJECT.parent / "shared" / "cases" / "21-helm-in-the-approach"
AT_ZERO = TrialOptions(start_rule=StartRule.STATED, execute_secs=(0.0,))


@cache
def tanker(path: str) -> TrialAnalysis:
    """Analyse a model test of the KVLCC2 from the file's first instant on."""
    file = KVLCC2 / path
    if not file.is_file():
        pytest.skip(f"the real recordings are not here: {file}")
    return analyse_trial(tanker_log(file), ReadingOptions(length=320.0), AT_ZERO)


def values(trial: TrialAnalysis) -> dict[str, float]:
    """Return the indices of the first manoeuvre: lengths in L, angles in degrees, times in s."""
    return {
        index.name: degrees(index.value)
        if index.unit == "rad"
        else index.in_lengths
        if index.unit == "m"
        else index.value
        for index in trial.manoeuvres[0].indices
    }


def test_the_tanker_s_turning_circle_is_as_computed_from_its_file() -> None:
    found = values(tanker("marin/MARIN_FREE_KVLCC2_tc_35_m.dat"))
    expected = {
        "advance": 3.122, "transfer": 1.202, "tactical diameter": 3.067,
        "time to 90°": 169.3, "time to 180°": 349.7,
    }  # fmt: skip
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=0.01), name


@pytest.mark.parametrize(
    ("path", "overshoots", "tolerance"),
    [
        ("marin/MARIN_FREE_KVLCC2_zz_10_m.dat", (9.39, 15.11), 0.15),
        ("marin/MARIN_FREE_KVLCC2_zz_20_m.dat", (15.59, 12.81), 0.15),
        ("hsva/HSVA_CPMC_KVLCC2_Z_10_10_P.dat", (9.69,), 0.2),
    ],
)
def test_the_tanker_s_overshoots_are_as_computed_from_its_files(
    path: str, overshoots: tuple[float, ...], tolerance: float
) -> None:
    found = values(tanker(path))
    for number, overshoot in enumerate(overshoots, 1):
        assert found[f"overshoot {number}"] == pytest.approx(overshoot, abs=tolerance)


def test_the_tanker_s_initial_turning_is_as_computed_from_its_file() -> None:
    found = values(tanker("marin/MARIN_FREE_KVLCC2_zz_10_m.dat"))
    assert found["initial turning distance"] == pytest.approx(1.911, rel=0.01)


def test_each_criterion_is_decided_by_the_manoeuvre_that_tests_it() -> None:
    trial = tanker("marin/MARIN_FREE_KVLCC2_zz_10_m.dat")
    verdicts = {each.name: each.index.verdict for each in trial.criteria if each.index}
    assert verdicts == {
        "initial turning": Verdict.MEETS,
        "10/10 zig-zag, first overshoot": Verdict.MEETS,
        "10/10 zig-zag, second overshoot": Verdict.MEETS,
    }
    assert all(each.reason for each in trial.criteria if each.index is None)


def test_helm_in_the_approach_is_not_the_execute() -> None:
    if not CASE_21.is_dir():
        pytest.skip(f"the cases are not here: {CASE_21}")
    log = read_table(CASE_21 / "helm08.csv", load_layout(CASE_21 / "bridge.toml"))
    trial = analyse_trial(log, ReadingOptions(length=160.93))
    (circle,) = trial.manoeuvres
    advance, time = circle.index("advance"), circle.index("time to 90°")
    assert advance is not None
    assert time is not None
    assert advance.value == pytest.approx(566.0, abs=3.0)
    assert time.value == pytest.approx(110.0, abs=0.3)
    assert advance.low < 566.0 < advance.high


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("zigzag_20_20", ManoeuvreKind.ZIGZAG),
        ("zigzag_10_10_dropouts", ManoeuvreKind.ZIGZAG),
        ("turning_circle_35", ManoeuvreKind.TURNING_CIRCLE),
    ],
)
def test_the_manoeuvre_of_each_sample_log_is_found_and_no_other(
    name: str, kind: ManoeuvreKind
) -> None:
    trial = analyse_trial(shiplog.read(SAMPLE_DATA / f"{name}.mcap"))
    assert [each.kind for each in trial.manoeuvres] == [kind]
    assert trial.manoeuvres[0].execute_secs == pytest.approx(10.0, abs=0.1)


def test_random_rudder_is_no_manoeuvre_and_each_order_has_its_reason() -> None:
    trial = analyse_trial(shiplog.read(SAMPLE_DATA / "pseudo_random.mcap"))
    assert trial.manoeuvres == ()
    assert len(trial.not_computed) > 5
    assert all(each.reason for each in trial.not_computed)


@pytest.mark.parametrize(
    ("dropped", "lost", "reason"),
    [
        ("position", "advance", "no position"),
        ("heading", "", ""),
        ("speed", "steady speed", "no speed"),
        ("yaw_rate", "", ""),
        ("rpm", "", ""),
    ],
)
def test_a_log_without_a_channel_loses_only_what_needs_it(
    dropped: str, lost: str, reason: str
) -> None:
    log = shiplog.read(SAMPLE_DATA / "turning_circle_35.mcap")
    less = replace(log, channels=tuple(each for each in log if each.name != dropped))
    (circle,) = analyse_trial(less).manoeuvres
    reasons = {each.subject: each.reason for each in circle.not_computed}
    if lost:
        assert reason in reasons[lost]
    else:
        assert circle.index("advance") is not None
    assert circle.index("time to 90°") is not None


def test_without_heading_and_yaw_rate_the_reason_is_named() -> None:
    log = shiplog.read(SAMPLE_DATA / "turning_circle_35.mcap")
    less = replace(log, channels=tuple(c for c in log if c.name not in ("heading", "yaw_rate")))
    trial = analyse_trial(less)
    assert not [each for each in trial.manoeuvres if each.indices]
    assert any("neither heading nor yaw rate" in each.reason for each in trial.not_computed)


def test_an_analysis_can_be_pickled() -> None:
    trial = analyse_trial(shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap"))
    copy = pickle.loads(pickle.dumps(trial))  # noqa: S301
    assert str(copy.manoeuvres[0].indices) == str(trial.manoeuvres[0].indices)
    assert np.array_equal(copy.manoeuvres[0].series.rudder, trial.manoeuvres[0].series.rudder)
