"""Sensor errors as states of the filter, through a whole replay."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from math import radians

import numpy as np
import pytest
from places import KVLCC2, SAMPLE_DATA
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from tanker_logs import tanker_log
from trial_logs import InChunks, as_log

from analysis.replay.reading_options import ReadingOptions
from analysis.replay.replay import analyse
from analysis.replay.replay_results import Analysis
from analysis.replay.residuals import ResidualSummary
from analysis.replay.sensor_errors import inconsistency_of
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from shiplog import TrialLog, UsageError, load_vessel, read

BIASED = SAMPLE_DATA / "zigzag_10_10_dropouts.mcap"  # a gyro with a bias of 0.02 deg/s
TRANSIENT_SECS = 60.0
AUTO = {"filter.kind": "extended", "filter.smooth": True, "filter.sensor_bias": ["auto"]}


@cache
def biased() -> TrialLog:
    return read(BIASED)


@cache
def replayed() -> Analysis:
    return analyse(biased(), settings=AUTO)


def wrong_model() -> ReadingOptions:
    """T1 20 % too large, and h 10 %."""
    vessel, _ = load_vessel("table1")
    c, T1, T2 = vessel.paper_coefficients, 180.0, 50.0
    scaled = {name: getattr(c, name) / 1.2 for name in ("b1", "b2", "b3", "d", "e")}
    return ReadingOptions(
        vessel=replace(
            vessel, coefficients=c._replace(a=-(T1 + T2) / (T1 * T2), h=1.1 * c.h, **scaled)
        )
    )


def error_of_yaw_rate(result: Analysis) -> float:
    """Root mean square after the transient, deg/s."""
    truth = read(SAMPLE_DATA / "zigzag_10_10_dropouts.truth.mcap")["yaw_rate"]
    true_secs = (truth.measured_ns - result.signals.start_ns) * 1e-9
    secs = result.signals.time_secs
    within = (secs > TRANSIENT_SECS) & (secs < true_secs[-1])
    errors = result.estimates.states[:, 0] - CubicSpline(true_secs, truth.values)(secs)
    return float(np.degrees(np.sqrt(np.mean(errors[within] ** 2))))


def without(log: TrialLog, *names: str) -> TrialLog:
    return replace(log, channels=tuple(c for c in log.channels if c.name not in names))


def test_a_biased_gyro_is_found_and_the_yaw_rate_is_accurate() -> None:
    result = replayed()
    assert error_of_yaw_rate(result) < 2e-5
    rudder = result.findings.disturbances["rudder"]
    assert np.degrees(rudder.rms) < 0.05  # 1.1 deg without the bias
    assert all(residual.consistent for residual in result.findings.residuals)
    gyro, log = result.findings.sensor_errors
    assert (gyro.determined, log.determined) == (True, False)
    assert str(log) == "speed log bias: not estimated: it needs a turn of half a circle"
    assert abs(np.degrees(gyro.value) - 0.02) < 2.6 * np.degrees(gyro.std) < 1e-3


def test_a_wrong_model_hardly_disturbs_the_bias() -> None:
    settings = AUTO | {"filter.process_ratio": "auto"}
    result = analyse(biased(), wrong_model(), settings=settings)
    assert error_of_yaw_rate(result) < 1e-4
    gyro = result.findings.sensor_errors[0]
    assert abs(np.degrees(gyro.value) - 0.02) < 2.6 * np.degrees(gyro.std)


def test_where_the_innovations_contradict_the_noise_set_nothing_is_determined() -> None:
    result = analyse(biased(), wrong_model(), settings=AUTO)
    assert error_of_yaw_rate(result) < 1e-3
    gyro, _ = result.findings.sensor_errors
    assert not gyro.determined
    assert "larger than expected: the model or the noise does not fit" in gyro.reason


def residual(name: str, mean_nis: float) -> ResidualSummary:
    return ResidualSummary(name, "", 100, 1.0, mean_nis, (0.9, 1.1), 0.5, 0.0, 1.0, 0)


def test_the_remedy_names_the_noise_of_the_output_concerned() -> None:
    large = [residual(name, 4.0) for name in ("speed", "heading", "north")]
    fine = [residual(name, 1.0) for name in ("yaw_rate", "east")]
    stated = inconsistency_of([*fine, *large], (False, False))
    assert stated.startswith("the innovations of speed and heading and north are larger")
    assert stated.endswith(
        "set filter.process_ratio to auto, and state a larger filter.heading_std, and state a"
        " larger filter.position_std"
    )
    heading = inconsistency_of([*fine, large[1]], (False, False))
    assert "filter.heading_std" in heading
    assert "position" not in heading
    assert inconsistency_of(fine, (False, False)) == ""


def test_noise_that_the_log_determined_is_not_to_be_determined_by_the_log() -> None:
    assert "auto" not in inconsistency_of([residual("yaw_rate", 4.0)], (True, False))
    assert "auto" in inconsistency_of([residual("yaw_rate", 4.0)], (False, True))
    settings = {"filter.gate": 1.0, "filter.process_ratio": "auto", "filter.kind": "extended"}
    warnings = [w for w in analyse(biased(), settings=settings).findings.warnings if "gate" in w]
    assert warnings
    assert not any("auto" in warning for warning in warnings)


@pytest.mark.parametrize("kind", ["pseudo-input", "steady-state", "quality", "per-tick"])
def test_every_filter_finds_the_bias(kind: str) -> None:
    result = analyse(biased(), settings={"filter.kind": kind, "filter.sensor_bias": ["auto"]})
    gyro = result.findings.sensor_errors[0]
    assert gyro.determined
    assert abs(np.degrees(gyro.value) - 0.02) < 1e-3
    assert abs(np.degrees(result.findings.disturbances["rudder"].at_end)) < 0.1


def test_where_the_chunks_are_cut_changes_nothing() -> None:
    settings = AUTO | {"filter.smooth": False}
    whole, cut = (
        analyse(log, settings=settings)
        for log in (biased(), InChunks(biased(), [7.3, 111.1, 400.0]))
    )
    for name in ("values", "stds"):
        one, other = (getattr(result.estimates.further, name) for result in (whole, cut))
        assert np.array_equal(one, other)
    assert np.array_equal(whole.disturbance.yaw, cut.disturbance.yaw)
    assert whole.findings.residuals == cut.findings.residuals
    assert whole.findings.sensor_errors == cut.findings.sensor_errors


def test_where_the_chunks_are_cut_changes_smoothed_errors_by_rounding_alone() -> None:
    """Smoothed variances are differences, of the precision of those at the start of the trial."""
    cut = analyse(InChunks(biased(), [7.3, 111.1, 400.0]), settings=AUTO)
    one, other = replayed().estimates.further, cut.estimates.further
    assert one.names == other.names
    assert np.abs((one.values - other.values) / one.stds).max() < 1e-9
    assert np.all(np.abs(one.stds**2 - other.stds**2) < 1e-11 * np.square(one.prior_stds))


def test_what_the_log_does_not_determine_is_omitted_with_the_reason() -> None:
    settings = {"filter.sensor_bias": ["auto"]}
    gyro, log = analyse(without(biased(), "position"), settings=settings).findings.sensor_errors
    assert gyro.determined
    assert not log.determined
    assert str(log) == (
        "speed log bias: not estimated: it needs positions and a turn of half a circle"
    )
    gyro, log = analyse(without(biased(), "heading"), settings=settings).findings.sensor_errors
    assert str(gyro) == "gyro bias: not estimated: it needs a heading"


def test_a_biased_speed_log_is_found_with_positions_in_a_turn() -> None:
    """The bias is added to the log of a turning circle.

    The accuracy is bounded by the current, which the filter assumes to change by 0.2 m/s in the
    square root of an hour: with 0.002 m/s the error of the speed is 0.0014 instead of 0.0049 m/s.
    """
    log = read(SAMPLE_DATA / "turning_circle_35.mcap")
    channels = [replace(c, values=c.values + 0.119) if c.name == "speed" else c for c in log]
    biased_log = replace(log, channels=tuple(channels))
    truth = read(SAMPLE_DATA / "turning_circle_35.truth.mcap")["speed"]
    errors = []
    for settings in (AUTO | {"filter.sensor_bias": ["none"]}, AUTO):
        result = analyse(biased_log, settings=settings)
        true_secs = (truth.measured_ns - result.signals.start_ns) * 1e-9
        secs = result.signals.time_secs
        within = (secs > TRANSIENT_SECS) & (secs < true_secs[-1])
        error = result.estimates.states[:, 3] - CubicSpline(true_secs, truth.values)(secs)
        errors.append(float(np.sqrt(np.mean(error[within] ** 2))))
    _, bias = result.findings.sensor_errors
    assert bias.determined
    assert bias.std < 0.02
    assert abs(bias.value - 0.119) < 0.01
    assert errors[0] > 0.1
    assert errors[1] < 0.006, errors
    current = [result.estimates.further.of(name) for name in ("current_north", "current_east")]
    assert all(abs(value[-1]) < 2.6 * std[-1] < 0.06 for value, std in current)


# of a simulated trial: manoeuvre, errors of the sensors, factor of the speed, settings, and the
# errors expected, each with the largest standard deviation
Known = tuple[str, Mapping[str, float], float, Mapping[str, object], Mapping[str, tuple]]
CIRCLE, ZIGZAG = "turning-circle-35", "zigzag-20-20"
NO_SLOW_MOMENT = {"disturbance.models": ["wave"], "disturbance.wave_frequency": 0.6}
KNOWN: dict[str, Known] = {
    "rudder": (
        ZIGZAG,
        {"rudder.bias": radians(1), "yaw_rate.bias": radians(0.02)},
        1.0,
        NO_SLOW_MOMENT,
        {"rudder": (radians(1), radians(0.4)), "gyro": (radians(0.02), radians(2e-4))},
    ),
    "compass": (
        CIRCLE, {"heading.bias": radians(1.5)}, 1.0, {}, {"compass": (radians(1.5), radians(0.3))}
    ),
    "scale": (CIRCLE, {}, 1.03, {}, {"log_scale": (0.03, 0.003)}),
    "scale and bias": (
        CIRCLE, {"speed.bias": 0.119}, 1.03, {}, {"log_scale": (0.03, 0.003), "log": (0.1226, 0.03)}
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", KNOWN)
def test_errors_requested_by_name_are_found_where_the_log_determines_them(case: str) -> None:
    manoeuvre, errors, factor, settings, expected = KNOWN[case]
    vessel, text = load_vessel("table1")
    sensors = suite("white", errors)
    trial = simulate(
        vessel, manoeuvre, duration_secs=400.0, seed=1, sensors=sensors, vessel_toml=text
    )
    log = as_log(trial)
    channels = [replace(c, values=factor * c.values) if c.name == "speed" else c for c in log]
    requested = {"filter.kind": "extended", "filter.sensor_bias": list(expected), **settings}
    result = analyse(replace(log, channels=tuple(channels)), settings=requested)
    for found in result.findings.sensor_errors:
        value, largest_std = expected[found.name]
        assert found.determined, found
        assert abs(found.value - value) < 2.6 * found.std, found
        assert found.std < largest_std, found


REFUSED: dict[str, tuple[Mapping[str, object], tuple[str, ...], str]] = {
    "gyro bias and yaw moment": (
        {"filter.sensor_bias": ["gyro"]},
        ("heading",),
        "gyro bias and constant yaw moment cannot be distinguished at the mode 0 1/s; it needs a h",
    ),
    "rudder zero and yaw moment": (
        {"filter.sensor_bias": ["rudder"]},
        (),
        "rudder zero and constant yaw moment cannot be distinguished",
    ),
    "compass bias": (
        {"filter.sensor_bias": ["compass"]},
        ("position",),
        "compass bias cannot be seen at the mode 0 1/s; it needs positions",
    ),
    "log bias and surge force": (
        {"filter.sensor_bias": ["log"]},
        ("position",),
        "speed log bias and constant surge force cannot be distinguished at the mode 0 1/s; it n",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_distinguished_is_refused_by_name(case: str) -> None:
    settings, missing, message = REFUSED[case]
    with pytest.raises(UsageError) as error:
        analyse(without(biased(), *missing), settings=settings)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_gyro_bias_without_a_heading_is_estimated_where_no_constant_moment_is() -> None:
    settings = {
        "filter.kind": "extended", "filter.sensor_bias": ["gyro"], "disturbance.models": ["wave"],
    }  # fmt: skip
    (gyro,) = analyse(without(biased(), "heading"), settings=settings).findings.sensor_errors
    assert abs(np.degrees(gyro.value) - 0.02) < 1e-3


@pytest.mark.parametrize("run", ["zz_10", "zz_20"])
def test_the_gyro_bias_of_a_real_zigzag_is_that_of_the_comparison_with_its_heading(
    run: str,
) -> None:
    """It is 0.0045 to 0.0058 deg/s in the free-running tests of the KVLCC2."""
    path = KVLCC2 / "marin" / f"MARIN_FREE_KVLCC2_{run}_m.dat"
    if not path.is_file():
        pytest.skip("the SIMMAN data are not in ../shared/data/kvlcc2")
    log = tanker_log(path)
    gyro, _ = analyse(log, settings=AUTO).findings.sensor_errors
    assert gyro.determined
    half = 1.96 * np.degrees(gyro.std)
    assert half < 1.2e-3
    assert 0.0045 - half < np.degrees(gyro.value) < 0.0058 + half


@pytest.mark.parametrize(("std_deg", "secs"), [(0.05, 5.0), (0.2, 30.0)])
def test_the_interval_of_the_gyro_bias_allows_for_slow_errors_of_the_heading(
    std_deg: float, secs: float
) -> None:
    vessel, text = load_vessel("table1")
    errors = []
    for seed in range(20):
        sensors = suite("white", {"yaw_rate.bias": radians(0.02), "heading.white": radians(0.02)})
        trial = simulate(
            vessel, ZIGZAG, duration_secs=400.0, seed=seed, sensors=sensors, vessel_toml=text
        )
        log = as_log(trial)
        heading = log["heading"]
        dt, rng = 0.5, np.random.default_rng(seed)
        a = np.exp(-dt / secs)
        noise = rng.standard_normal(len(heading.values)) * radians(std_deg) * np.sqrt(1 - a**2)
        noise[0] /= np.sqrt(1 - a**2)
        wrong = replace(heading, values=heading.values + lfilter([1], [1, -a], noise))
        channels = tuple(wrong if c is heading else c for c in log)
        # so large a process noise that the model does not show the bias, but the heading alone
        settings = AUTO | {
            "filter.smooth": False, "filter.sensor_bias": ["gyro"], "filter.process_ratio": 1.0,
        }  # fmt: skip
        (gyro,) = analyse(replace(log, channels=channels), settings=settings).findings.sensor_errors
        errors.append((gyro.value - radians(0.02)) / gyro.std)
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.4, errors
