import control
import numpy as np
import pytest
from gaussian import LinearRun, held
from linear_logs import DT, log_of, response
from scipy.linalg import block_diag
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


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('"heel"', '"heel"\nunit = "deg"', "output 'roll' is in deg, its state 'roll' in rad"),
        ('roll = "rad" }', 'roll = "deg" }', "output 'roll' is in rad, its state 'roll' in deg"),
        ('"rad/s"', '"furlong"', "is in rad/s, its state 'roll_rate' in furlong; state one unit"),
    ],
)
def test_an_output_that_is_a_state_has_its_unit(old: str, new: str, expected: str) -> None:
    u, _, measured = record()
    with pytest.raises(UsageError, match=expected):
        estimate(trial(u, measured), parse_system(SYSTEM.replace(old, new), "roll.toml"))


def test_a_state_without_a_unit_takes_its_output_in_any() -> None:
    u, _, measured = record()
    plain = estimate(trial(u, measured), parse_system(SYSTEM, "roll.toml"))
    text = SYSTEM.replace('roll = "rad" }', 'roll = "1" }')
    same = estimate(trial(u, measured), parse_system(text, "roll.toml"))
    assert np.array_equal(same.chunk.values, plain.chunk.values)


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


def test_disturbance_and_coloured_noise_are_the_conditional_mean_of_the_joint_system() -> None:
    """The joint system is written out here, with the start of the shaping filter stationary."""
    rng, count, T, std = np.random.default_rng(4), 50, 2.0, 0.05
    joint = np.zeros((4, 4))
    joint[:2, :2], joint[0, 2], joint[0, 3], joint[3, 3] = A, 1.0, 0.7, -1 / T
    joint[2, 2] = -0.02  # an exponential disturbance on the rate
    W = np.diag([1e-3, 0.0, 1e-5, 2 * std**2 / T])
    F, Q = held(joint, W, DT)
    P = block_diag(P0, 0.1**2, std**2)
    u = np.zeros((count, 1))
    C, r = np.eye(2, 4), np.array([0.02, 0.01]) ** 2
    C[1, 2] = 0.5  # the disturbance acts on the second sensor, too
    run = LinearRun(response(joint, np.eye(4, 1), u, np.array([*X0, 0.2, 0.0])), F, Q, P, C, r)
    measured = run.drawn(rng)[1]
    text = SYSTEM.replace("roll = -0.05 }", "roll = -0.05, swell = 0.2 }").replace(
        "roll = 0.1 }", "roll = 0.1, swell = 0.1 }"
    )
    text += """
    [[disturbance]]
    name = "swell"
    model = "exponential"
    rate = -0.02
    on_state = { roll_rate = 1.0 }
    on_sensor = { roll = 0.5 }
    intensity = 1e-5
    [[coloured]]
    name = "gust"
    spectrum = "first-order"
    std = 0.05
    time = 2.0
    on_state = { roll_rate = 0.7 }
    """
    found = estimate(trial(u, measured), parse_system(text, "roll.toml"))
    states, covariances = run.filtered(measured)
    stds = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    assert found.chunk.values[:, :3] == pytest.approx(states[:, :3], rel=1e-8, abs=1e-9)
    assert found["gust"] == pytest.approx(states[:, 3], rel=1e-8, abs=1e-9)
    assert found.chunk.stds == pytest.approx(stds, rel=1e-7)


def test_a_transfer_function_responds_as_that_of_the_control_library() -> None:
    at = DT * np.arange(300)
    u = np.sin(0.4 * at)
    _, y = control.forced_response(control.tf([2.0, 1.0], [1.0, 0.6, 0.5]), at, u)
    text = """
    [plant]
    num = [2.0, 1.0]
    den = [1.0, 0.6, 0.5]
    [inputs.u]
    channel = "rudder"
    [outputs.y]
    channel = "heel"
    std = 1e-3
    [initial]
    state = { x1 = 0, x2 = 0 }
    std = { x1 = 0, x2 = 0 }
    """
    found = estimate(log_of(rudder=u, heel=y), parse_system(text, "tf.toml"))
    assert found.chunk.predicted[:, 0] == pytest.approx(y, abs=1e-9)


def test_a_slow_heading_counts_once_per_sample_between_which_it_is_interpolated() -> None:
    at = DT * np.arange(600)
    heading = np.where(np.arange(600) % 10 == 0, 0.01 * at, np.nan)
    text = """
    [plant]
    model = "yaw"
    T = 20
    K = 0.1
    heading = true
    [outputs.heading]
    std = 0.01
    [outputs.yaw_rate]
    std = 0.001
    [noise]
    process = { yaw_rate = 1e-6 }
    """
    log = log_of(heading=heading, yaw_rate=np.full(600, 0.01))
    found = estimate(log, parse_system(text, "yaw.toml"))
    assert found.findings.plan.clock.dt_secs == pytest.approx(DT)
    assert found.findings.residuals[0].count == 60
    assert found.findings.residuals[1].count in (591, 600)


def test_samples_averaged_within_a_step_have_the_noise_of_their_mean() -> None:
    rng = np.random.default_rng(0)
    text = """
    step_secs = 1.0
    [plant]
    A = [[0.0]]
    states = { drift = "m/s" }
    [outputs.drift]
    channel = "sway"
    std = 0.1
    [noise]
    process = { drift = 1e-4 }
    """
    log = log_of(sway=0.1 * rng.standard_normal(8000))
    found = estimate(log, parse_system(text, "drift.toml"))
    assert found.findings.plan.stds == pytest.approx([0.1 / np.sqrt(10)])
    mean, _ = found.findings.residuals[0].mean_nis, None
    assert mean == pytest.approx(1, abs=0.2)


def test_an_input_that_stops_is_held_with_a_warning_that_states_for_how_long() -> None:
    u, _, measured = record(300)
    u = u.copy()
    u[100:200] = np.nan
    found = estimate(trial(u, measured), parse_system(SYSTEM, "roll.toml"))
    (warning,) = [text for text in found.findings.warnings if text.startswith("moment")]
    assert "held at its last value" in warning


def test_a_state_that_the_outputs_do_not_show_needs_a_stated_start() -> None:
    u, _, measured = record()
    text = SYSTEM[: SYSTEM.index("[initial]")].replace(
        "[[-0.3, -0.8], [1.0, 0.0]]", "[[-0.3, 0], [0, -1]]"
    )
    text = text.replace('[outputs.roll]\nchannel = "heel"\nstd = 0.01\n', "")
    with pytest.raises(UsageError, match=r"initial value of 'roll'; state initial\.std of it"):
        estimate(trial(u, measured), parse_system(text, "roll.toml"))


def test_a_channel_with_too_few_samples_is_refused_by_name() -> None:
    u, _, measured = record()
    measured = measured.copy()
    measured[3:, 1] = np.nan
    with pytest.raises(LogError, match=r"channel 'heel' has \d samples"):
        estimate(trial(u, measured), parse_system(SYSTEM, "roll.toml"))


def test_a_dead_sensor_needs_a_stated_noise() -> None:
    u, _, measured = record()
    measured = np.column_stack((measured[:, 0], np.zeros(len(u))))
    text = SYSTEM.replace("std = 0.01\n", "", 1)
    with pytest.raises(LogError, match=r"'heel' never changes.*state outputs\.roll\.std"):
        estimate(trial(u, measured), parse_system(text, "roll.toml"))


def test_a_wave_on_a_sensor_is_the_conditional_mean_of_the_joint_system() -> None:
    frequency, damping, std = 0.9, 0.1, 0.05
    joint = np.zeros((4, 4))
    joint[:2, :2] = A
    joint[2:, 2:] = [[-2 * damping * frequency, -(frequency**2)], [1.0, 0.0]]
    gain = 2 * std * np.sqrt(damping * frequency)
    F, Q = held(joint, np.diag([1e-3, 0.0, 1.0, 0.0]), DT)
    stationary = 1 / (4 * damping * frequency) * np.diag([1.0, frequency**-2])
    P, C = block_diag(P0, stationary), np.eye(2, 4)
    C[1, 2] = gain
    u, r = np.zeros((50, 1)), np.array([0.02, 0.01]) ** 2
    mean = response(joint, np.eye(4, 1), u, np.array([*X0, 0.0, 0.0]))
    run = LinearRun(mean, F, Q, P, C, r)
    measured = run.drawn(np.random.default_rng(6))[1]
    text = f"""{SYSTEM}
    [[coloured]]
    name = "wave"
    spectrum = "wave"
    std = {std}
    frequency = {frequency}
    damping = {damping}
    on_sensor = {{ roll = 1.0 }}
    """
    found = estimate(trial(u, measured), parse_system(text, "roll.toml"))
    states, _ = run.filtered(measured)
    assert found.chunk.values[:, :2] == pytest.approx(states[:, :2], rel=1e-8, abs=1e-9)
    assert found["wave"] == pytest.approx(gain * states[:, 2], rel=1e-8, abs=1e-9)


def test_three_outputs_are_smoothed_to_the_conditional_mean() -> None:
    C, r = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([0.02, 0.01, 0.03]) ** 2
    F, Q = held(A, np.diag([1e-3, 0.0]), DT)
    u = np.zeros((50, 1))
    run = LinearRun(response(A, B, u, X0), F, Q, P0, C, r)
    rng = np.random.default_rng(7)
    measured = run.mean @ C.T + np.sqrt(r) * rng.standard_normal((50, 3))
    measured[1:-1][rng.random((48, 3)) < 0.3] = np.nan
    text = SYSTEM.replace("B = ", "C = [[1, 0], [0, 1], [1, 1]]\nB = ")
    text = text.replace("[noise]", '[outputs.sum]\nchannel = "pitch"\nstd = 0.03\n[noise]')
    log = log_of(
        rudder=u[:, 0], roll_rate=measured[:, 0], heel=measured[:, 1], pitch=measured[:, 2]
    )
    found = estimate(log, parse_system(text, "roll.toml"), smoothed=True)
    states, covariances = run.given(measured)
    stds = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    assert found.chunk.values == pytest.approx(states, rel=1e-8, abs=1e-9)
    assert found.chunk.stds == pytest.approx(stds, rel=1e-7)
