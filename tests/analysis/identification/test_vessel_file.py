"""Any model of the ladder: simulated, identified, written, and simulated again."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from model_ships import LENGTH, SHIPS, toml_of, vessel_of
from trial_logs import as_log

from analysis.identification import vessel_file
from analysis.identification.identify import IdentifiedShip, identify
from analysis.identification.model_selection import Candidate
from analysis.identification.output_error import fit_problem
from analysis.identification.uncertainty import uncertainty
from analysis.identification.vessel_file import vessel_toml
from analysis.replay.plan import FITTED_MODEL
from analysis.replay.replay import analyse
from recorders.simulated.manoeuvres import manoeuvre
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import compute_trajectory
from shiplog import LogError, TrialLog, Vessel
from shiplog.types import FloatArray
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.ship import ship_from_vessel
from shiplog.vessel.vessel_parser import parse_vessel

NOISE = {"yaw_rate.white": 1e-4, "speed.white": 0.03, "heading.white": 1e-3, "sway.white": 0.03}
RUNS = ("zigzag-20-20", "pseudo-random", "turning-circle-35-port")
SECOND_ORDER = ("slipstream", "drift-lag", "three-dof")
GEAR = "[rudder]\nmax = 0.6\nrate = 0.04\n"


@cache
def logs_of(name: str) -> tuple[TrialLog, ...]:
    text = toml_of(name) + GEAR
    segments = [
        simulate(parse_vessel(text, name), run, duration_secs=300.0, seed=seed, vessel_toml=text,
                 sensors=suite("white", NOISE))
        for seed, run in enumerate(RUNS)
    ]  # fmt: skip
    return tuple(as_log(trial, f"{run}.mcap") for trial, run in zip(segments, RUNS, strict=True))


@cache
def found_of(name: str) -> tuple[IdentifiedShip, str]:
    found = identify(logs_of(name), name)
    return found, vessel_toml(found)


def truth(vessel: Vessel, run: str) -> dict[str, FloatArray]:
    voyage = compute_trajectory(vessel, manoeuvre(run, 400.0, vessel.approach_rpm), 400.0)
    return voyage.at(np.arange(400.0))


# ---- there and back


@pytest.mark.parametrize("name", SHIPS)
def test_a_simulated_ship_of_any_model_is_found_within_her_intervals(name: str) -> None:
    found, _ = found_of(name)
    # in her own units: the speed of the straight run, as measured, is off by its noise
    whole = fit_problem(replace(found.fit.problem, scale=ship_from_vessel(vessel_of(name)).scale))
    told = uncertainty(whole)
    true = np.array([SHIPS[name][parameter] for parameter in told.names])
    off = np.abs(told.values - true) / told.std
    assert off.max() < 3.5, told.names[int(off.argmax())]
    assert np.mean(off < 1.96) > 0.8
    assert set(told.unidentifiable) <= {"f2"}


@pytest.mark.parametrize("name", SHIPS)
def test_the_file_is_the_ship_that_was_found(name: str) -> None:
    found, text = found_of(name)
    vessel = parse_vessel(text, "v.toml")
    ship = ship_from_vessel(vessel)
    assert ship.model is found.model
    assert ship.scale == found.fit.problem.scale
    assert ship.coefficients == found.model.coefficients(found.fit.parameters)
    assert (vessel.rudder_max, vessel.rudder_rate, vessel.length) == (0.6, 0.04, LENGTH)
    assert f"a = {found.coefficients.get('a')!r}  # ± " in text or name == "three-dof"


@pytest.mark.parametrize("name", SHIPS)
def test_the_ship_that_was_found_sails_as_the_true_one_does_what_neither_saw(name: str) -> None:
    _, text = found_of(name)
    true = parse_vessel(toml_of(name) + GEAR, name)
    for run in ("zigzag-10-10", "turning-circle-25"):
        expected, again = truth(true, run), truth(parse_vessel(text, "v.toml"), run)
        for channel, least in (("yaw_rate", 0), ("speed", 0), ("sway", 1e-6)):
            size = np.ptp(expected[channel]) + least
            assert np.abs(again[channel] - expected[channel]).max() < 0.01 * size, channel
        assert np.hypot(*(again["position"] - expected["position"]).T).max() < 15


# ---- what stands beside it


@pytest.mark.parametrize("name", SECOND_ORDER)
def test_the_papers_model_of_the_same_logs_stands_beside_it_for_replay(name: str) -> None:
    _, text = found_of(name)
    paper = parse_vessel(text, "v.toml").paper_coefficients
    assert "# what `record simulate` sails\n[model]" in text
    assert "What `replay` filters by: the paper's model, fitted to the same logs" in text
    alone = identify(logs_of(name), "burylin").fit.parameters
    np.testing.assert_allclose(paper, alone, rtol=1e-9)


@pytest.mark.parametrize("name", ["nomoto", "norrbin"])
def test_the_papers_model_of_a_ship_of_the_first_order_is_one_that_turns_or_none(name: str) -> None:
    c = parse_vessel(found_of(name)[1], "v.toml").coefficients
    assert c is None or (c.d > 0 > c.a)


def test_a_papers_model_whose_rudder_acts_to_the_other_side_is_left_out() -> None:
    contrary = with_rudder_turned(logs_of("slipstream")[0])
    turned = replace(found_of("slipstream")[0], fit=identify([contrary], "slipstream").fit)
    assert parse_vessel(vessel_toml(turned), "v.toml").coefficients is None


@pytest.mark.parametrize("name", SHIPS)
def test_every_ships_log_is_replayed_by_the_file_that_was_written(name: str) -> None:
    log = replace(logs_of(name)[0], vessel_toml=found_of(name)[1])
    replayed = analyse(log)
    assert replayed.findings.plan.vessel.model is not None
    yaw, speed = (replayed.signals[n] for n in ("yaw_rate", "speed"))
    for measured, estimated in ((yaw, 0), (speed, 3)):
        off = measured - replayed.estimates.states[:, estimated]
        assert np.nanstd(off[len(off) // 4 :]) < 0.1 * np.nanstd(measured)


def with_rudder_turned(log: TrialLog) -> TrialLog:
    rudder = log["rudder"]
    turned = replace(rudder, values=-rudder.values)
    return replace(log, channels=tuple(turned if c is rudder else c for c in log.channels))


def test_the_papers_model_that_was_compared_is_not_fitted_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, text = found_of("slipstream")
    paper = identify(logs_of("slipstream"), "burylin")
    compared = replace(found, candidates=(Candidate(paper.model, paper.fit, np.zeros((3, 4))),))
    monkeypatch.setattr(vessel_file, "output_error", None)
    assert vessel_toml(compared) == text


def runs_away(*_: object, **__: object) -> None:
    raise LogError("the model burylin runs away on these segments")


def test_where_the_papers_model_runs_away_her_own_stands_alone_and_is_replayed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(vessel_file, "output_error", runs_away)
    text = vessel_toml(found_of("norrbin")[0])
    vessel = parse_vessel(text, "v.toml")
    assert vessel.coefficients is None
    assert "cannot be identified from these logs" in text
    assert (vessel.rudder_max, vessel.rudder_rate) == (0.6, 0.04)
    filtered = text + '[filter]\nkind = "extended"\n'
    log = replace(logs_of("norrbin")[0], vessel_toml=filtered)
    replayed = analyse(log)
    assert replayed.findings.plan.model_origin == FITTED_MODEL
    assert replayed.findings.plan.vessel.filter.kind == "extended"
    assert replayed.findings.plan.vessel.name == vessel.name
    assert any(
        "has norrbin alone, and filters are built on" in w for w in replayed.findings.warnings
    )
    without = analyse(replace(log, vessel_toml=None), settings={"filter.kind": "extended"})
    assert replayed.findings.plan.vessel.coefficients == without.findings.plan.vessel.coefficients


def test_a_log_that_carries_such_a_file_gives_length_gear_and_alphas() -> None:
    _, text = found_of("three-dof")
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


# ---- what is not known


@cache
def without_length() -> IdentifiedShip:
    text = PRESETS["table1"]
    segments = [
        simulate(parse_vessel(text, "x"), run, duration_secs=300.0, seed=1, vessel_toml=text)
        for run in RUNS[:2]
    ]
    return identify([as_log(trial) for trial in segments], "three-dof")


def test_a_length_that_was_assumed_is_written_and_said() -> None:
    text = vessel_toml(without_length())
    (line,) = [line for line in text.split("\n") if line.startswith("length")]
    assert line.startswith("length = 150.0  # m, ASSUMED")
    assert parse_vessel(text, "v.toml").length == 150.0


def test_what_was_not_told_is_marked_and_what_was_believed_before() -> None:
    found = without_length()  # no sway was measured
    told, share = found.uncertainty, np.where(np.array(found.uncertainty.names) == "yv", 0.6, 0.1)
    own, _, _ = vessel_toml(replace(found, uncertainty=replace(told, prior_share=share))).partition(
        "[yaw]"
    )
    lines = {line.split(" = ")[0]: line for line in own.split("\n")}
    assert lines["yv"].endswith("NOT IDENTIFIABLE from these logs: believed before, for the most")
    for name in set(told.unidentifiable) - {"yv"}:
        assert lines[name].endswith("NOT IDENTIFIABLE from these logs: a value that fits them")


def test_numbers_that_nobody_knows_are_not_written() -> None:
    found, _ = found_of("nomoto")
    told = found.uncertainty
    for part, names in (("yaw", ("a", "k")), ("surge", ("f", "g", "h"))):
        std = np.where(np.isin(told.names, names), 100.0, told.coloured)
        unidentifiable = replace(found, uncertainty=replace(told, std=std, coloured=std))
        with pytest.raises(LogError, match=f"nothing of the {part} is identifiable"):
            vessel_toml(unidentifiable)


def test_a_model_that_is_not_the_ship_is_written_with_a_caution() -> None:
    found, _ = found_of("nomoto")
    wide = replace(found.uncertainty, std=np.full(len(found.uncertainty.names), 100.0))
    text = vessel_toml(replace(found, uncertainty=wide))
    assert f"k = {found.coefficients['k']!r}  # NOT IDENTIFIABLE from these logs" in text
