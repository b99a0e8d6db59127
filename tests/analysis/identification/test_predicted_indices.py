"""Standard manoeuvres predicted from zig-zags, against the exact ones of an independent ship."""

from dataclasses import replace
from functools import cache
from math import degrees, pi, radians

import numpy as np
import pytest
from reference_zigzags import EXECUTE_SECS, mmg_fit, sailed, tanker, zigzag_segments

from analysis.identification.fit.output_error import tempered_fit
from analysis.identification.held_out import PREDICTED, predict_without
from analysis.identification.model_selection import (
    MAX_MISFIT,
    Candidate,
    _mean_misfits,
    fault_of,
    held_out_sets,
    largest_rudder,
    rank_models,
)
from analysis.identification.predicted_indices import (
    PredictedManoeuvre,
    StandardManoeuvre,
    _index,
    _OfModels,
    predict_manoeuvres,
)
from analysis.identification.simulated_manoeuvres import Approach
from analysis.manoeuvres.trial_index import TrialIndex
from examples.ships.sea_trial import STEP
from shiplog.ships import ship_model
from shiplog.types import FloatArray
from shiplog.vessel.vessel import with_length

CIRCLE = StandardManoeuvre(radians(35.0))
ZIGZAG = StandardManoeuvre(radians(-20.0), radians(20.0))


@cache
def candidates() -> tuple[Candidate, ...]:
    ship = tanker()
    models = [ship_model("mmg"), ship_model("norrbin")]
    return tuple(rank_models(zigzag_segments(), models, vessel=with_length(None, ship.length)))


def approach() -> Approach:
    ship = tanker()
    return Approach(ship.length, ship.speed, ship.rpm, ship.rudder_rate)


@cache
def predicted(manoeuvre: StandardManoeuvre) -> PredictedManoeuvre:
    (result,) = predict_manoeuvres(candidates(), approach(), [manoeuvre], draws=30)
    return result


def index_of(manoeuvre: StandardManoeuvre, name: str) -> TrialIndex:
    return next(each for each in predicted(manoeuvre).indices if each.name == name)


def test_the_model_with_drift_is_chosen_and_the_other_has_no_weight() -> None:
    first, second = candidates()
    assert (first.model.name, second.model.name) == ("mmg", "norrbin")
    assert first.weight == pytest.approx(1.0)
    assert second.weight == 0.0
    assert second.score > 2 * first.score


def test_the_circle_to_the_other_rudder_angle_is_predicted_with_intervals_that_contain_it() -> None:
    true = sailed(35.0, None, 1000.0)
    first = round(EXECUTE_SECS / STEP)
    turned = true.heading - true.heading[first]
    made = true.track - true.track[first]
    k90, k180 = (int(np.argmax(turned >= angle)) for angle in (pi / 2, pi))
    exact = {
        "advance": made[k90, 0], "transfer": made[k90, 1], "tactical diameter": made[k180, 1],
        "time to 90°": (k90 - first) * STEP, "time to 180°": (k180 - first) * STEP,
    }  # fmt: skip
    for name, value in exact.items():
        index = index_of(CIRCLE, name)
        assert index.value == pytest.approx(value, rel=0.06), name
        assert index.low < value < index.high, name
        assert set(index.sources) == {
            "parameters", "choice of model", "rudder zero", "model error",
        }  # fmt: skip
    assert "extrapolated" in predicted(CIRCLE).note
    assert predicted(ZIGZAG).note == ""


def test_overshoots_to_the_side_that_was_not_sailed_first_are_predicted() -> None:
    true = sailed(-20.0, 20.0)
    change = np.degrees(true.heading - true.heading[round(EXECUTE_SECS / STEP)])
    for name, exact in (("overshoot 1", -change.min() - 20), ("overshoot 2", change.max() - 20)):
        index = index_of(ZIGZAG, name)
        assert degrees(index.value) == pytest.approx(exact, abs=1.0)
        assert index.low < radians(exact) < index.high


def test_criteria_of_the_norm_are_applied_to_predictions() -> None:
    advance, overshoot = index_of(CIRCLE, "advance"), index_of(ZIGZAG, "overshoot 1")
    assert advance.criterion is not None
    assert advance.criterion.limit == pytest.approx(4.5 * 320.0)
    assert overshoot.criterion is not None
    assert degrees(overshoot.criterion.limit) == pytest.approx(25.0)
    assert index_of(CIRCLE, "steady speed").criterion is None


def test_intervals_are_wider_where_held_out_runs_were_predicted_worse() -> None:
    best = candidates()[0]
    worse = replace(best, hard_misfits=best.hard_misfits + 0.2)
    (wide,) = predict_manoeuvres([worse], approach(), [CIRCLE], draws=30)
    for narrow, index in zip(predicted(CIRCLE).indices, wide.indices, strict=True):
        assert index.high - index.low > narrow.high - narrow.low


def test_a_model_that_diverges_gives_no_value_but_the_reason() -> None:
    best = candidates()[0]
    assert best.fit is not None
    z = best.fit.minimum.unknowns.copy()
    for name in ("nr", "nrrr"):  # the yaw rate grows without end
        z[best.fit.problem.free_names.index(name)] = 0.5
    minimum = replace(best.fit.minimum, unknowns=z)
    broken = replace(best, fit=replace(best.fit, minimum=minimum), excess=1.0)
    (result,) = predict_manoeuvres([broken], approach(), [CIRCLE], draws=10)
    assert np.isnan(result.indices[0].value)
    assert result.indices[0].note


def test_the_same_fit_gives_the_same_intervals() -> None:
    again = predict_manoeuvres(candidates(), approach(), [CIRCLE], draws=30)[0]
    assert [(i.low, i.high) for i in again.indices] == [
        (i.low, i.high) for i in predicted(CIRCLE).indices
    ]


def test_held_out_runs_are_each_run_and_all_of_the_hardest_together() -> None:
    ten, twenty = zigzag_segments()
    assert held_out_sets([ten, twenty]) == ((0,), (1,))
    named = [replace(s, name=f"{i}") for i, s in enumerate((ten, ten, twenty, twenty))]
    assert held_out_sets(named) == ((0,), (1,), (2,), (3,), (2, 3))


def test_the_errors_of_a_held_out_run_are_of_the_order_of_the_noise() -> None:
    errors = predict_without(mmg_fit(), [1])
    assert errors.misfits.shape == (1, len(PREDICTED))
    judged = errors.misfits[0][[PREDICTED.index(n) for n in ("yaw_rate", "heading", "track")]]
    assert np.all(judged < 0.1)
    assert 0.3 < errors.excess < 5


def test_a_tempered_fit_lies_nearer_to_the_priors() -> None:
    fit = mmg_fit()
    mean, precision = fit.problem.prior
    count = len(fit.problem.free)

    def distance(z: np.ndarray) -> float:
        return float(np.sum((precision * (z - mean) ** 2)[:count]))

    tempered = tempered_fit(fit, 100.0)
    assert distance(tempered.minimum.unknowns) < distance(fit.minimum.unknowns)
    assert tempered_fit(fit, 1.0) is fit


def test_a_parameter_at_its_limit_is_a_fault() -> None:
    fit = mmg_fit()
    assert fault_of(fit, approach()) == ""
    z = fit.minimum.unknowns.copy()
    added_mass = fit.problem.free_names.index("my")
    z[added_mass] = fit.problem.bounds[0][added_mass]
    assert (
        fault_of(replace(fit, minimum=replace(fit.minimum, unknowns=z)), approach())
        == "at its limit: my"
    )
    stopped = replace(fit, minimum=replace(fit.minimum, converged=False))
    assert fault_of(stopped, approach()) == "not converged"


def test_an_index_has_an_interval_though_neither_heading_nor_track_were_measured() -> None:
    first = candidates()[0]
    misfits = first.hard_misfits.copy()
    misfits[[PREDICTED.index(name) for name in ("heading", "track")]] = np.nan
    (result,) = predict_manoeuvres(
        [replace(first, hard_misfits=misfits)], approach(), [ZIGZAG], draws=10
    )
    for index in result.indices:
        assert index.low < index.value < index.high, index.name


def test_the_ratios_of_rudder_angles_are_finite_where_a_run_is_straight() -> None:
    segment = zigzag_segments()[0]
    signals = segment.signals
    values = {**signals.values, "rudder": np.zeros(len(signals))}
    assert largest_rudder(replace(segment, signals=replace(signals, values=values))) > 0


def test_the_misfit_of_several_segments_is_the_mean_of_those_measured() -> None:
    misfits = np.array([[0.1, np.inf, np.nan], [0.3, 0.2, np.nan]])
    np.testing.assert_allclose(_mean_misfits(misfits), [0.2, (MAX_MISFIT + 0.2) / 2, np.nan])


def test_ships_drawn_that_do_not_reach_an_index_are_counted_in_its_note() -> None:
    values = np.array([100.0, 101.0, 99.0, 98.0, 102.0, np.nan, 100.0, 100.5])

    def note(drawn: FloatArray) -> str:
        of_models = _OfModels([drawn], np.ones(1), np.zeros(1))
        return _index("time to 90°", CIRCLE, of_models, approach()).note

    assert note(values).startswith("20 % of the ships drawn do not reach it")
    assert note(np.nan_to_num(values, nan=100.0)) == ""
