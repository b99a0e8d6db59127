"""Each model: simulated, identified, written to a vessel file, and simulated again."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from model_ships import LENGTH, SHIPS, toml_of, vessel_of
from trial_logs import as_log

from analysis.identification import vessel_file
from analysis.identification.fit.output_error import fit_problem
from analysis.identification.fit.uncertainty import uncertainty
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.identification.model_selection import Candidate
from analysis.identification.vessel_file import vessel_toml
from analysis.replay.plan import FITTED_MODEL
from analysis.replay.replay import analyse
from analysis.report.identification_json import identification_json
from analysis.report.identification_tables import identification_tables
from recorders.simulated.manoeuvres import manoeuvre
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import compute_trajectory
from shiplog import LogError, TrialLog, Vessel
from shiplog.types import FloatArray
from shiplog.vessel.hull import Hull
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.ship import ship_from_vessel
from shiplog.vessel.vessel_parser import parse_vessel

pytestmark = pytest.mark.usefixtures("fit_alone")
NOISE = {"yaw_rate.white": 7e-5, "speed.white": 0.02, "heading.white": 1e-3, "sway.white": 0.02}
RATES = {f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm", "sway")}
RUNS = ("zigzag-20-20", "pseudo-random", "turning-circle-35-port")
SECOND_ORDER = ("slipstream", "drift-lag", "three-dof")
GEAR = "[rudder]\nmax = 0.6\nrate = 0.04\n"


@cache
def logs_of(name: str) -> tuple[TrialLog, ...]:
    text = toml_of(name) + GEAR
    segments = [
        simulate(parse_vessel(text, name), run, duration_secs=300.0, seed=seed, vessel_toml=text,
                 sensors=suite("white", NOISE | RATES))
        for seed, run in enumerate(RUNS)
    ]  # fmt: skip
    return tuple(as_log(trial, f"{run}.mcap") for trial, run in zip(segments, RUNS, strict=True))


@cache
def identified(name: str) -> tuple[IdentifiedShip, str]:
    """Return the identified ship of a model, and the text of its vessel file."""
    ship = identify(logs_of(name), name)
    return ship, vessel_toml(ship)


@cache
def identified_by_papers_model(name: str) -> IdentifiedShip:
    """Return the paper's model of the logs of another model."""
    return identify(logs_of(name), "burylin")


@cache
def nomoto_ship() -> IdentifiedShip:
    """Return the identified Nomoto ship, with the fit of the paper's model to the same logs."""
    paper, ship = identified_by_papers_model("nomoto"), identified("nomoto")[0]
    return replace(ship, candidates=(Candidate(paper.model, paper.fit, np.zeros((3, 5))),))


def exact_motion(vessel: Vessel, run: str) -> dict[str, FloatArray]:
    trajectory = compute_trajectory(vessel, manoeuvre(run, 400.0, vessel.approach_rpm), 400.0)
    return trajectory.at(np.arange(400.0))


# ---- round trip


@pytest.mark.parametrize("name", SHIPS)
def test_the_intervals_of_each_model_contain_the_true_parameters(name: str) -> None:
    ship, _ = identified(name)
    # in the true scale: the measured speed of the straight run contains noise
    problem = replace(ship.fit.problem, scale=ship_from_vessel(vessel_of(name)).scale)
    whole = fit_problem(problem, start=ship.fit.minimum.unknowns)
    estimates = uncertainty(whole)
    true = np.array([SHIPS[name][parameter] for parameter in estimates.names])
    error = np.abs(estimates.values - true) / estimates.std
    assert error.max() < 3.5, estimates.names[int(error.argmax())]
    assert np.mean(error < 1.96) > 0.8
    assert set(estimates.unidentifiable) <= {"f2"}


@pytest.mark.parametrize("name", SHIPS)
def test_the_file_holds_the_identified_model(name: str) -> None:
    ship, text = identified(name)
    vessel = parse_vessel(text, "v.toml")
    written = ship_from_vessel(vessel)
    assert written.model is ship.model
    assert written.scale == ship.fit.problem.scale
    assert written.coefficients == ship.model.coefficients(ship.fit.parameters)
    assert (vessel.rudder_max, vessel.rudder_rate, vessel.length) == (0.6, 0.04, LENGTH)
    assert f"a = {ship.parameters.get('a')!r}  # ± " in text or name == "three-dof"


@pytest.mark.parametrize("name", SHIPS)
def test_the_identified_ship_manoeuvres_like_the_true_one(name: str) -> None:
    _, text = identified(name)
    true = parse_vessel(toml_of(name) + GEAR, name)
    for run in ("zigzag-10-10", "turning-circle-25"):
        expected, again = exact_motion(true, run), exact_motion(parse_vessel(text, "v.toml"), run)
        for channel, least in (("yaw_rate", 0), ("speed", 0), ("sway", 1e-6)):
            size = np.ptp(expected[channel]) + least
            assert np.abs(again[channel] - expected[channel]).max() < 0.01 * size, channel
        assert np.hypot(*(again["position"] - expected["position"]).T).max() < 15


# ---- the paper's model in the same file


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_the_papers_model_of_the_same_logs_is_written_for_replay(name: str) -> None:
    _, text = identified(name)
    paper = parse_vessel(text, "v.toml").paper_coefficients
    assert "# `shiplog record simulate` uses this model.\n[model]" in text
    assert "The paper's model, fitted to the same logs; `shiplog replay` designs" in text
    alone = identified_by_papers_model(name).fit.parameters
    np.testing.assert_allclose(paper, alone, rtol=1e-9)


@pytest.mark.parametrize("name", [name for name in SHIPS if name not in SECOND_ORDER])
def test_the_papers_model_of_a_first_order_ship_is_stable_and_turns_or_is_absent(name: str) -> None:
    c = parse_vessel(identified(name)[1], "v.toml").coefficients
    assert c is None or (c.d > 0 > c.a)


def test_a_papers_model_with_a_rudder_of_opposite_sign_is_not_written() -> None:
    reversed_log = with_rudder_reversed(logs_of("slipstream")[0])
    turned = replace(identified("slipstream")[0], fit=identify([reversed_log], "slipstream").fit)
    assert parse_vessel(vessel_toml(turned), "v.toml").coefficients is None


@pytest.mark.parametrize("name", SHIPS)
def test_each_model_s_log_is_replayed_with_the_written_file(name: str) -> None:
    log = replace(logs_of(name)[0], vessel_toml=identified(name)[1])
    replayed = analyse(log)
    assert replayed.findings.plan.vessel.model is not None
    yaw, speed = (replayed.signals[n] for n in ("yaw_rate", "speed"))
    for measured, estimated in ((yaw, 0), (speed, 3)):
        error = measured - replayed.estimates.states[:, estimated]
        assert np.nanstd(error[len(error) // 4 :]) < 0.1 * np.nanstd(measured)


def with_rudder_reversed(log: TrialLog) -> TrialLog:
    rudder = log["rudder"]
    turned = replace(rudder, values=-rudder.values)
    return replace(log, channels=tuple(turned if c is rudder else c for c in log.channels))


def test_the_papers_model_among_the_candidates_is_not_fitted_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ship, text = identified("slipstream")
    paper = identified_by_papers_model("slipstream")
    compared = replace(ship, candidates=(Candidate(paper.model, paper.fit, np.zeros((3, 5))),))
    monkeypatch.setattr(vessel_file, "output_error", None)
    assert vessel_toml(compared) == text


def diverges(*_: object, **__: object) -> None:
    raise LogError("the model burylin diverges on these segments")


def test_where_the_papers_model_diverges_the_identified_one_is_written_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(vessel_file, "output_error", diverges)
    text = vessel_toml(identified("norrbin")[0])
    vessel = parse_vessel(text, "v.toml")
    assert vessel.coefficients is None
    assert "cannot be identified from\n# these logs" in text
    assert (vessel.rudder_max, vessel.rudder_rate) == (0.6, 0.04)
    filtered = text + '[filter]\nkind = "extended"\n'
    log = replace(logs_of("norrbin")[0], vessel_toml=filtered)
    replayed = analyse(log)
    assert replayed.findings.plan.model_origin == FITTED_MODEL
    assert replayed.findings.plan.vessel.filter.kind == "extended"
    assert replayed.findings.plan.vessel.name == vessel.name
    assert any(
        "has only a model 'norrbin', but the filters use" in w for w in replayed.findings.warnings
    )
    without = analyse(replace(log, vessel_toml=None), settings={"filter.kind": "extended"})
    assert replayed.findings.plan.vessel.coefficients == without.findings.plan.vessel.coefficients


def test_length_gear_and_alphas_come_from_the_file_a_log_carries() -> None:
    _, text = identified("three-dof")
    carried = text.replace("alpha3 = 0.0654", "alpha3 = 0.05")
    log = replace(logs_of("three-dof")[0], vessel_toml=carried)
    again = identify([log], "slipstream")
    assert again.length_given
    assert again.fit.problem.scale.secs * again.fit.problem.scale.speed == pytest.approx(LENGTH)
    assert again.vessel is not None
    assert again.vessel.rudder_rate == 0.04
    assert identify([log]).fixed["alpha3"] == 0.05
    bare = identify([logs_of("three-dof")[0]])  # its file has a [model] alone
    assert bare.fixed["alpha3"] == 0.0654


def test_the_hull_of_the_logs_is_written_on() -> None:
    ship, _ = identified("three-dof")
    assert ship.vessel is not None
    hull = Hull(breadth=32.0, draught=10.0, propeller_turning="left")
    text = vessel_toml(replace(ship, vessel=replace(ship.vessel, hull=hull)))
    assert parse_vessel(text, "v.toml").hull == hull


# ---- undetermined values


@cache
def without_length() -> IdentifiedShip:
    text = PRESETS["table1"]
    without_sway = {name: rate for name, rate in RATES.items() if not name.startswith("sway")}
    segments = [
        simulate(parse_vessel(text, "x"), run, duration_secs=300.0, seed=1, vessel_toml=text,
                 sensors=suite("none", without_sway))
        for run in RUNS[:2]
    ]  # fmt: skip
    return identify([as_log(trial) for trial in segments], "three-dof")


def test_an_assumed_length_is_marked() -> None:
    text = vessel_toml(without_length())
    (line,) = [line for line in text.split("\n") if line.startswith("length")]
    assert line.startswith("length = 150.0  # m, ASSUMED")
    assert parse_vessel(text, "v.toml").length == 150.0


def test_values_that_are_not_identifiable_are_marked_with_their_origin() -> None:
    ship = without_length()  # no sway was measured
    estimates = ship.uncertainty
    share = np.where(np.array(estimates.names) == "yv", 0.6, 0.1)
    text = vessel_toml(replace(ship, uncertainty=replace(estimates, prior_share=share)))
    own, _, _ = text.partition("[yaw]")
    lines = {line.split(" = ")[0]: line for line in own.split("\n")}
    remark = "NOT IDENTIFIABLE from these logs"
    assert f"{remark}: mostly its prior" in lines["yv"]
    for name in set(estimates.unidentifiable) - {"yv"}:
        assert f"{remark}: one of many values that fit them" in lines[name]


def test_a_model_without_identifiable_parameters_is_written_in_comments() -> None:
    ship = nomoto_ship()
    estimates = ship.uncertainty
    for part, names in (("yaw", ("a", "k")), ("surge", ("f", "g", "h"))):
        std = np.where(np.isin(estimates.names, names), 100.0, estimates.coloured)
        unidentifiable = replace(ship, uncertainty=replace(estimates, std=std, coloured=std))
        text = vessel_toml(unidentifiable)
        assert f"# MISSING: the {part} equation" in text
        assert f"# k = {ship.parameters['k']!r}" in text
        vessel = parse_vessel(text, "v.toml")
        assert (vessel.model, vessel.coefficients) == (None, None)
        assert (vessel.length, vessel.gear_given) == (LENGTH, ("max", "rate"))


def test_a_gear_that_is_not_given_is_not_written() -> None:
    ship = nomoto_ship()
    text = vessel_toml(replace(ship, vessel=Vessel("", None, length=LENGTH)))
    assert "rate =" not in text
    assert "max =" not in text
    assert parse_vessel(text, "v.toml").gear_given == ()


def printed_values(ship: IdentifiedShip) -> dict[str, str]:
    (table,) = (t for t in identification_tables(ship) if t.title.startswith("Parameters"))
    return {row[0]: row[1] for row in table.rows}


def test_every_value_of_a_fit_that_has_not_converged_is_marked() -> None:
    ship = nomoto_ship()
    minimum = replace(ship.fit.minimum, converged=False)
    stopped = replace(ship, fit=replace(ship.fit, minimum=minimum))
    lines = {line.split(" = ")[0]: line for line in vessel_toml(stopped).split("\n")}
    values, converged = printed_values(stopped), printed_values(ship)
    parameters = identification_json(stopped)["parameters"]
    for name in ship.uncertainty.names:
        assert "NOT CONVERGED" in lines[name]
        assert values[name].endswith("(*)")
        assert not parameters[name]["converged"]
        assert "(*)" not in converged[name]


def test_a_model_that_does_not_fit_the_ship_is_written_with_a_caution() -> None:
    ship = nomoto_ship()
    wide = replace(ship.uncertainty, std=np.full(len(ship.uncertainty.names), 100.0))
    text = vessel_toml(replace(ship, uncertainty=wide))
    assert f"k = {ship.parameters['k']!r}  # NOT IDENTIFIABLE from these logs" in text
