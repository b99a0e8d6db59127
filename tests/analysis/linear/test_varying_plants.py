"""Plants that vary along a trajectory: the ship of the papers, and a rigid body."""

from functools import cache

import numpy as np
import pytest
from channels import channel
from example_scripts import example_script
from linear_logs import DT, log_of
from places import SAMPLE_DATA
from scipy.integrate import solve_ivp
from trial_logs import InChunks, as_log

from analysis.design.augmentation import Plant
from analysis.linear.estimate import SystemEstimate, estimate
from analysis.linear.joined_system import OutputSampling, estimator_model
from analysis.linear.system import ChannelBinding, Linearisation, LinearSystem
from analysis.linear.system_file import parse_system
from recorders.simulated.sensors import suite
from recorders.simulated.simulate import simulate
from recorders.simulated.trajectory import Gust
from shiplog import TrialLog, UsageError, read
from shiplog.ships.paper import rudder_effect
from shiplog.types import FloatArray
from shiplog.vessel.vessel_parser import load_vessel

LOG = SAMPLE_DATA / "zigzag_20_20.mcap"
YAW = """
[plant]
model = "yaw"
vessel = "table1"
[outputs.yaw_rate]
[inputs.rudder]
[noise]
process = { yaw_acceleration_rest = 1e-14 }
"""
BODY = """
[plant]
model = "rigid-body"
inertia = [2000, 3000, 2500]
[outputs.roll]
std = 1e-6
[outputs.pitch]
std = 1e-6
[outputs.yaw]
channel = "heading"
std = 1e-6
[method]
"""
POINT = np.array([0.1, -0.2, 0.3, 0.05, -0.04, 0.06])


@cache
def truth() -> TrialLog:
    return read(SAMPLE_DATA / "zigzag_20_20.truth.mcap")


def error_share(found: SystemEstimate) -> float:
    """Return the rms error of the yaw rate from 60 s on over that of the gyro; truth of 2 Hz."""
    true = truth()["yaw_rate"].values[120:]
    errors = [v[600::5] - true for v in (found["yaw_rate"], found.chunk.measured[:, 0])]
    return float(np.std(errors[0]) / np.std(errors[1]))


def test_yaw_along_the_trajectory_is_more_accurate_than_the_gyro_and_white() -> None:
    found = estimate(LOG, parse_system(YAW, "yaw.toml"))
    assert error_share(found) < 0.1
    assert found.findings.residuals[0].white


def test_ticks_are_counted_from_the_start_of_the_clock_not_of_a_chunk() -> None:
    log = read(LOG).between(0, 60)
    system = parse_system("tick_secs = 2.0\n" + YAW, "yaw.toml")
    whole = estimate(log, system)
    cut = estimate(InChunks(log, [10.17, 30.0]), system)
    assert np.array_equal(whole.chunk.values, cut.chunk.values)
    assert np.array_equal(whole.chunk.stds, cut.chunk.stds)


@pytest.mark.parametrize("method", ["per-tick", "reduced-order"])
def test_gain_of_the_rigid_body_is_that_of_the_per_tick_page(method: str) -> None:
    count = 6 if method == "per-tick" else 3
    system = parse_system(f'{BODY}\nname = "{method}"\npoles = {[-0.5] * count}\n', "body.toml")
    assert system.linearise is not None
    sampling = OutputSampling(np.full(3, 1e-6), np.full(3, DT), DT)
    model = estimator_model(system, sampling, system.linearise(POINT, np.zeros(0)))
    gain = system.method.design(model).gain
    if method == "per-tick":
        assert gain[0] == pytest.approx([1.0058525977, 0.0779500126, -0.0087351559], abs=1e-9)
        assert gain[3] == pytest.approx([0.24999, 0.0161099183, 0.0415227586], abs=1e-9)
    else:
        N = [
            [0.5, 0.0159233966, 0.0910506131],
            [0.01, 0.4966701375, 0.0590348102],
            [0.016, -0.0698167916, 0.488807005],
        ]
        assert gain[3:] == pytest.approx(np.array(N), abs=1e-9)


@pytest.mark.parametrize(("method", "count"), [("per-tick", 6), ("reduced-order", 3)])
def test_rates_of_a_rigid_body_are_observed_from_its_angles(method: str, count: int) -> None:
    log, true = example_script("paper_logs").spacecraft(np.random.default_rng(0))
    text = f'{BODY}\nname = "{method}"\npoles = {[-0.5] * count}\n'
    found = estimate(log, parse_system(text, "body.toml"))
    rates = np.column_stack([found[f"{name}_rate"] for name in ("roll", "pitch", "yaw")])
    errors = np.abs(rates - true).max(axis=1)
    assert errors[0] > 1e-2
    assert errors[-1] < 1e-5


def test_a_rigid_body_that_pitches_through_the_vertical_is_refused_with_its_time() -> None:
    pitch = np.minimum(0.1 * DT * np.arange(300), np.pi / 2)
    log = log_of(roll=np.zeros(300), pitch=pitch, heading=np.zeros(300))
    text = f'{BODY}\nname = "reduced-order"\npoles = [-0.5, -0.5, -0.5]\n'
    with pytest.raises(UsageError, match=r"no gain at 15\.\d s"):
        estimate(log, parse_system(text, "body.toml"))


def test_a_constant_gain_for_a_varying_plant_is_refused() -> None:
    text = YAW + '[method]\nname = "luenberger"\nfrequency = 0.2\n'
    with pytest.raises(UsageError, match="use kalman, per-tick or reduced-order"):
        estimate(LOG, parse_system(text, "yaw.toml"))


def test_per_tick_gain_on_the_ship_is_placed_anew_and_follows_the_yaw_rate() -> None:
    text = "tick_secs = 1.0\n" + YAW + '[method]\nname = "per-tick"\npoles = [-0.3, -0.3]\n'
    found = estimate(LOG, parse_system(text, "yaw.toml"))
    assert error_share(found) < 0.5


def test_estimates_begin_where_the_inputs_are_known() -> None:
    count = 200
    late = np.full(count, np.nan)
    late[100:] = 0.1
    rate = channel(1e-3 * np.random.default_rng(0).standard_normal(count))
    rudder = channel(late[100:], DT * np.arange(100, count), "speed")
    text = """
    [plant]
    model = "yaw"
    T = 20
    K = 0.1
    [inputs.rudder]
    channel = "speed"
    [outputs.yaw_rate]
    """
    found = estimate(TrialLog("late.mcap", (rate, rudder)), parse_system(text, "yaw.toml"))
    assert np.isfinite(found["yaw_rate"]).all()
    assert len(found["yaw_rate"]) == 100


def test_a_gust_on_the_ship_is_found_along_its_trajectory() -> None:
    vessel, _ = load_vessel("table1")
    trial = simulate(
        vessel, "zigzag-20-20", duration_secs=500, seed=1, sensors=suite("white"),
        gusts=(Gust(np.radians(2), 200.0),),
    )  # fmt: skip
    text = (
        YAW
        + """
    [[disturbance]]
    name = "gust"
    unit = "rad/s3"
    model = "constant"
    on_state = { yaw_acceleration_rest = 1.0 }
    intensity = 1e-16
    """
    )
    found = estimate(as_log(trial), parse_system("tick_secs = 0.5\n" + text, "yaw.toml"))
    c = vessel.paper_coefficients
    approach = np.sqrt(-c.h * 80 / c.g)  # the speed straight ahead at 80 rpm
    moment = c.d * rudder_effect(c, approach, 80.0) * np.radians(2)
    assert np.mean(found["gust"][1000:2000]) / moment == pytest.approx(0, abs=0.1)
    assert np.mean(found["gust"][3500:]) / moment == pytest.approx(1, abs=0.05)


def test_headings_more_than_half_a_turn_apart_are_refused_with_the_offset_that_joins_them() -> None:
    heading = np.radians(350) + 0.01 * np.sin(DT * np.arange(300))
    order = np.full(300, np.radians(2))
    text = """
    [plant]
    A = [[-0.1]]
    B = [[0.1]]
    states = { heading = "rad" }
    [inputs.heading_order]
    [outputs.heading]
    std = 0.01
    [noise]
    process = { heading = 1e-4 }
    """
    log = log_of(heading=heading, heading_order=order)
    with pytest.raises(UsageError, match=r"offset of 'heading_order' to -6\.28318531"):
        estimate(log, parse_system(text, "loop.toml"))
    joined = text.replace("[inputs.heading_order]", "[inputs.heading_order]\noffset = -6.28318531")
    found = estimate(log, parse_system(joined, "loop.toml"))
    assert found["heading"][-1] == pytest.approx(np.radians(351), abs=0.05)


def test_a_pendulum_of_ones_own_is_linearised_at_its_estimate() -> None:
    """A system made in Python, with a function of its own; the truth by integration."""

    def linearise(x: FloatArray, _: FloatArray) -> Linearisation:
        J = np.array([[0.0, 1.0], [-np.cos(x[0]), 0.0]])
        return Linearisation(J, np.zeros((2, 0)), np.array([x[1], -np.sin(x[0])]) - J @ x)

    at = DT * np.arange(600)
    angle, rate = solve_ivp(
        lambda _, x: [x[1], -np.sin(x[0])], at[[0, -1]], [1.2, 0.3], t_eval=at, rtol=1e-9
    ).y
    system = LinearSystem(
        name="pendulum",
        plant=Plant(
            *linearise(np.zeros(2), np.zeros(0))[:2], np.eye(1, 2), ("angle", "rate"), ("angle",)
        ),
        D=np.zeros((1, 0)),
        units=("rad", "rad/s"),
        inputs=(),
        outputs=(ChannelBinding("angle", "roll", std=0.01),),
        W=np.diag([0.0, 1e-4]),
        linearise=linearise,
    )
    noisy = angle + 0.01 * np.random.default_rng(0).standard_normal(600)
    found = estimate(log_of(roll=noisy), system)
    assert np.std((found["rate"] - rate)[100:]) < 0.02
    assert np.mean(np.abs(found["angle"] - angle)[100:] < 2 * found.std("angle")[100:]) > 0.9
