import numpy as np
import pytest
from linear_logs import DT, log_of
from scipy.linalg import solve_continuous_are

from analysis.linear.estimate import SystemEstimate, estimate
from analysis.linear.system_file import parse_system
from shiplog import UsageError

SYSTEM = """
[plant]
A = [[-0.2, 0.0], [1.0, 0.0]]
B = [[0.3], [0.0]]
states = { roll_rate = "rad/s", roll = "rad" }
[inputs.rudder]
[outputs.roll]
std = 0.01
[noise]
process = { roll_rate = 1e-4, roll = 1e-6 }
[method]
name = "kalman"
gain = "steady-state"
[regulator]
P = { roll = 2.0 }
R = { rudder = 0.5 }
"""
A, B = np.array([[-0.2, 0.0], [1.0, 0.0]]), np.array([[0.3], [0.0]])
P, R = np.diag([0.0, 2.0]), np.array([[0.5]])


def run(text: str) -> SystemEstimate:
    rng = np.random.default_rng(0)
    rudder = 0.1 * np.sin(DT * np.arange(500))
    log = log_of(rudder=rudder, roll=0.01 * rng.standard_normal(500))
    return estimate(log, parse_system(text, "s.toml"))


def test_predicted_cost_is_that_of_the_linear_quadratic_gaussian_regulator() -> None:
    """J = tr(V W) + tr(S L' R L), V and S solving the Riccati equations of control and filter."""
    found = run(SYSTEM)
    V = solve_continuous_are(A, B, P, R)
    L = -np.linalg.solve(R, B.T @ V)
    W, r = np.diag([1e-4, 1e-6]), 0.01**2 * DT
    C = np.array([[0.0, 1.0]])
    S = solve_continuous_are(A.T, C.T, W, np.array([[r]]))
    expected = np.trace(V @ W) + np.trace(S @ L.T @ R @ L)
    feedback = found.findings.plan.feedback
    assert feedback is not None
    assert feedback.regulator.gain == pytest.approx(L, rel=1e-9)
    assert feedback.predicted.total == pytest.approx(expected, rel=1e-9)


def test_costs_and_commanded_inputs_follow_from_the_estimates() -> None:
    found = run(SYSTEM)
    chunk, costs, feedback = found.chunk, found.findings.costs, found.findings.plan.feedback
    assert costs is not None
    assert feedback is not None
    assert chunk.commanded == pytest.approx(chunk.values @ feedback.regulator.gain.T)
    assert costs.recorded.state == pytest.approx(np.mean(2.0 * found["roll"] ** 2))
    assert costs.recorded.input == pytest.approx(np.mean(0.5 * chunk.inputs**2))
    assert costs.feedback.input == pytest.approx(np.mean(0.5 * chunk.commanded**2))
    assert costs.feedback_rms[0] == pytest.approx(np.sqrt(np.mean(chunk.commanded**2)))


def test_three_cycles_equal_one_design_with_three_times_the_state_weight() -> None:
    three = run(SYSTEM + "cycles = 3\n").findings.plan.feedback
    once = run(SYSTEM.replace("roll = 2.0", "roll = 6.0")).findings.plan.feedback
    assert three is not None
    assert once is not None
    assert three.regulator.gain == pytest.approx(once.regulator.gain, rel=1e-8)


def test_shift_of_the_regulator_bounds_its_poles() -> None:
    feedback = run(SYSTEM + "shift = 2.0\n").findings.plan.feedback
    assert feedback is not None
    assert feedback.regulator.poles.real.max() < -1


def test_no_cost_is_predicted_with_a_disturbance_that_does_not_decay() -> None:
    text = SYSTEM.replace('gain = "steady-state"', 'gain = "time-varying"')
    disturbance = (
        '[[disturbance]]\nname = "list"\nmodel = "constant"\non_state = { roll_rate = 1 }\n'
    )
    costs = run(text + disturbance).findings.costs
    assert costs is not None
    assert np.isnan(costs.predicted.total)
    assert np.isfinite(costs.recorded.total)


@pytest.mark.parametrize(
    "method",
    ['"reduced-order"\npoles = [-0.5]', '"cascade"\nstages = 2\ncorrelation_secs = 10\n'],
)
def test_no_cost_is_predicted_of_an_estimator_that_its_gain_does_not_describe(method: str) -> None:
    """That of A - L C alone was four times, and a 250th, of the cost of the loop in samples."""
    found = run(SYSTEM.replace('"kalman"\ngain = "steady-state"', method))
    costs, design = found.findings.costs, found.findings.plan.design
    assert costs is not None
    assert design.gain is not None
    assert np.isnan(costs.predicted.total)


def test_a_mode_that_no_input_moves_is_refused() -> None:
    text = SYSTEM.replace("[[-0.2, 0.0], [1.0, 0.0]]", "[[-0.2, 0.0], [0.0, 0.1]]")
    with pytest.raises(UsageError, match="cannot be moved by B"):
        run(text)
