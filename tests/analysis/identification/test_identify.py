"""Identification from logs to vessel file: results, rejected input, warnings."""

import pickle
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from functools import cache
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import STEPS, identify
from analysis.identification.model_selection import rank_models
from analysis.identification.prediction import predict
from analysis.identification.runs import run_from_log
from analysis.identification.vessel_file import vessel_toml
from analysis.replay.reading_options import ReadingOptions
from analysis.report.identification_json import identification_json
from analysis.report.identification_tables import identification_tables
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Channel, LogError, TrialLog, UsageError, load_vessel, write
from shiplog.ships import ship_model
from shiplog.vessel.vessel import with_length
from shiplog.vessel.vessel_parser import parse_vessel

pytestmark = pytest.mark.usefixtures("fit_alone")
VESSEL, TOML = load_vessel("table1")
RATES = {f"{name}.rate_hz": 5.0 for name in ("yaw_rate", "speed", "rudder", "rpm", "heading")}
LONG = TOML.replace("angle_unit", "length = 200.0\nangle_unit", 1)


@cache
def a_log(
    manoeuvre: str = "zigzag-20-20", seed: int = 0, noise: str = "paper", seconds: float = 400.0,
    toml: str | None = TOML,
) -> TrialLog:  # fmt: skip
    vessel = parse_vessel(toml, "here") if toml else VESSEL
    sensors = suite(noise, RATES)
    trial = simulate(
        vessel, manoeuvre, duration_secs=seconds, seed=seed, sensors=sensors, vessel_toml=toml
    )
    return as_log(trial, f"{manoeuvre}-{seed}.mcap")


@cache
def tied_ship() -> IdentifiedShip:
    validation_logs = [
        a_log("turning-circle-35", 7, seconds=500.0),
        a_log("zigzag-10-10", 8, seconds=600),
    ]
    return identify(
        [a_log(), a_log(seed=1)], "burylin-tied", fixed={"T3": 0.5}, validation_logs=validation_logs
    )


def without(log: TrialLog, *names: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name not in names))


def with_values(log: TrialLog, **values: float) -> TrialLog:
    """Return the log with constant values in some channels."""
    channels = [
        replace(c, values=np.full(len(c), values[c.name])) if c.name in values else c
        for c in log.channels
    ]
    return replace(log, channels=tuple(channels))


# ---- results


def test_intervals_from_several_logs_contain_the_true_parameters() -> None:
    ship, truth = tied_ship(), VESSEL.coefficients._asdict()
    for name, (low, high) in zip(ship.uncertainty.names, ship.uncertainty.interval, strict=True):
        middle = (low + high) / 2
        assert abs(truth[name] - middle) < 1.6 * (high - low) / 2, name
    assert ship.parameters["d"] == pytest.approx(truth["d"], rel=2e-3)
    assert ship.fixed == {"T3": 0.5, "alpha1": 0.0171, "alpha2": 0.0015, "alpha3": 0.0654}
    assert ship.identifiable == ship.uncertainty.names
    assert [run.name for run in ship.runs] == ["zigzag-20-20-0.mcap", "zigzag-20-20-1.mcap"]
    assert ship.warnings == ()


def test_validation_logs_are_predicted_with_manoeuvring_indices() -> None:
    circle, zigzag = tied_ship().validations
    assert circle.rms["yaw_rate"] < radians(0.02)
    assert circle.rms["track"] < 15
    errors = {f.name: 100 * abs(f.error / f.measured) for f in circle.indices}
    assert set(errors) == {"advance", "transfer", "tactical diameter", "time to 90°",
                        "time to 180°", "steady yaw rate", "steady speed"}  # fmt: skip
    assert max(errors.values()) < 2
    indices = {f.name: f for f in zigzag.indices}
    # heading extrema of 24.159 at 133.0 s and -18.093 at 275.8: from an independent simulation
    assert degrees(indices["overshoot 1"].measured) == pytest.approx(14.159, abs=0.15)
    assert degrees(indices["overshoot 2"].measured) == pytest.approx(8.093, abs=0.15)
    assert abs(degrees(indices["overshoot 1"].error)) < 1
    assert indices["period"].measured == pytest.approx(2 * (406.2 - 275.8), abs=10)


def test_a_fixed_t3_selects_the_tied_form() -> None:
    log = a_log(seconds=200.0)
    assert identify([log], fixed={"T3": 0.5}).model.name == "burylin-tied"
    assert identify([log]).model.name == "burylin"


def test_ties_are_consistent_with_data_of_a_tied_ship_and_contradicted_by_others() -> None:
    ties = identify([a_log(noise="white"), a_log("zigzag-10-10", 3, noise="white")]).ties
    assert ties is not None
    assert not ties.contradicted
    assert "consistent with the data" in ties.advice(tied=False)
    untied = parse_vessel(TOML, "x")
    untied = replace(untied, coefficients=untied.coefficients._replace(b1=-2.6e-4))
    trial = simulate(untied, "zigzag-20-20", duration_secs=500.0, sensors=suite("white"))
    contradicted = identify([as_log(trial)], "burylin-tied", options=ReadingOptions(VESSEL)).ties
    assert contradicted is not None
    assert "contradicted by the data" in contradicted.advice(tied=False)
    assert identify([a_log()], "nomoto").ties is None


# ---- vessel file


def test_the_vessel_file_holds_the_identified_ship() -> None:
    ship = tied_ship()
    text = vessel_toml(ship)
    written = parse_vessel(text, "v.toml")
    c = ship.model.expand(ship.fit.parameters.astype(complex))
    np.testing.assert_allclose(written.coefficients, np.real(c), rtol=1e-12)
    assert written.coefficients.b1 == -written.coefficients.d
    assert (written.rudder_max, written.rudder_rate) == (VESSEL.rudder_max, VESSEL.rudder_rate)
    assert "± " in text
    assert "tied: b1 = -d" in text
    # its simulation equals the prediction of the fit, but for the rudder zero of the logs
    unknowns = ship.fit.minimum.unknowns.copy()
    unknowns[len(ship.fit.problem.free)] = 0.0
    fit = replace(ship.fit, minimum=replace(ship.fit.minimum, unknowns=unknowns))
    trial = simulate(written, "zigzag-20-20", duration_secs=300.0, sensors=suite("none"))
    (simulated,) = run_from_log(as_log(trial)).segments
    outputs = predict(fit, simulated)
    np.testing.assert_allclose(outputs[:, 0], simulated.measured[:, 0], atol=1e-6)
    np.testing.assert_allclose(outputs[:, 1], simulated.measured[:, 1], atol=1e-5)


def test_a_parameter_that_is_not_identifiable_has_no_value_in_tables_and_json() -> None:
    ship = identify([a_log("turning-circle-35", 3, seconds=500.0)])
    assert "b1" in ship.uncertainty.unidentifiable
    assert identification_json(ship)["parameters"]["b1"]["value"] is None
    assert "pull-out" in identification_json(ship)["parameters"]["b1"]["recommended_manoeuvre"]
    (row,) = [row for row in identification_tables(ship)[0].rows if row[0] == "b1"]
    assert row[1:4] == ("not identifiable", "", "")
    line = next(line for line in vessel_toml(ship).split("\n") if line.startswith("b1"))
    assert "NOT IDENTIFIABLE" in line


# ---- rejected input, and warnings


def useless_logs() -> Iterator[tuple[TrialLog, str]]:
    log = a_log()
    yield with_values(log, rudder=0.0), r"the rudder moves by 0\.0° in all"
    yield with_values(log, rudder=radians(5)), r"the rudder moves by 0\.0° in all"
    yield a_log(seconds=10.0), "less than 60 s at a time, too short"
    yield without(log, "rudder"), "no channel 'rudder'.*an identification needs"
    yield with_values(log, rpm=0.0), "at 0 rpm, but the models describe a ship under way"


@pytest.mark.parametrize("number", range(5))
def test_logs_that_identify_no_parameter_are_rejected(number: int) -> None:
    log, message = list(useless_logs())[number]
    for model in ("burylin", "three-dof"):
        with pytest.raises(LogError, match=message):
            identify([log], model)


def test_missing_logs_unknown_models_and_bad_numbers_are_rejected() -> None:
    with pytest.raises(UsageError, match="no log"):
        identify([])
    with pytest.raises(UsageError, match="did you mean 'norrbin'"):
        identify([a_log()], "norbin")
    with pytest.raises(UsageError, match="no parameter 'T4'"):
        identify([a_log()], fixed={"T4": 1.0})
    with pytest.raises(UsageError, match="finite"):
        identify([a_log()], fixed={"b3": float("inf")})
    with pytest.raises(UsageError, match="two logs or more"):
        identify([a_log()], "auto")


def test_logs_that_carry_different_ships_are_rejected() -> None:
    other = TOML.replace("T1 = 150.0", "T1 = 90.0").replace("Table 1", "Table 2")
    with pytest.raises(LogError, match=r"different ships.*Table 1.*Table 2"):
        identify([a_log(), a_log(seed=1, toml=other)])
    with pytest.raises(LogError, match="different ships"):
        identify([a_log()], validation_logs=[a_log(seed=1, toml=LONG)])
    # filter settings do not make another ship
    filtered = TOML.replace("process_ratio = 2.5e-5", "process_ratio = 1e-4")
    assert identify([a_log(), a_log(seed=1, toml=filtered)], "nomoto").vessel == VESSEL


def test_logs_of_different_ships_under_one_vessel_file_give_a_warning() -> None:
    other = TOML.replace("T1 = 150.0", "T1 = 90.0").replace("T2 = 50.0", "T2 = 40.0")
    mixed = identify([a_log(), a_log(toml=other)], options=ReadingOptions(VESSEL))
    assert any("another ship" in warning for warning in mixed.warnings)
    log = a_log()
    speed = log["speed"]
    faster = replace(speed, values=3 * speed.values)
    scaled = replace(log, channels=tuple(faster if c is speed else c for c in log.channels))
    inconsistent = identify([a_log(seed=1), replace(scaled, name="scaled.mcap")], "nomoto")
    assert any("scaled.mcap starts with" in warning for warning in inconsistent.warnings)


def test_a_rudder_of_opposite_sign_gives_a_warning() -> None:
    log = a_log()
    rudder = log["rudder"]
    turned = replace(rudder, values=-rudder.values)
    reversed_log = replace(log, channels=tuple(turned if c is rudder else c for c in log.channels))
    assert any("rudder" in w and "port" in w for w in identify([reversed_log]).warnings)


def test_an_assumed_length_gives_a_warning_and_a_given_one_is_used() -> None:
    ship = identify([a_log(seconds=200.0)], "slipstream")
    assert any("length is not given; 150 m" in warning for warning in ship.warnings)
    given = identify([a_log(toml=LONG, seconds=200.0)], "slipstream")
    assert given.fit.problem.scale.secs == pytest.approx(200.0 / given.fit.problem.scale.speed)
    assert not any("length" in warning for warning in given.warnings)


def with_gaps(log: TrialLog, channel: str, *spans: tuple[float, float]) -> TrialLog:
    """Return the log with a channel's values NaN over some spans of seconds."""

    def cut(c: Channel) -> Channel:
        at, values = (c.measured_ns - c.measured_ns[0]) * 1e-9, c.values.copy()
        for start, end in spans:
            values[(at >= start) & (at < end)] = np.nan
        return replace(c, values=values)

    return replace(log, channels=tuple(cut(c) if c.name == channel else c for c in log.channels))


def test_segments_of_one_log_are_not_counted_as_runs() -> None:
    log = a_log(seed=1, noise="white", seconds=900.0)
    ship = identify([with_gaps(log, "rudder", (170, 200), (400, 430), (600, 640))], "burylin")
    assert len(ship.fit.problem.segments) == 4
    assert np.isnan(ship.uncertainty.between_runs).all()
    assert not any("contradict" in warning for warning in ship.warnings)
    np.testing.assert_array_less(ship.uncertainty.std, 2 * ship.uncertainty.bound)
    with pytest.raises(UsageError, match="two logs or more"):
        identify([with_gaps(log, "rudder", (400, 430))], "auto")


@pytest.mark.parametrize("rate", [5.0, 1.0])
def test_a_slow_speed_log_widens_intervals_only_by_its_fewer_samples(rate: float) -> None:
    vessel, toml = load_vessel("table1")
    sensors = suite("paper", {"speed.rate_hz": rate})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=400.0, seed=6, sensors=sensors,
                     vessel_toml=toml)  # fmt: skip
    ship = identify([as_log(trial, "slow.mcap")], fixed={"T3": 0.5})
    truth = vessel.coefficients._asdict()
    for name, value, std in zip(
        ship.uncertainty.names, ship.uncertainty.values, ship.uncertainty.std, strict=True
    ):
        assert abs(value - truth[name]) < 3.5 * std
        assert std < 0.06 * abs(truth[name])
    speed = ship.fit.noises[ship.fit.problem.outputs.index("speed")]
    assert 0.09 < speed.white < 0.14  # 0.2 m/s, uniform


def test_a_swell_is_detected_in_one_log_although_another_has_none() -> None:
    ship = identify([a_log(), a_log(seed=1, noise="white")], "burylin")
    assert [len(run.wave_secs) for run in ship.runs] == [1, 0]
    assert ship.runs[0].wave_secs[0] == pytest.approx(62.8, rel=0.02)


def test_the_same_data_under_two_names_are_rejected() -> None:
    copy = replace(a_log(), name="copy.mcap")
    for fitted, validation_logs in (([a_log(), copy], []), ([a_log()], [copy])):
        with pytest.raises(UsageError, match=r"hold the same data.*zigzag-20-20-0.*copy"):
            identify(fitted, validation_logs=validation_logs)


def test_logs_of_one_name_are_numbered() -> None:
    logs = [replace(a_log(seed=seed, seconds=200.0), name="a.mcap") for seed in (0, 1)]
    ship = identify(logs, "nomoto")
    assert [run.name for run in ship.runs] == ["a.mcap", "a.mcap (2)"]


def test_two_approach_speeds_are_the_same_ship() -> None:
    slow = TOML.replace("approach_rpm = 80.0", "approach_rpm = 60.0")
    ship = identify([a_log(seconds=200.0), a_log(seed=1, seconds=200.0, toml=slow)], "nomoto")
    assert ship.vessel is not None


def test_a_constant_yaw_rate_is_rejected() -> None:
    with pytest.raises(LogError, match="yaw rate never changes"):
        identify([with_values(a_log(), yaw_rate=0.0)])


def test_fixing_every_parameter_is_rejected() -> None:
    everything = VESSEL.coefficients._asdict()
    with pytest.raises(UsageError, match="none is estimated; fix fewer"):
        identify([a_log()], "burylin", fixed=everything)


def test_a_fixed_parameter_with_different_units_among_the_models_is_rejected() -> None:
    with pytest.raises(UsageError, match="T3 is in 1 or s"):
        identify([a_log(), a_log(seed=1)], "auto", fixed={"T3": 0.5})


def test_a_parameter_near_zero_is_identifiable() -> None:
    """b1 of a ship at the margin of stability."""
    marginal = TOML.replace("T1 = 150.0\n", "").replace("T2 = 50.0", "a = -0.026667").replace(
        "T3 = 0.5", "b1 = 0.0\nb2 = -0.0013333\nb3 = -0.0026667\nd = 1.33333e-4\ne = 6.66667e-5"
    )  # fmt: skip
    marginal = "\n".join(
        line for line in marginal.splitlines() if not line.startswith(("T1", "c2", "c3"))
    )
    logs = [
        a_log(manoeuvre, i, "white", 600.0, marginal)
        for i, manoeuvre in enumerate(("zigzag-10-10", "zigzag-20-20", "pull-out-20"))
    ]
    estimates = identify(logs, "burylin").uncertainty
    i = estimates.names.index("b1")
    assert "b1" not in estimates.unidentifiable
    assert abs(estimates.values[i]) < 2.5 * estimates.std[i] < 2e-5


@pytest.mark.parametrize("missing", ["sway", "heading"])
def test_a_channel_missing_in_one_run_is_fitted_in_the_others(missing: str) -> None:
    one, other = (a_log(seed=seed, seconds=200.0) for seed in (0, 1))
    speed = other["speed"]
    sway = replace(speed, name="sway", values=np.zeros(len(speed)))
    whole = replace(one, channels=(*one.channels, sway))
    ship = identify([whole, without(other, missing)], "slipstream")
    assert missing in ship.fit.problem.outputs
    assert np.isfinite(ship.fit.parameters).all()


def test_a_segment_without_speed_is_fitted_with_the_others() -> None:
    log = with_gaps(a_log(seed=1, noise="white"), "speed", (200, 401))
    ship = identify([with_gaps(log, "rudder", (190, 210))], "slipstream")
    assert len(ship.fit.problem.segments) == 2
    assert np.isfinite(ship.fit.parameters).all()


def test_a_validation_run_that_begins_with_the_engine_stopped_is_simulated() -> None:
    log = a_log(seed=2, noise="white")
    rpm = log["rpm"]
    values = np.where(rpm.measured_ns - rpm.measured_ns[0] < 30e9, 0.0, rpm.values)
    stopped = replace(
        log, channels=tuple(replace(c, values=values) if c is rpm else c for c in log.channels)
    )
    assert identify([a_log()], validation_logs=[stopped]).validations


def test_differing_halves_of_a_single_log_are_named_halves() -> None:
    ship = identify([a_log(seconds=600.0)], "nomoto")
    contradictions = [w for w in ship.warnings if "contradict" in w]
    assert all(w.startswith("the halves of zigzag-20-20-0.mcap contradict") for w in contradictions)


def test_identifier_settings_do_not_make_another_ship() -> None:
    windowed = TOML + "\n[identifier]\nwindow_secs = 300.0\n"
    logs = [a_log(seconds=200.0), a_log(seed=1, seconds=200.0, toml=windowed)]
    assert identify(logs, "nomoto").vessel is not None


def test_a_fixed_parameter_must_lie_within_the_model_s_limits() -> None:
    with pytest.raises(UsageError, match=r"a3 must be a finite number from -inf to 0, got 0\.5"):
        identify([a_log()], "norrbin", fixed={"a3": 0.5})


# ---- the public function


def test_a_result_pickles_and_copies() -> None:
    ship = tied_ship()
    for again in (pickle.loads(pickle.dumps(ship)), deepcopy(ship)):  # noqa: S301 - our own
        assert again.parameters == ship.parameters
        assert again.model.name == ship.model.name
        assert identification_tables(again) == identification_tables(ship)
        np.testing.assert_array_equal(again.covariance, ship.covariance)


def test_logs_are_given_as_one_or_several_objects_or_paths(tmp_path: Path) -> None:
    log, other = a_log(seconds=200.0), a_log(seed=1, seconds=200.0)
    path = tmp_path / "a.mcap"
    write(log, path)
    one = identify([log], "nomoto").parameters
    for given in (log, path, str(path), [path]):
        assert identify(given, "nomoto").parameters == pytest.approx(one, rel=1e-6)
    both = identify([path, other], "nomoto", validation_logs=a_log(seed=2, seconds=200.0))
    assert len(both.runs) == 2
    assert len(both.validations) == 1


def test_a_model_is_given_by_name_or_as_an_object() -> None:
    log = a_log(seconds=200.0)
    assert identify(log, ship_model("nomoto")).parameters == identify(log, "nomoto").parameters


def test_progress_goes_from_0_to_1_and_names_models_and_runs() -> None:
    steps: list[tuple[str, float]] = []

    def on_progress(step: str, share: float | None = None, /) -> None:
        assert share is not None
        steps.append((step, share))

    logs = [a_log(seconds=200.0), a_log("zigzag-10-10", 1, seconds=200.0)]
    identify(logs, "nomoto", on_progress=on_progress)
    compared = [f"model 1 of 1 (nomoto), {run}" for run in ("all runs", "run 1 of 2", "run 2 of 2")]
    assert list(dict(steps)) == [*STEPS[:2], *compared, *STEPS[2:]]
    segments = [segment for log in logs for segment in run_from_log(log).segments]
    del steps[:]
    rank_models(segments, [ship_model("nomoto"), ship_model("norrbin")], on_progress=on_progress)
    assert {step for step, _ in steps} == {
        f"model {i + 1} of 2 ({name}), {run}"
        for i, name in enumerate(("norrbin", "nomoto"))  # the one with more parameters first
        for run in ("all runs", "run 1 of 2", "run 2 of 2")
    }
    shares = [share for _, share in steps]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_models_are_ranked_the_same_by_one_thread_and_by_two() -> None:
    logs = [a_log(seconds=200.0), a_log("zigzag-10-10", 1, seconds=200.0)]
    segments = [segment for log in logs for segment in run_from_log(log).segments]
    models = [ship_model(name) for name in ("nomoto", "norrbin", "burylin-tied")]
    one, two = (
        rank_models(segments, models, vessel=with_length(None, 150.0), threads=k) for k in (1, 2)
    )
    for a, b in zip(one, two, strict=True):
        assert a.model is b.model
        assert a.score == b.score
        np.testing.assert_array_equal(a.misfits, b.misfits)
        assert a.fit is not None
        assert b.fit is not None
        np.testing.assert_array_equal(a.fit.parameters, b.fit.parameters)
