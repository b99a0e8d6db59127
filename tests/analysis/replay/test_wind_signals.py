"""Wind as a named disturbance of a replay: its channels, its coefficients, and what is refused."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from trial_logs import InChunks, as_log
from windy_trials import (
    SMOOTHED,
    WINDY,
    true_coefficients,
    windy_analysis,
    windy_log,
    windy_trial,
    without,
)

from analysis.filters.wind_terms import WIND_TERMS, wind_regressors
from analysis.replay.replay import analyse
from analysis.signals.hold import hold_last
from recorders.simulated.wind import APPARENT_WIND, WIND_SENSORS
from shiplog import UsageError, write
from shiplog.cli.main import main


def test_the_coefficients_of_a_simulated_wind_are_found_and_determined() -> None:
    true, found = true_coefficients(windy_trial()), windy_analysis().findings.wind
    assert [term.name for term in found] == list(WIND_TERMS)
    for term in found:
        assert term.determined, term
        assert abs(term.value - true[term.name]) < 2.6 * term.std, term
        assert term.std < 0.4 * abs(true[term.name]), term


def test_with_the_wind_less_is_unexplained_than_without() -> None:
    with_wind = windy_analysis().findings.disturbances
    calm = analyse(windy_log(), settings=SMOOTHED).findings
    assert not calm.wind
    for name in ("yaw", "rudder", "surge"):
        assert with_wind[name].rms < 0.2 * calm.disturbances[name].rms
    assert "yaw_wind" not in calm.disturbances


def test_moment_and_force_of_the_wind_are_disturbances_of_their_own() -> None:
    result, trial = windy_analysis(), windy_trial()
    secs = result.signals.time_secs
    truth = trial.trajectory.at(secs)
    for found, name in (
        (result.disturbance.yaw_wind, "yaw"),
        (result.disturbance.surge_wind, "surge"),
    ):
        true = truth[f"{name}_disturbance"]
        # the noise of the anemometer shows in them
        assert np.sqrt(np.mean((found - true) ** 2)) < 0.2 * np.sqrt(np.mean(true**2))
        summary = result.findings.disturbances[f"{name}_wind"]
        assert summary.rms == pytest.approx(np.sqrt(np.mean(found**2)))
        assert 0 < summary.noise_std < summary.rms


def test_the_regressors_are_those_of_the_relative_wind_whichever_channels_state_it() -> None:
    """Without noise: the wind over the water, relative to the bow or from north, is converted."""
    trial = windy_trial(
        noise="none",
        secs=150.0,
        also=WIND_SENSORS,
    )
    log = as_log(trial)
    ways = {
        "apparent": log,
        "from ahead": without(log, *APPARENT_WIND),
        "from north": without(log, *APPARENT_WIND, "true_wind_angle"),
    }
    for way, given in ways.items():
        signals = analyse(given, settings=WINDY).signals
        truth = trial.trajectory.at(signals.time_secs)
        expected = wind_regressors(
            truth["apparent_wind_speed"], truth["apparent_wind_angle"], truth["speed"]
        )
        for name, values in expected.items():
            # a channel of 1 Hz is interpolated in a turn
            assert np.allclose(signals[name], values, atol=1.5), (way, name)


def test_where_the_chunks_are_cut_changes_no_regressor() -> None:
    log = without(windy_log(), *APPARENT_WIND, "true_wind_angle")
    cut = InChunks(log, [7.3, 51.1, 120.0])
    whole, parts = (analyse(each, settings=WINDY) for each in (log, cut))
    for name in WIND_TERMS:
        assert np.array_equal(whole.signals[name], parts.signals[name])
    assert whole.findings.plan.noise.further == parts.findings.plan.noise.further
    deviation = np.abs(whole.disturbance.yaw_wind - parts.disturbance.yaw_wind)
    assert deviation.max() < 1e-9 * np.abs(whole.disturbance.yaw_wind).max()


def test_a_gap_of_the_anemometer_is_held_and_reported() -> None:
    def cut(start: float, end: float) -> object:
        log = windy_log()
        first, _ = log.span_ns
        channels = []
        for channel in log.channels:
            secs = (channel.measured_ns - first) * 1e-9
            lost = (secs > start) & (secs < end) & (channel.name in APPARENT_WIND)
            kept = channel.values.copy()
            kept[lost] = np.nan
            channels.append(replace(channel, values=kept))
        return replace(log, channels=tuple(channels))

    result = analyse(cut(100.0, 140.0), settings=WINDY)
    at = np.flatnonzero((result.signals.time_secs > 101) & (result.signals.time_secs < 139))
    assert np.ptp(result.signals["wind_beam"][at]) == 0
    assert result.signals["wind_beam"][at[0]] != 0
    (warning,) = [text for text in result.findings.warnings if text.startswith("wind:")]
    assert "not measured for 39" in warning
    late = analyse(cut(-1.0, 50.0), settings=WINDY)
    assert not late.signals["wind_beam"][: 2 * 49].any()
    assert not any(text.startswith("wind:") for text in windy_analysis().findings.warnings)


def test_a_hold_keeps_the_value_before_the_chunk() -> None:
    assert hold_last(np.array([np.nan, 2.0, np.nan]), 1.0).tolist() == [1.0, 2.0, 2.0]


def test_the_results_can_be_pickled() -> None:
    copy = pickle.loads(pickle.dumps(windy_analysis()))  # noqa: S301 - our own
    assert copy.findings.wind == windy_analysis().findings.wind


# ---- what is refused, or omitted with the reason


STEADY = "the wind is too steady in speed and angle"


def test_on_a_straight_course_in_a_steady_wind_the_wind_is_refused_by_name() -> None:
    log = as_log(windy_trial("zigzag-1-1", secs=120.0))
    with pytest.raises(UsageError) as error:
        analyse(log, settings=WINDY)
    message = str(error.value)
    assert message.startswith("disturbance.models has wind, which cannot be distinguished")
    assert f"oblique wind, yaw: {STEADY}: but for" in message
    assert "it acts as a constant yaw moment" in message
    assert "it acts as a constant surge force" in message
    assert message.endswith("needs a manoeuvre that turns the ship in the wind; remove wind")


def test_a_term_that_is_not_distinguished_widens_the_intervals_of_the_others() -> None:
    """Beside a ramp the beam wind of a circle is not: what it does may be due to the others."""
    settings = WINDY | {"disturbance.models": ["ramp", "wind"]}
    true, result = true_coefficients(windy_trial()), analyse(windy_log(), settings=settings)
    found = {term.name: term for term in result.findings.wind}
    assert found["wind_beam"].reason.startswith(STEADY)
    assert not found["wind_beam"].determined
    for name, term in found.items():
        assert abs(term.value - true[name]) < 2.6 * term.std, term


def test_with_a_model_that_was_fitted_to_the_log_no_coefficient_is_determined() -> None:
    result = analyse(replace(windy_log(), vessel_toml=None), settings=WINDY)
    assert not any(term.determined for term in result.findings.wind)
    reasons = {term.reason for term in result.findings.wind}
    assert any("contains part of the wind; give a model with --vessel" in each for each in reasons)


MISSING: dict[str, tuple[tuple[str, ...], str]] = {
    "speed": (
        (*APPARENT_WIND, "wind_speed"), "it has true_wind_angle, wind_direction; it needs"
    ),
    "wind": (WIND_SENSORS, "it has none; it needs apparent_wind_speed and apparent_wind_angle"),
    "heading": (
        (*APPARENT_WIND, "true_wind_angle", "heading"), "and wind_direction with a heading; remove"
    ),
}  # fmt: skip
EXCLUDED: dict[str, tuple[dict[str, object], str]] = {
    "wind alone": ({"disturbance.models": ["wind"]}, "has wind alone"),
    "not smoothed": ({"filter.smooth": False}, "set filter.smooth (--smooth)"),
    "rudder zero": (
        {"filter.sensor_bias": ["rudder"]}, "rudder zero and constant yaw moment cannot be dist"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISSING)
def test_a_channel_that_the_wind_needs_is_named_where_it_is_missing(case: str) -> None:
    missing, message = MISSING[case]
    with pytest.raises(UsageError) as error:
        analyse(without(windy_log(), *missing), settings=WINDY)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("case", EXCLUDED)
def test_a_setting_that_excludes_the_wind_is_named(case: str) -> None:
    settings, message = EXCLUDED[case]
    with pytest.raises(UsageError) as error:
        analyse(windy_log(), settings=WINDY | settings)
    assert message in str(error.value)


def test_the_command_refuses_a_log_without_wind_as_a_usage_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "calm.mcap"
    write(without(windy_log(), *APPARENT_WIND, "wind_speed"), path)
    command = ["replay", str(path), "--smooth", "--disturbance", "constant,wind"]
    assert main([*command, "-o", str(tmp_path / "calm.rrd")]) == 2
    error = capsys.readouterr().err
    assert "does not state the wind relative to the ship" in error
    assert "remove wind" in error
