"""CoefficientFit from logs to vessel file: what is found, what is refused, what is said."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from math import degrees, radians

import numpy as np
import pytest
from trial_logs import as_log

from analysis.identification.identify import IdentifiedShip, _best, identify
from analysis.identification.prediction import predict
from analysis.identification.runs import run_from_log
from analysis.identification.vessel_file import vessel_toml
from analysis.report.identification_json import identification_json
from analysis.report.identification_tables import identification_tables
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import Channel, LogError, TrialLog, UsageError, load_vessel
from shiplog.vessel.vessel_parser import parse_vessel

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
        [a_log(), a_log(seed=1)], "burylin-tied", fixed={"T3": 0.5}, validation_logs=held_out
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
    assert found.fixed == {"T3": 0.5, "alpha1": 0.0171, "alpha2": 0.0015, "alpha3": 0.0654}
    assert found.identifiable == found.uncertainty.names
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


@cache
def chosen() -> IdentifiedShip:
    return identify([a_log(seconds=300.0), a_log("zigzag-10-10-port", 2, seconds=300.0)], "auto")


def test_the_model_is_chosen_by_what_it_never_saw() -> None:
    found = chosen()
    assert found.candidates[0].model is found.model
    assert found.model.name in ("burylin", "burylin-tied")
    assert len(found.candidates) == 7
    assert "Models by cross-validation" in identification_tables(found)[0].title


def test_the_best_of_those_that_do_not_run_away_is_taken() -> None:
    first, second, *others = chosen().candidates
    assert _best([first, second, *others]) is first.fit
    assert _best([replace(first, fit=None), second, *others]) is second.fit
    with pytest.raises(LogError, match="every model runs away"):
        _best([replace(first, fit=None)])


def test_t3_known_means_the_tied_form() -> None:
    assert identify([a_log()], fixed={"T3": 0.5}).model.name == "burylin-tied"
    assert identify([a_log()]).model.name == "burylin"


def test_the_ties_are_advised_where_they_hold_and_not_where_they_do_not() -> None:
    ties = identify([a_log(noise="white"), a_log("zigzag-10-10", 3, noise="white")]).ties
    assert ties is not None
    assert not ties.contradicted
    assert "the data allow them" in ties.advice(tied=False)
    loose = parse_vessel(TOML, "x")
    loose = replace(loose, coefficients=loose.coefficients._replace(b1=-2.6e-4))
    trial = simulate(loose, "zigzag-20-20", duration_secs=500.0, sensors=suite("white"))
    against = identify([as_log(trial)], "burylin-tied", vessel=VESSEL).ties
    assert against is not None
    assert "speak against" in against.advice(tied=False)
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
    (sailed,) = run_from_log(as_log(trial)).segments
    outputs = predict(found.fit, sailed)
    np.testing.assert_allclose(outputs[:, 0], sailed.measured[:, 0], atol=1e-6)
    np.testing.assert_allclose(outputs[:, 1], sailed.measured[:, 1], atol=1e-5)


def test_what_is_not_identifiable_is_no_number_anywhere() -> None:
    found = identify([a_log("turning-circle-35", 3, seconds=500.0)])
    assert "b1" in found.uncertainty.unidentifiable
    assert identification_json(found)["coefficients"]["b1"]["value"] is None
    assert "pull-out" in identification_json(found)["coefficients"]["b1"]["what_would_tell"]
    (row,) = [row for row in identification_tables(found)[0].rows if row[0] == "b1"]
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


def test_no_logs_no_models_and_no_numbers_are_refused() -> None:
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


def test_logs_that_carry_different_ships_are_refused() -> None:
    other = TOML.replace("T1 = 150.0", "T1 = 90.0").replace("Table 1", "Table 2")
    with pytest.raises(LogError, match=r"different ships.*Table 1.*Table 2"):
        identify([a_log(), a_log(seed=1, toml=other)])
    with pytest.raises(LogError, match="different ships"):
        identify([a_log()], validation_logs=[a_log(seed=1, toml=LONG)])
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


def test_a_length_nobody_gave_is_said_and_one_given_is_taken() -> None:
    found = identify([a_log()], "slipstream")
    assert any("no length is known, 150 m" in warning for warning in found.warnings)
    given = identify([a_log(toml=LONG)], "slipstream")
    assert given.fit.problem.scale.secs == pytest.approx(200.0 / given.fit.problem.scale.speed)
    assert not any("length" in warning for warning in given.warnings)


def with_gaps(log: TrialLog, channel: str, *spans: tuple[float, float]) -> TrialLog:
    """The log without what a channel measured over some spans of seconds."""

    def cut(c: Channel) -> Channel:
        at, values = (c.measured_ns - c.measured_ns[0]) * 1e-9, c.values.copy()
        for start, end in spans:
            values[(at >= start) & (at < end)] = np.nan
        return replace(c, values=values)

    return replace(log, channels=tuple(cut(c) if c.name == channel else c for c in log.channels))


def test_pieces_of_a_log_are_no_runs_of_their_own() -> None:
    log = a_log(seed=1, noise="white", seconds=900.0)
    found = identify([with_gaps(log, "rudder", (170, 200), (400, 430), (600, 640))], "burylin")
    assert len(found.fit.problem.segments) == 4
    assert np.isnan(found.uncertainty.between_runs).all()
    assert not any("contradict" in warning for warning in found.warnings)
    np.testing.assert_array_less(found.uncertainty.std, 2 * found.uncertainty.bound)
    with pytest.raises(UsageError, match="two logs or more"):
        identify([with_gaps(log, "rudder", (400, 430))], "auto")


@pytest.mark.parametrize("rate", [5.0, 1.0])
def test_a_log_slower_than_the_gyro_is_no_worse_than_its_samples_are_few(rate: float) -> None:
    vessel, toml = load_vessel("table1")
    sensors = suite("paper", {"speed.rate_hz": rate})
    trial = simulate(vessel, "zigzag-20-20", duration_secs=400.0, seed=6, sensors=sensors,
                     vessel_toml=toml)  # fmt: skip
    found = identify([as_log(trial, "slow.mcap")], fixed={"T3": 0.5})
    truth = vessel.coefficients._asdict()
    for name, value, std in zip(
        found.uncertainty.names, found.uncertainty.values, found.uncertainty.std, strict=True
    ):
        assert abs(value - truth[name]) < 3.5 * std
        assert std < 0.06 * abs(truth[name])
    speed = found.fit.noises[found.fit.problem.outputs.index("speed")]
    assert 0.09 < speed.white < 0.14  # 0.2 m/s, uniform


def test_one_calm_log_does_not_keep_a_swell_in_the_others() -> None:
    found = identify([a_log(), a_log(seed=1, noise="white")], "burylin")
    assert [len(run.wave_secs) for run in found.runs] == [1, 0]
    assert found.runs[0].wave_secs[0] == pytest.approx(62.8, rel=0.02)


def test_the_same_data_under_two_names_are_refused() -> None:
    copy = replace(a_log(), name="copy.mcap")
    for fitted, held_out in (([a_log(), copy], []), ([a_log()], [copy])):
        with pytest.raises(UsageError, match=r"same data twice.*zigzag-20-20-0.*copy"):
            identify(fitted, validation_logs=held_out)


def test_logs_of_one_name_are_told_apart() -> None:
    found = identify([replace(a_log(), name="a.mcap"), replace(a_log(seed=1), name="a.mcap")])
    assert [run.name for run in found.runs] == ["a.mcap", "a.mcap (2)"]


def test_a_ship_sailed_at_two_rates_of_revolutions_is_one_ship() -> None:
    slow = TOML.replace("approach_rpm = 80.0", "approach_rpm = 60.0")
    found = identify([a_log(), a_log(seed=1, toml=slow)])
    assert found.vessel is not None


def test_a_gyro_that_never_moves_is_refused() -> None:
    with pytest.raises(LogError, match="yaw rate never changes"):
        identify([with_values(a_log(), yaw_rate=0.0)])


def test_when_everything_is_known_nothing_is_sought() -> None:
    everything = VESSEL.coefficients._asdict()
    with pytest.raises(UsageError, match="nothing is left to seek"):
        identify([a_log()], "burylin", fixed=everything)


def test_what_is_known_must_mean_the_same_in_all_models() -> None:
    with pytest.raises(UsageError, match="T3 is in 1 or s"):
        identify([a_log(), a_log(seed=1)], "auto", fixed={"T3": 0.5})


def test_a_coefficient_that_is_nearly_none_is_told_to_be_so() -> None:
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
    told = identify(logs, "burylin").uncertainty
    i = told.names.index("b1")
    assert "b1" not in told.unidentifiable
    assert abs(told.values[i]) < 2.5 * told.std[i] < 2e-5


@pytest.mark.parametrize("missing", ["sway", "heading"])
def test_what_one_run_lacks_is_told_by_the_others(missing: str) -> None:
    log = a_log(seed=1)
    speed = log["speed"]
    sway = replace(speed, name="sway", values=np.zeros(len(speed)))
    whole = replace(a_log(), channels=(*a_log().channels, replace(sway, name="sway")))
    found = identify([whole, without(log, missing)], "slipstream")
    assert missing in found.fit.problem.outputs
    assert np.isfinite(found.fit.parameters).all()


def test_drift_lag_without_a_sway_has_courses_and_no_traceback() -> None:
    found = identify([a_log()], "drift-lag")
    assert "Td" in found.uncertainty.unidentifiable
    assert np.isfinite(found.histories[0].values[0, 0]).all()


def test_a_piece_without_a_speed_is_fitted_with_the_others() -> None:
    log = with_gaps(a_log(seed=1, noise="white"), "speed", (200, 401))
    found = identify([with_gaps(log, "rudder", (190, 210))], "slipstream")
    assert len(found.fit.problem.segments) == 2
    assert np.isfinite(found.fit.parameters).all()


def test_a_held_out_run_that_begins_with_the_engine_stopped_is_no_traceback() -> None:
    log = a_log(seed=2, noise="white")
    rpm = log["rpm"]
    values = np.where(rpm.measured_ns - rpm.measured_ns[0] < 30e9, 0.0, rpm.values)
    stopped = replace(
        log, channels=tuple(replace(c, values=values) if c is rpm else c for c in log.channels)
    )
    assert identify([a_log()], validation_logs=[stopped]).validations


def test_one_log_whose_halves_differ_is_not_called_many() -> None:
    found = identify([a_log(seconds=600.0)], "nomoto")
    said = [w for w in found.warnings if "contradict" in w]
    assert all(w.startswith("the halves of zigzag-20-20-0.mcap contradict") for w in said)


def test_how_a_window_is_chosen_is_no_matter_of_the_ship() -> None:
    windowed = TOML + "\n[identifier]\nwindow_secs = 300.0\n"
    assert identify([a_log(), a_log(seed=1, toml=windowed)]).vessel is not None


def test_what_is_known_must_lie_within_the_models_limits() -> None:
    with pytest.raises(UsageError, match=r"a3 must be a finite number from -inf to 0, got 0\.5"):
        identify([a_log()], "norrbin", fixed={"a3": 0.5})
