"""Every method of the papers on a log; gains against the reference values of the papers' pages."""

from functools import cache

import numpy as np
import pytest
from example_scripts import example_script, paper_system
from linear_logs import DT, log_of, response
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_discrete_lyapunov

from analysis.design.discrete_correction import matched_correction, sampled_poles
from analysis.linear.estimate import SystemEstimate, estimate
from analysis.linear.system_file import parse_system
from analysis.replay.residuals import assess_innovations
from shiplog import UsageError
from shiplog.types import FloatArray, TrialLog

YAW = f"""
[plant]
model = "yaw"
T1 = 150
T2 = 50
K = 0
[outputs.yaw_rate]
std = {float(np.sqrt(2.5e-9 / DT))}
[noise]
process = {{ yaw_acceleration_rest = 1e-12 }}
"""


def run(text: str, log: TrialLog) -> SystemEstimate:
    return estimate(log, parse_system(text, "system.toml"))


def noise(count: int = 300, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(count)


@cache
def gusty() -> tuple[SystemEstimate, FloatArray]:
    log, gust = example_script("paper_logs").gust(np.random.default_rng(5))
    return run(paper_system("gust"), log), gust


def test_steady_state_filter_of_a_gust_has_the_gain_and_poles_of_the_paper() -> None:
    design = gusty()[0].findings.plan.design
    L = [
        [0.037291386349, -0.0040904051819],
        [-0.020228415532, 0.0028556367845],
        [0, 0],
        [1.905056158, -0.28749681147],
        [3.5991673289, -0.24567128353],
    ]
    poles = [-20.2, -1.5223619944, -1.1734284197, -0.3758925864, -0.166092534]
    assert design.gain == pytest.approx(np.array(L), abs=1e-8)
    assert np.sort(design.poles) == pytest.approx(np.sort(np.array(poles, complex)), abs=1e-8)


def test_gust_estimated_from_a_simulated_log_is_within_its_standard_deviation() -> None:
    found, gust = gusty()
    error = (found["gust"] - gust)[300:]
    assert np.sqrt(np.mean(error**2)) == pytest.approx(found.std("gust")[-1], rel=0.1)
    assert np.sqrt(np.mean(error**2)) < 0.9 * np.std(gust)
    chunk = found.chunk
    for j, name in enumerate(found.findings.plan.system.plant.sensors):
        innovations = chunk.innovations[300:, j], chunk.innovation_stds[300:, j]
        residuals = assess_innovations(name, "1", *innovations, DT, noise_measured=False)
        assert residuals.consistent
        assert residuals.white


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("", [0.174443585, 0.0152152822]),
        ("shift = 0.2", [0.4137657921, 0.0442244862]),
        ("G = { yaw_acceleration_rest = 1e-9 }", [0.6369938891, 0.0028806074]),
        ("G = { yaw_rate = 1e-8 }", [0.109519673, 0.0058906127]),
        ("shift = 0.2\nG = { yaw_rate = 1e-8 }", [0.3695245931, 0.0312150865]),
    ],
)
def test_quality_filter_has_the_reference_gains_and_its_sampled_poles(
    setting: str, expected: list[float]
) -> None:
    text = f'{YAW}\n[method]\nname = "quality"\n{setting}\n'
    plan = run(text, log_of(yaw_rate=1e-4 * noise())).findings.plan
    assert plan.design.gain[:, 0] == pytest.approx(expected, rel=1e-8)
    sampled = sampled_poles(plan.model.step.F, plan.model.C, plan.design.correction, DT)
    assert np.sort_complex(sampled) == pytest.approx(np.sort_complex(plan.design.poles), rel=1e-6)


def test_cycles_equal_one_design_with_as_many_times_the_process_noise() -> None:
    three = run(f'{YAW}\n[method]\nname = "cycles"\ncycles = 3\n', log_of(yaw_rate=1e-4 * noise()))
    once = run(
        YAW.replace("1e-12", "3e-12") + '\n[method]\nname = "quality"\n',
        log_of(yaw_rate=1e-4 * noise()),
    )
    gains = (found.findings.plan.design.gain for found in (three, once))
    assert next(gains) == pytest.approx(next(gains), rel=1e-8)


def test_cascade_repairs_a_first_stage_that_is_too_fast_with_errors_as_stated() -> None:
    rng, count = np.random.default_rng(3), 30_000
    A = np.array([[0.0, 1.0], [-1 / 7500, -200 / 7500]])
    F = expm(A * DT)
    states, x = np.empty((count, 2)), np.zeros(2)
    for k, w in enumerate(1e-6 * np.sqrt(DT) * rng.standard_normal(count)):
        states[k] = x
        x = F @ x + [0.0, w]
    measured = states[:, 0] + np.sqrt(2.5e-9 / DT) * rng.standard_normal(count)
    errors = {}
    for stages in (1, 2, 3):
        text = (
            f"{YAW}\n[method]\n"
            f'name = "cascade"\nstages = {stages}\nnoise_factor = 1e-4\ncorrelation_secs = 10\n'
        )
        found = run(text, log_of(yaw_rate=measured))
        errors[stages] = np.std((found["yaw_rate"] - states[:, 0])[3000:])
        assert errors[stages] == pytest.approx(found.std("yaw_rate")[-1], rel=0.1)
        assert "improves no filter" in found.findings.plan.design.remarks[-1]
    assert errors[2] < 0.6 * errors[1]
    assert errors[3] > errors[2]


def test_uncertainty_of_a_cascade_grows_in_a_gap_as_its_errors_do() -> None:
    """The oracle propagates the errors of both stages as one, from the gains of the plan."""
    measured = 1e-4 * noise(6000)
    measured[5400:] = np.nan
    measured[-1] = 0.0
    text = f'{YAW}\n[method]\nname = "cascade"\nstages = 2\ncorrelation_secs = 10\n'
    found = run(text, log_of(yaw_rate=measured))
    plan = found.findings.plan
    F, Q, C = plan.model.step.F, plan.model.step.Q, plan.model.C
    M, K = plan.design.correction, plan.design.stage_correction
    corrected = np.eye(2) - M @ C
    both = np.block([[corrected, np.zeros((2, 2))], [K @ corrected, np.eye(2) - K]])
    unmeasured = np.block([[np.eye(2), np.zeros((2, 2))], [K, np.eye(2) - K]])
    noisy = np.vstack((M, K @ M))
    F2, Q2, R = np.kron(np.eye(2), F), np.kron(np.ones((2, 2)), Q), np.diag(plan.model.r)
    P = solve_discrete_lyapunov(both @ F2, both @ Q2 @ both.T + noisy @ R @ noisy.T)
    stds = [np.sqrt(P[2, 2])]
    for _ in range(599):
        P = unmeasured @ (F2 @ P @ F2.T + Q2) @ unmeasured.T
        stds.append(np.sqrt(P[2, 2]))
    assert found.std("yaw_rate")[5399:-1] == pytest.approx(np.array(stds), rel=1e-3)
    assert stds[-1] > 1.2 * stds[0]


@pytest.mark.parametrize("method", ['"per-tick"\npoles = [-0.5, -0.6]', '"quality"'])
def test_a_constant_gain_on_a_step_without_measurements_is_refused(method: str) -> None:
    text = f"step_secs = 0.02\n{YAW}\n[method]\nname = {method}\n"
    with pytest.raises(
        UsageError, match=r"'yaw_rate' is measured every 0\.1 s, .* remove step_secs"
    ):
        run(text, log_of(yaw_rate=1e-4 * noise()))


@pytest.mark.parametrize(
    ("pattern", "gain"), [("butterworth", [0.1, 5, 0.125]), ("binomial", [0.15, 7.5, 0.125])]
)
def test_roll_moment_of_paper_four_is_observed_as_by_the_continuous_observer(
    pattern: str, gain: list[float]
) -> None:
    """The moment 0.25 Nm + 5e-3 Nm/s t on a roll at rest; the oracle integrates the paper's (8)."""
    log, true = example_script("paper_logs").roll_moment(np.random.default_rng(0))
    found, at = (
        run(paper_system("roll_moment").replace("butterworth", pattern), log),
        DT * np.arange(1001),
    )
    assert found.findings.plan.design.gain[:, 0] == pytest.approx(gain)
    L, A = np.array(gain), np.array([[0, 1e-3, 0], [0, 0, 1], [0, 0, 0]])

    def slope(t: float, x: FloatArray) -> FloatArray:
        return A @ x + L * ((0.25 * t + 5e-3 * t**2 / 2) / 1000 - x[0])

    exact = solve_ivp(slope, (0, at[-1]), np.zeros(3), t_eval=at, rtol=1e-9, atol=1e-12).y
    assert found["disturbance"] - true == pytest.approx(exact[1] - true, abs=3e-3)
    if pattern == "butterworth":  # reference values of the error at 10, 20, 50 and 100 s
        errors = true - found["disturbance"]
        expected = [0.24839095, 0.18202279, -0.03536208, -0.0264498]
        assert errors[[100, 200, 500, 1000]] == pytest.approx(expected, abs=3e-3)


def test_multi_level_placement_gives_both_outputs_the_poles_that_were_asked() -> None:
    text = """
    [plant]
    A = [[-0.3, -0.8, 0.0], [1.0, 0.0, 0.0], [0.1, 0.0, -0.2]]
    [outputs.x1]
    channel = "roll_rate"
    [outputs.x3]
    channel = "yaw_rate"
    [method]
    name = "multi-level"
    poles = [-0.9, [-0.5, 0.4]]
    """
    plan = run(text, log_of(roll_rate=noise(), yaw_rate=noise())).findings.plan
    expected = np.sort_complex([-0.9, -0.5 + 0.4j, -0.5 - 0.4j])
    closed = np.linalg.eigvals(plan.model.A - plan.design.gain @ plan.model.C)
    assert np.sort_complex(closed) == pytest.approx(expected)
    sampled = sampled_poles(plan.model.step.F, plan.model.C, plan.design.correction, DT)
    assert np.sort_complex(sampled) == pytest.approx(expected)


def test_reduced_order_is_the_observer_z_of_the_paper() -> None:
    """Against ω̂ = z + N y with its own recursion for z, in discrete time."""
    A = np.array([[-0.3, -0.8], [1.0, 0.0]])
    states = response(A, np.array([[1.0], [0.0]]), noise()[:, None], np.array([0.2, 0.1]))
    text = """
    [plant]
    A = [[-0.3, -0.8], [1.0, 0.0]]
    [outputs.x2]
    channel = "roll"
    [initial]
    state = { x1 = 0.0 }
    [method]
    name = "reduced-order"
    poles = [-1.5]
    """
    found = run(text, log_of(roll=states[:, 1]))
    F, y = expm(A * DT), states[:, 1]
    N = (F[0, 0] - np.exp(-1.5 * DT)) / F[1, 0]
    assert found.findings.plan.design.gain[:, 0] == pytest.approx([-0.3 + 1.5, 0])
    estimates = [N * (y[0] - found.chunk.predicted[0, 0])]
    z = estimates[0] - N * y[0]
    for k in range(len(y) - 1):
        z = (F[0, 0] - N * F[1, 0]) * (z + N * y[k]) + (F[0, 1] - N * F[1, 1]) * y[k]
        estimates.append(z + N * y[k + 1])
    assert found["x1"] == pytest.approx(np.array(estimates), abs=1e-12)
    assert found["x2"] == pytest.approx(y, abs=1e-15)


def test_a_state_that_is_replaced_by_its_measurement_has_no_finite_sampled_pole() -> None:
    F, C, M = np.diag([0.9, 0.8]), np.array([[1.0, 0.0]]), np.array([[1.0], [0.0]])
    poles = sampled_poles(F, C, M, 0.5)
    assert poles.tolist() == [complex(-np.inf, 0.0), pytest.approx(np.log(0.8) / 0.5)]


def test_matched_correction_is_exact_for_one_output_and_close_for_two() -> None:
    A, L = np.array([[0.0, 1.0], [-0.1, -0.05]]), np.array([[0.3], [0.1]])
    C = np.array([[1.0, 0.0]])
    M = matched_correction(A, C, L, DT)
    poles = sampled_poles(expm(A * DT), C, M, DT)
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.linalg.eigvals(A - L @ C)))
    both = np.array([[0.3, 0.05], [0.1, 0.2]])
    M = matched_correction(A, np.eye(2), both, DT)
    poles = sampled_poles(expm(A * DT), np.eye(2), M, DT)
    expected = np.sort_complex(np.linalg.eigvals(A - both))
    assert np.sort_complex(poles) == pytest.approx(expected, rel=0.02)


def test_reported_uncertainty_of_a_placed_gain_is_that_of_its_lyapunov_equation() -> None:
    text = f'{YAW}\n[method]\nname = "luenberger"\nfrequency = 0.3\n'
    found = run(text, log_of(yaw_rate=1e-4 * noise(2000)))
    plan = found.findings.plan
    T = np.eye(2) - plan.design.correction @ plan.model.C
    noise_part = plan.design.correction * plan.model.r @ plan.design.correction.T
    P = solve_discrete_lyapunov(T @ plan.model.step.F, T @ plan.model.step.Q @ T.T + noise_part)
    assert found.chunk.stds[-1] == pytest.approx(np.sqrt(np.diag(P)), rel=1e-6)


DISTURBANCES = {
    "constant": ("", 0.02 * np.ones(3000)),
    "ramp": ("", 0.02 + 1e-3 * DT * np.arange(3000)),
    "polynomial": ("degree = 2", 0.02 + 2e-6 * (DT * np.arange(3000)) ** 2),
    "exponential": ("rate = -0.01", 0.05 * np.exp(-0.01 * DT * np.arange(3000))),
    "harmonic": ("frequency = 0.6", 0.05 * np.sin(0.6 * DT * np.arange(3000) + 1)),
}


@pytest.mark.parametrize("model", DISTURBANCES)
@pytest.mark.parametrize("at", ["input", "sensor"])
def test_each_disturbance_is_found_on_the_rudder_and_on_the_gyro(model: str, at: str) -> None:
    setting, true = DISTURBANCES[model]
    rudder = 0.3 * np.sign(np.sin(0.05 * DT * np.arange(3000)))
    A, B = np.array([[-0.05, 0.0], [1.0, 0.0]]), np.array([[0.005], [0.0]])
    on_input, on_sensor = (true, 0.0) if at == "input" else (np.zeros(3000), true)
    states = response(A, B, (rudder + on_input)[:, None], np.zeros(2))
    target = "on_input = { rudder = 1.0 }" if at == "input" else "on_sensor = { yaw_rate = 1.0 }"
    text = f"""
    [plant]
    model = "yaw"
    T = 20
    K = 0.1
    heading = true
    [inputs.rudder]
    [outputs.yaw_rate]
    std = 1e-5
    [outputs.heading]
    std = 1e-5
    [[disturbance]]
    name = "found"
    model = "{model}"
    {setting}
    {target}
    """
    measured = states + 1e-5 * np.random.default_rng(0).standard_normal((3000, 2))
    log = log_of(rudder=rudder, yaw_rate=measured[:, 0] + on_sensor, heading=measured[:, 1])
    found = run(text, log)
    error, std = found["found"][-1] - true[-1], found.std("found")[-1]
    assert abs(error) < 4 * std
    assert std < 0.02 * np.abs(true).max()
    assert all(residuals.consistent for residuals in found.findings.residuals)


def test_the_same_wave_on_moment_and_gyro_is_refused_by_name() -> None:
    each = '[[disturbance]]\nname = "{}"\nmodel = "harmonic"\nfrequency = 0.6\n{}\n'
    text = (
        '[plant]\nmodel = "yaw"\nT = 20\nK = 0.1\n[inputs.rudder]\n[outputs.yaw_rate]\n'
        + each.format("wave moment", "on_input = { rudder = 1.0 }")
        + each.format("wave on gyro", "on_sensor = { yaw_rate = 1.0 }")
    )
    with pytest.raises(
        UsageError, match="'wave moment' and 'wave on gyro' cannot be distinguished"
    ):
        run(text, log_of(rudder=noise(), yaw_rate=noise()))


def test_two_shifts_that_violate_their_bound_are_refused_with_the_pole() -> None:
    """The dual of the example in which fast and slow shifts destabilise a regulator."""
    text = """
    [plant]
    A = [[-2.0, 0.0], [0.0, -0.2]]
    C = [[1.0, 1.0]]
    [outputs.sum]
    channel = "roll"
    std = 3.1622776601683795
    [method]
    name = "quality"
    shift = [6.0, 1.0]
    border = 1.0
    """
    with pytest.raises(UsageError, match=r"one is at 0\.216\d*; use one shift"):
        run(text, log_of(roll=0.1 * noise()))
    once = run(text.replace("[6.0, 1.0]", "1.0").replace("border = 1.0", ""), log_of(roll=noise()))
    assert once.findings.plan.design.poles.real.max() < -0.5


def test_a_gain_too_fast_for_the_samples_is_refused() -> None:
    A, L = np.array([[-1.6, -0.9], [1.2, 3.1]]), np.array([[-1.3, 13.7], [-6.7, 3.5]])
    assert np.linalg.eigvals(A - L).real.max() < 0
    with pytest.raises(UsageError, match=r"samples every 1 s are too rare for poles"):
        matched_correction(A, np.eye(2), L, 1.0)
