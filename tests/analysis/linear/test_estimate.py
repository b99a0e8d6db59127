import control
import numpy as np
import pytest
from gaussian import LinearRun, held
from linear_logs import DT, log_of, response
from trial_logs import InChunks

from analysis.linear.estimate import estimate
from analysis.linear.system_file import parse_system
from shiplog import LogError, UsageError
from shiplog.types import FloatArray, TrialLog

A = np.array([[-0.3, -0.8], [1.0, 0.0]])
B = np.array([[0.5], [0.0]])
SYSTEM = """
name = "roll"
[plant]
A = [[-0.3, -0.8], [1.0, 0.0]]
B = [[0.5], [0.0]]
states = { roll_rate = "rad/s", roll = "rad" }
[inputs.moment]
channel = "rudder"
[outputs.roll_rate]
std = 0.02
[outputs.roll]
channel = "heel"
std = 0.01
[noise]
process = { roll_rate = 1e-3 }
[initial]
state = { roll_rate = 0.1, roll = -0.05 }
std = { roll_rate = 0.2, roll = 0.1 }
"""
X0, P0 = np.array([0.1, -0.05]), np.diag([0.2, 0.1]) ** 2


def record(count: int = 60, seed: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return inputs (n, 1), true states (n, 2) and measurements (n, 2) with gaps."""
    rng = np.random.default_rng(seed)
    u = 0.3 * np.sin(0.7 * DT * np.arange(count))[:, None]
    F, Q = held(A, np.diag([1e-3, 0.0]), DT)
    run = LinearRun(response(A, B, u, X0), F, Q, P0, np.eye(2), np.array([0.02, 0.01]) ** 2)
    states, measured = run.drawn(rng)
    measured[1:][rng.random((count - 1, 2)) < 0.3] = np.nan
    measured[-1] = states[-1]
    return u, states, measured


def trial(u: FloatArray, measured: FloatArray) -> TrialLog:
    return log_of(rudder=u[:, 0], roll_rate=measured[:, 0], heel=measured[:, 1])


def test_kalman_filter_is_the_conditional_mean_of_all_samples_until_then() -> None:
    u, _, measured = record()
    found = estimate(trial(u, measured), parse_system(SYSTEM, "roll.toml"))
    F, Q = held(A, np.diag([1e-3, 0.0]), DT)
    run = LinearRun(response(A, B, u, X0), F, Q, P0, np.eye(2), np.array([0.02, 0.01]) ** 2)
    expected = run.filtered(measured)
    stds = np.sqrt(np.diagonal(expected[1], axis1=1, axis2=2))
    assert found.chunk.values == pytest.approx(expected[0], rel=1e-9, abs=1e-9)
    assert found.chunk.stds == pytest.approx(stds, rel=1e-8)


def test_chunks_change_no_bit() -> None:
    u, _, measured = record(400)
    log, system = trial(u, measured), parse_system(SYSTEM, "roll.toml")
    whole = estimate(log, system)
    cut = estimate(InChunks(log, [3.3, 7.04, 25.0]), system)
    for name in ("values", "stds", "predicted", "innovations", "innovation_stds"):
        one, other = getattr(whole.chunk, name), getattr(cut.chunk, name)
        assert np.array_equal(one, other, equal_nan=True)
    assert whole.findings.residuals == cut.findings.residuals


def test_steady_state_gain_is_that_of_the_control_library() -> None:
    u, _, measured = record(400)
    text = SYSTEM + '[method]\nname = "kalman"\ngain = "steady-state"\n'
    text = text.replace(
        "process = { roll_rate = 1e-3 }", "process = { roll_rate = 1e-3, roll = 1e-5 }"
    )
    design = estimate(trial(u, measured), parse_system(text, "roll.toml")).findings.plan.design
    W, r = np.diag([1e-3, 1e-5]), np.array([0.02, 0.01]) ** 2
    L, _, poles = control.lqe(A, np.eye(2), np.eye(2), W, np.diag(r) * DT)
    assert design.gain == pytest.approx(L, rel=1e-8)
    assert np.sort_complex(design.poles) == pytest.approx(np.sort_complex(poles), rel=1e-8)
    F, Q = held(A, W, DT)
    predictor, _, _ = control.dlqe(F, np.eye(2), np.eye(2), Q, np.diag(r))
    assert F @ design.correction == pytest.approx(predictor, rel=1e-8)


def test_innovations_of_a_true_model_are_consistent_and_white() -> None:
    u, _, measured = record(3000, seed=2)
    for residuals in estimate(
        trial(u, measured), parse_system(SYSTEM, "roll.toml")
    ).findings.residuals:
        assert residuals.consistent
        assert residuals.white


def test_units_offset_and_scale_are_applied() -> None:
    u, _, measured = record(200)
    plain = estimate(trial(u, measured), parse_system(SYSTEM, "roll.toml"))
    text = SYSTEM.replace(
        'channel = "heel"\nstd = 0.01',
        f'channel = "heel"\nunit = "deg"\noffset = 2.0\nscale = {float(np.radians(1))}'
        f"\nstd = {float(np.degrees(0.01))}",
    )
    shifted = measured + np.radians([0.0, 2.0])
    same = estimate(trial(u, shifted), parse_system(text, "roll.toml"))
    assert same.chunk.values == pytest.approx(plain.chunk.values, rel=1e-9, abs=1e-12)


def test_a_missing_channel_and_a_wrong_unit_are_refused_by_name() -> None:
    u, _, measured = record()
    log = trial(u, measured)
    with pytest.raises(LogError, match="no channel 'sway'"):
        estimate(log, parse_system(SYSTEM.replace('"heel"', '"sway"'), "roll.toml"))
    text = SYSTEM.replace('channel = "heel"', 'channel = "heel"\nunit = "m"')
    with pytest.raises(UsageError, match="roll, channel 'heel': cannot convert 'rad' to 'm'"):
        estimate(log, parse_system(text, "roll.toml"))


def test_states_without_a_stated_start_are_uncertain_beyond_all_they_can_be() -> None:
    u, states, measured = record(600)
    text = SYSTEM[: SYSTEM.index("[initial]")]
    found = estimate(trial(u, measured), parse_system(text, "roll.toml"))
    errors = np.abs(found.chunk.values - states) / found.chunk.stds
    assert np.mean(errors[50:] < 2) > 0.9
    assert found.findings.residuals[0].consistent


def test_a_disturbance_that_no_output_can_separate_is_refused_with_its_remedy() -> None:
    u, _, measured = record()
    text = """
    [plant]
    model = "yaw"
    T = 20
    K = 0.1
    [inputs.rudder]
    [outputs.yaw_rate]
    channel = "roll_rate"
    [[disturbance]]
    name = "moment"
    model = "constant"
    on_input = { rudder = 1.0 }
    [[disturbance]]
    name = "gyro bias"
    model = "constant"
    on_sensor = { yaw_rate = 1.0 }
    """
    with pytest.raises(
        UsageError, match="'moment' and 'gyro bias' cannot be distinguished; measure"
    ):
        estimate(trial(u, measured), parse_system(text, "yaw.toml"))


def test_smoothed_states_are_the_conditional_mean_of_the_whole_record() -> None:
    u, _, measured = record()
    log, system = trial(u, measured), parse_system(SYSTEM, "roll.toml")
    F, Q = held(A, np.diag([1e-3, 0.0]), DT)
    run = LinearRun(response(A, B, u, X0), F, Q, P0, np.eye(2), np.array([0.02, 0.01]) ** 2)
    states, covariances = run.given(measured)
    for source in (log, InChunks(log, [1.05, 4.4])):
        found = estimate(source, system, smoothed=True)
        assert found.chunk.values == pytest.approx(states, rel=1e-8, abs=1e-9)
        stds = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
        assert found.chunk.stds == pytest.approx(stds, rel=1e-7)


def test_smoothing_a_constant_gain_is_refused() -> None:
    u, _, measured = record()
    text = SYSTEM + '[method]\nname = "luenberger"\nfrequency = 1.0\n'
    with pytest.raises(UsageError, match="'luenberger' cannot be smoothed"):
        estimate(trial(u, measured), parse_system(text, "roll.toml"), smoothed=True)
