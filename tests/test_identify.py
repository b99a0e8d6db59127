"""Identification from logs to vessel file: what is found, what is refused, what is said."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from math import degrees, radians

import numpy as np
import pytest
from conftest import as_log

from analysis.identify.identified import IdentifiedShip, _best, identify
from analysis.identify.prediction import predict
from analysis.identify.report import as_json, sections
from analysis.identify.runs import run_of
from analysis.identify.validation import Validation, first_order, validate
from analysis.identify.written import vessel_toml
from recorders.sensors import suite
from recorders.simulate import simulate
from shiplog import LogError, TrialLog, UsageError, load_vessel
from shiplog.arguments import SHIP_MODELS
from shiplog.ships import LADDER
from shiplog.vessel import parse_vessel

VESSEL, TOML = load_vessel("table1")
LONG = TOML.replace("angle_unit", "length = 200.0\nangle_unit", 1)


@cache
def a_log(
    manoeuvre: str = "zigzag-20-20", seed: int = 0, noise: str = "paper", seconds: float = 400.0,
    toml: str | None = TOML,
) -> TrialLog:  # fmt: skip
    vessel = parse_vessel(toml, "here") if toml else VESSEL
    trial = simulate(
        vessel, manoeuvre, duration_secs=seconds, seed=seed, sensors=suite(noise), vessel_toml=toml
    )
    return as_log(trial, f"{manoeuvre}-{seed}.mcap")


@cache
def known_ship() -> IdentifiedShip:
    held_out = [a_log("turning-circle-35", 7, seconds=500.0), a_log("zigzag-10-10", 8, seconds=600)]
    return identify(
        [a_log(), a_log(seed=1)], "burylin-tied", known={"T3": 0.5}, validation_logs=held_out
    )


def without(log: TrialLog, *names: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name not in names))


def with_values(log: TrialLog, **values: float) -> TrialLog:
    """The log with channels that say the same throughout."""
    channels = [
        replace(c, values=np.full(len(c), values[c.name])) if c.name in values else c
        for c in log.channels
    ]
    return replace(log, channels=tuple(channels))


# ---- what is found


def test_several_logs_give_the_ship_with_intervals_that_hold_her() -> None:
    found, truth = known_ship(), VESSEL.coefficients._asdict()
    for name, (low, high) in zip(found.uncertainty.names, found.uncertainty.interval, strict=True):
        middle = (low + high) / 2
        assert abs(truth[name] - middle) < 1.6 * (high - low) / 2, name
    assert found.coefficients["d"] == pytest.approx(truth["d"], rel=2e-3)
    assert found.known == {"T3": 0.5, "alpha1": 0.0171, "alpha2": 0.0015, "alpha3": 0.0654}
    assert found.told == found.uncertainty.names
    assert [run.name for run in found.runs] == ["zigzag-20-20-0.mcap", "zigzag-20-20-1.mcap"]
    assert found.warnings == ()


def test_held_out_logs_are_predicted_in_the_units_of_a_trial() -> None:
    circle, zigzag = known_ship().validations
    assert circle.rms["yaw_rate"] < radians(0.02)
    assert circle.rms["track"] < 15
    off = {f.name: 100 * abs(f.error / f.measured) for f in circle.figures}
    assert set(off) == {"advance", "transfer", "tactical diameter", "time to 90°",
                        "time to 180°", "steady yaw rate", "steady speed"}  # fmt: skip
    assert max(off.values()) < 2
    figures = {f.name: f for f in zigzag.figures}
    # heading extrema of 24.159 at 133.0 s and -18.093 at 275.8: from an independent simulation
    assert degrees(figures["overshoot 1"].measured) == pytest.approx(14.159, abs=0.15)
    assert degrees(figures["overshoot 2"].measured) == pytest.approx(8.093, abs=0.15)
    assert abs(degrees(figures["overshoot 1"].error)) < 1
    assert figures["period"].measured == pytest.approx(2 * (406.2 - 275.8), abs=10)


def test_figures_count_from_where_the_rudder_leaves_its_rest() -> None:
    rudder = np.radians(np.interp(np.arange(100.0), [0, 40, 54, 99], [0.1, 0.1, 35, 35]))
    assert first_order(rudder, 1.0) == 40
    assert first_order(np.zeros(100), 1.0) is None


def test_a_run_without_heading_and_position_is_validated_all_the_same() -> None:
    bare = without(a_log("turning-circle-35", 7, seconds=500.0), "heading", "position")
    (found,) = validate(known_ship().fit, run_of(bare))
    assert {"heading"} & set(found.rms) == set()
    figures = {f.name: f for f in found.figures}
    assert figures["advance"].measured == pytest.approx(1149, rel=0.02)
    assert abs(figures["tactical diameter"].error) < 0.02 * figures["tactical diameter"].measured


@cache
def chosen() -> IdentifiedShip:
    return identify([a_log(seconds=300.0), a_log("zigzag-10-10-port", 2, seconds=300.0)], "auto")


def test_the_model_is_chosen_by_what_it_never_saw() -> None:
    found = chosen()
    assert found.candidates[0].model is found.model
    assert found.model.name in ("burylin", "burylin-tied")
    assert len(found.candidates) == 7
    assert "Models by cross-validation" in sections(found)[0].title


def test_the_best_of_those_that_do_not_run_away_is_taken() -> None:
    first, second, *others = chosen().candidates
    assert _best([first, second, *others]) is first.fit
    assert _best([replace(first, fit=None), second, *others]) is second.fit
    with pytest.raises(LogError, match="every model runs away"):
        _best([replace(first, fit=None)])


def test_t3_known_means_the_tied_form() -> None:
    assert identify([a_log()], known={"T3": 0.5}).model.name == "burylin-tied"
    assert identify([a_log()]).model.name == "burylin"


def test_the_ties_are_advised_where_they_hold_and_not_where_they_do_not() -> None:
    ties = identify([a_log(noise="white"), a_log("zigzag-10-10", 3, noise="white")]).ties
    assert ties is not None
    assert not ties.contradicted
    assert "the data allow them" in ties.advice
    loose = parse_vessel(TOML, "x")
    loose = replace(loose, coefficients=loose.coefficients._replace(b1=-2.6e-4))
    trial = simulate(loose, "zigzag-20-20", duration_secs=500.0, sensors=suite("white"))
    against = identify([as_log(trial)], "burylin-tied", vessel=VESSEL).ties
    assert against is not None
    assert "speak against" in against.advice
    assert identify([a_log()], "nomoto").ties is None


# ---- what is written


def test_the_vessel_file_is_the_ship_that_was_found() -> None:
    found = known_ship()
    text = vessel_toml(found)
    written = parse_vessel(text, "v.toml")
    c = found.model.expand(found.fit.parameters.astype(complex))
    np.testing.assert_allclose(written.coefficients, np.real(c), rtol=1e-12)
    assert written.coefficients.b1 == -written.coefficients.d
    assert (written.rudder_max, written.rudder_rate) == (VESSEL.rudder_max, VESSEL.rudder_rate)
    assert "± " in text
    assert "tied: b1 = -d" in text
    # and she sails as the fit says
    trial = simulate(written, "zigzag-20-20", duration_secs=300.0, sensors=suite("none"))
    (sailed,) = run_of(as_log(trial)).trials
    outputs = predict(found.fit, sailed)
    np.testing.assert_allclose(outputs[:, 0], sailed.measured[:, 0], atol=1e-6)
    np.testing.assert_allclose(outputs[:, 1], sailed.measured[:, 1], atol=1e-5)


def test_what_is_not_identifiable_is_no_number_anywhere() -> None:
    found = identify([a_log("turning-circle-35", 3, seconds=500.0)])
    assert "b1" in found.uncertainty.vague
    assert as_json(found)["coefficients"]["b1"]["value"] is None
    assert "pull-out" in as_json(found)["coefficients"]["b1"]["what_would_tell"]
    (row,) = [row for row in sections(found)[0].rows if row[0] == "b1"]
    assert row[1:4] == ("not identifiable", "", "")
    line = next(line for line in vessel_toml(found).split("\n") if line.startswith("b1"))
    assert "NOT IDENTIFIABLE" in line


# ---- what is refused, and what is flagged


def runs() -> Iterator[tuple[TrialLog, str]]:
    log = a_log()
    yield with_values(log, rudder=0.0), r"the rudder moves by 0\.0° in all"
    yield with_values(log, rudder=radians(5)), r"the rudder moves by 0\.0° in all"
    yield a_log(seconds=10.0), "less than 60 s at a time, too short"
    yield without(log, "rudder"), "no channel 'rudder'.*an identification needs"
    yield with_values(log, rpm=0.0), "at 0 rpm, and a model is of a ship under way"


@pytest.mark.parametrize("number", range(5))
def test_logs_that_cannot_identify_anything_are_refused(number: int) -> None:
    log, said = list(runs())[number]
    for model in ("burylin", "three-dof"):
        with pytest.raises(LogError, match=said):
            identify([log], model)


def test_the_command_line_names_every_model() -> None:
    assert SHIP_MODELS == LADDER


def test_no_logs_no_models_and_no_numbers_are_refused() -> None:
    with pytest.raises(UsageError, match="no log"):
        identify([])
    with pytest.raises(UsageError, match="did you mean 'norrbin'"):
        identify([a_log()], "norbin")
    with pytest.raises(UsageError, match="no parameter 'T4'"):
        identify([a_log()], known={"T4": 1.0})
    with pytest.raises(UsageError, match="finite"):
        identify([a_log()], known={"b3": float("inf")})
    with pytest.raises(UsageError, match="two logs or more"):
        identify([a_log()], "auto")


def test_logs_that_carry_different_ships_are_refused() -> None:
    other = TOML.replace("T1 = 150.0", "T1 = 90.0").replace("Table 1", "Table 2")
    with pytest.raises(LogError, match=r"different ships.*Table 1.*Table 2"):
        identify([a_log(), a_log(toml=other)])
    with pytest.raises(LogError, match="different ships"):
        identify([a_log()], validation_logs=[a_log(toml=LONG)])
    # how a log is filtered is no matter of the ship
    filtered = TOML.replace("process_ratio = 2.5e-5", "process_ratio = 1e-4")
    assert identify([a_log(), a_log(seed=1, toml=filtered)]).vessel == VESSEL


def test_different_ships_that_nobody_told_apart_are_flagged() -> None:
    other = TOML.replace("T1 = 150.0", "T1 = 90.0").replace("T2 = 50.0", "T2 = 40.0")
    mixed = identify([a_log(), a_log(toml=other)], vessel=VESSEL)
    assert any("another ship" in warning for warning in mixed.warnings)
    (slow, _) = a_log(), None
    speed = slow["speed"]
    quick = replace(speed, values=3 * speed.values)
    scaled = replace(slow, channels=tuple(quick if c is speed else c for c in slow.channels))
    flagged = identify([a_log(seed=1), replace(scaled, name="scaled.mcap")])
    assert any("scaled.mcap begins with" in warning for warning in flagged.warnings)


def test_a_contrary_rudder_is_said() -> None:
    log = a_log()
    rudder = log["rudder"]
    turned = replace(rudder, values=-rudder.values)
    contrary = replace(log, channels=tuple(turned if c is rudder else c for c in log.channels))
    assert any("rudder" in w and "port" in w for w in identify([contrary]).warnings)


def test_a_ship_that_runs_away_on_a_held_out_log_is_said() -> None:
    fit = known_ship().fit
    wild = replace(fit, minimum=replace(fit.minimum, unknowns=fit.minimum.unknowns * -40.0))
    (found,) = validate(wild, run_of(a_log()))
    assert isinstance(found, Validation)
    assert found.ran_away
    assert found.figures == ()


def test_a_length_nobody_gave_is_said_and_one_given_is_taken() -> None:
    found = identify([a_log()], "slipstream")
    assert any("no length is known, 150 m" in warning for warning in found.warnings)
    given = identify([a_log(toml=LONG)], "slipstream")
    assert given.fit.problem.scale.secs == pytest.approx(200.0 / given.fit.problem.scale.speed)
    assert not any("length" in warning for warning in given.warnings)
