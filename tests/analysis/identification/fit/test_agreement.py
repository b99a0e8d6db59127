"""Agreement of runs: those of one ship agree, another ship is named."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.fit.agreement import Agreement, assess_agreement
from analysis.identification.fit.output_error import output_error
from analysis.identification.fit.segment import Segment
from analysis.identification.fit.uncertainty import uncertainty
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.identification.runs import run_from_log
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, Vessel, load_vessel
from shiplog.ships import ship_model

pytestmark = pytest.mark.usefixtures("fit_alone")
SHIP = load_vessel("table1")[0]
C = SHIP.coefficients
OTHER = replace(SHIP, coefficients=C._replace(d=1.3 * C.d, e=1.3 * C.e))
RATES = {f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm")}
RUNS = (("zigzag-20-20", 0), ("zigzag-10-10", 1), ("zigzag-20-20-port", 2))


@cache
def a_log(manoeuvre: str, seed: int, vessel: Vessel = SHIP, noise: str = "paper") -> TrialLog:
    sensors = suite(noise, RATES)
    trial = simulate(vessel, manoeuvre, duration_secs=400.0, seed=seed, sensors=sensors)
    return as_log(trial, f"{manoeuvre}-{seed}.mcap")


def a_trial(*args: object) -> Segment:
    return run_from_log(a_log(*args)).segments[0]  # type: ignore[arg-type]


@cache
def mixed() -> IdentifiedShip:
    """Two logs of one ship, the third of another."""
    logs = [a_log(*run) for run in RUNS[:2]]
    return identify([*logs, a_log(*RUNS[2], OTHER)], "burylin")


def test_runs_of_one_ship_agree_within_their_noise() -> None:
    fit = output_error([a_trial(*run) for run in RUNS], ship_model("burylin"))
    agreement = assess_agreement(fit)
    assert agreement.names == tuple(f"{manoeuvre}-{seed}.mcap" for manoeuvre, seed in RUNS)
    for ratios in (agreement.by_own_noise, agreement.by_common_noise):
        # sums of squares of some thirty Gaussian numbers, over their number
        assert 0.3 < np.mean(np.square(ratios)) * 3 / 2 < 2.0
    assert (agreement.contradiction, agreement.enlargement) == (1.0, 1.0)


@pytest.mark.parametrize("manoeuvre", ["zigzag-20-20", "turning-circle-35", "pseudo-random"])
def test_the_halves_of_a_run_agree(manoeuvre: str) -> None:
    for seed in (0, 1):
        agreement = assess_agreement(
            output_error([a_trial(manoeuvre, seed)], ship_model("burylin"))
        )
        assert agreement.names == ("first half", "second half")
        assert agreement.contradiction == 1.0


def test_the_log_of_another_ship_is_named_and_nothing_is_identifiable() -> None:
    ship = mixed()
    (warning,) = [w for w in ship.warnings if "contradict each other" in w]
    assert "most of all zigzag-20-20-port-2.mcap" in warning
    assert ship.uncertainty.agreement.contradiction > 20
    assert set(ship.uncertainty.unidentifiable) == set(ship.uncertainty.names)


def test_contradicting_runs_do_not_inflate_the_noise_of_one_output() -> None:
    """Without a limit, reweighting would ignore one output, the speed first."""
    fit = mixed().fit
    speed = fit.problem.outputs.index("speed")
    measured = np.concatenate([t.measured[:, 1] for t in fit.problem.segments])
    assert fit.noises[speed].slow < 0.5 * np.nanstd(measured)
    estimates = mixed().uncertainty
    truth = np.array([C._asdict()[name] for name in estimates.names])
    assert np.max(np.abs(estimates.values - truth) / estimates.std) < 2


def test_two_logs_have_no_outlier() -> None:
    fit = output_error(
        [a_trial(*RUNS[0]), a_trial(*RUNS[2], OTHER)], ship_model("burylin-tied"), fixed={"T3": 0.5}
    )
    agreement = assess_agreement(fit)
    assert agreement.outlier is None
    assert agreement.contradiction > 20


def test_a_run_too_short_for_its_own_noise_is_ignored() -> None:
    assert Agreement(("a", "b"), (np.nan, 9.0), (1.0, 1.0)).contradiction == 1.0
    assert Agreement((), (), ()).enlargement == 1.0


def test_four_logs_of_one_ship_do_not_contradict_each_other() -> None:
    manoeuvres = ("zigzag-20-20", "zigzag-10-10-port", "zigzag-20-20-port", "zigzag-10-10")
    for first in (100, 200):
        segments = [a_trial(m, first + i) for i, m in enumerate(manoeuvres)]
        estimates = uncertainty(
            output_error(segments, ship_model("burylin-tied"), fixed={"T3": 0.5})
        )
        assert estimates.agreement.contradiction == 1.0
        assert np.isfinite(estimates.between_runs).all()
