"""Replay settings from a vessel file, the command line and Python."""

from argparse import ArgumentParser
from dataclasses import fields

import pytest
from filter_runs import FILTERS

from analysis.cli.replay_verb import REPLAY, replay_settings
from analysis.regression.sliding import WINDOW_SECS
from analysis.regression.weak_form import BUMP_SECS
from shiplog import Vessel, load_vessel
from shiplog.errors import UsageError, VesselError
from shiplog.vessel.presets import PRESETS
from shiplog.vessel.settings import (
    DISTURBANCES,
    MIN_WINDOW_SECS,
    DisturbanceSettings,
    FilterSettings,
    IdentifierSettings,
    parse_settings,
    settings_dict,
)
from shiplog.vessel.vessel import with_settings
from shiplog.vessel.vessel_parser import parse_vessel

SETTINGS = {
    each.SECTION: each for each in (FilterSettings, DisturbanceSettings, IdentifierSettings)
}


def errors_of(section: str, table: dict[str, object]) -> str:
    errors: list[str] = []
    parse_settings(SETTINGS[section], table, errors)
    return "; ".join(errors)


def given(*arguments: str) -> dict[str, object]:
    parser = ArgumentParser()
    REPLAY.configure(parser)
    return replay_settings(parser.parse_args(["x.mcap", *arguments]))


def test_the_defaults_are_those_of_the_paper() -> None:
    vessel, _ = load_vessel("table1")
    assert vessel.filter.chosen == "pseudo-input"
    assert not vessel.filter.smooth
    assert vessel.disturbance.models == ("constant",)
    assert (vessel.disturbance.yaw_frequency, vessel.disturbance.spectrum) == (0.05, "butterworth")


@pytest.mark.parametrize("kind", FILTERS)
def test_every_filter_can_be_named_in_a_vessel_file(kind: str) -> None:
    text = PRESETS["table1"] + f'kind = "{kind}"\ngate = 4\n'
    vessel = parse_vessel(text, "ship.toml")
    assert vessel.filter.chosen == kind
    assert vessel.filter.gate == 4.0


@pytest.mark.parametrize("models", [["wave"], ["constant", "wind"], list(DISTURBANCES)])
def test_every_disturbance_can_be_named_in_a_vessel_file(models: list[str]) -> None:
    vessel = parse_vessel(f"{PRESETS['table1']}\n[disturbance]\nmodels = {models}\n", "ship.toml")
    assert vessel.disturbance.models == tuple(models)


def test_the_window_is_set_by_the_file_and_the_command_line(vessel: Vessel) -> None:
    assert vessel.identifier.window_secs == WINDOW_SECS
    assert MIN_WINDOW_SECS == BUMP_SECS
    stated = parse_vessel(f"{PRESETS['table1']}[identifier]\nwindow_secs = 300\n", "ship.toml")
    assert stated.identifier.window_secs == 300.0
    chosen = given("--set", "identifier.window_secs=400")
    assert with_settings(stated, chosen).identifier.window_secs == 400.0
    auto = with_settings(stated, {"identifier.window_secs": "auto"})
    assert auto.identifier.window_secs == WINDOW_SECS


@pytest.mark.parametrize("settings", [FilterSettings(kind="quality"), DisturbanceSettings()])
def test_settings_survive_the_way_to_a_section_and_back(
    settings: FilterSettings | DisturbanceSettings,
) -> None:
    errors: list[str] = []
    assert parse_settings(type(settings), settings_dict(settings), errors) == settings
    assert not errors


def test_the_default_filter_can_model_a_wave_where_one_is_set() -> None:
    assert FilterSettings(wave=True).chosen == "extended"


@pytest.mark.parametrize(
    ("section", "key", "value", "message"),
    [
        ("filter", "kind", "kalman", "filter.kind must be one of extended, per-tick"),
        ("filter", "smooth", 1, "filter.smooth must be true or false, got 1"),
        ("filter", "gate", 0, "filter.gate must be positive, got 0"),
        ("filter", "gate", "6", "filter.gate must be a number, got '6'"),
        ("filter", "shift", -0.1, "filter.shift must lie between 0 and 1000, got -0.1"),
        ("filter", "wave_damping", 2.0, "filter.wave_damping must lie between 1e-06 and 1, got 2"),
        ("filter", "speed_std", float("nan"), "filter.speed_std must be finite, got nan"),
        ("filter", "yaw_rate_std", True, "filter.yaw_rate_std must be a number, got True"),
        ("filter", "shfit", 0.1, "unknown key 'filter.shfit', did you mean 'shift'?"),
        ("disturbance", "models", [], "some of constant, ramp, wave, wind, got []"),
        ("disturbance", "models", "wave", "must be a list of some of constant, ramp, wave"),
        ("disturbance", "models", ["swell"], "must be a list of some of constant, ramp, wave"),
        ("disturbance", "spectrum", "bessel", "disturbance.spectrum must be one of butterworth"),
        ("disturbance", "yaw_frequency", -1, "disturbance.yaw_frequency must be positive, got -1"),
        ("identifier", "window_secs", 30, "identifier.window_secs must lie between 60 and 1e+09"),
        ("identifier", "window", 300, "did you mean 'window_secs'?"),
    ],
)
def test_a_wrong_value_is_named(section: str, key: str, value: object, message: str) -> None:
    assert message in errors_of(section, {key: value})


@pytest.mark.parametrize(
    ("name", "value", "nearest"),
    [
        ("filter.sensor_bias", "gyr", "gyro"),
        ("filter.kind", "ekf", "extended"),
        ("filter.kind", "extendet", "extended"),
        ("disturbance.models", ["wav"], "wave"),
    ],
)
def test_an_unknown_name_brings_the_nearest_one(
    vessel: Vessel, name: str, value: object, nearest: str
) -> None:
    with pytest.raises(UsageError, match=f"did you mean '{nearest}'"):
        with_settings(vessel, {name: value})


def test_no_sensor_error_and_some_contradict_each_other(vessel: Vessel) -> None:
    with pytest.raises(UsageError, match="has none beside gyro; remove one of them"):
        with_settings(vessel, {"filter.sensor_bias": "none,gyro"})
    assert with_settings(vessel, {"filter.sensor_bias": "none"}).filter.sensors == ()


def test_a_section_that_is_not_a_table_is_reported_with_the_other_errors() -> None:
    with pytest.raises(VesselError, match=r"2 errors.*\[filter\] must be a section"):
        parse_vessel('filter = 3\nlength = "long"\n' + PRESETS["table1"].split("[filter]")[0], "x")


def test_given_settings_override_those_of_the_vessel(vessel: Vessel) -> None:
    changed = with_settings(vessel, {"filter.kind": "extended", "disturbance.models": ["ramp"]})
    assert changed.filter.kind == "extended"
    assert changed.filter.process_ratio == vessel.filter.process_ratio
    assert changed.disturbance.models == ("ramp",)
    assert changed.coefficients == vessel.coefficients
    assert with_settings(vessel, {}) is vessel


def test_auto_restores_the_default_of_a_setting(vessel: Vessel) -> None:
    assert vessel.filter.process_ratio == 2.5e-5
    assert with_settings(vessel, {"filter.process_ratio": "auto"}).filter.process_ratio is None
    with_gate = with_settings(vessel, {"filter.gate": 3.0})
    assert with_settings(with_gate, {"filter.gate": "auto"}).filter.gate == 6.0


def test_wrong_settings_are_reported_all_at_once(vessel: Vessel) -> None:
    with pytest.raises(UsageError) as caught:
        with_settings(vessel, {"yaw.T1": 3.0, "filter.gate": -1.0, "disturbance.modles": ["wave"]})
    for part in ("'yaw.T1'", "filter.gate must be positive", "did you mean 'models'?"):
        assert part in str(caught.value)


def test_the_command_line_gives_settings_by_name() -> None:
    assert given() == {}
    assert given("--filter", "quality", "--set", "filter.shift=0.2") == {
        "filter.kind": "quality",
        "filter.shift": 0.2,
    }
    assert given("--smooth", "--wave") == {"filter.smooth": True, "filter.wave": True}
    assert given("--disturbance", "ramp,wave", "--set", "disturbance.spectrum=binomial") == {
        "disturbance.models": ["ramp", "wave"],
        "disturbance.spectrum": "binomial",
    }
    assert given("--set", 'disturbance.models=["ramp"]') == {"disturbance.models": ["ramp"]}


@pytest.mark.parametrize("text", ["filter.gate", "=3", "filter.gate="])
def test_a_malformed_setting_is_an_error(text: str) -> None:
    with pytest.raises(UsageError, match="--set takes KEY=VALUE"):
        given("--set", text)


def test_every_field_has_a_type_and_limits() -> None:
    for kind in (FilterSettings, DisturbanceSettings, IdentifierSettings):
        assert all("kind" in field.metadata for field in fields(kind))
