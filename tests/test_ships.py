"""Ship models: one interface, right motion, exact sensitivities."""

from collections.abc import Callable

import numpy as np
import pytest
from conftest import as_log
from scipy.integrate import solve_ivp

from recorders.sensors import suite
from recorders.simulate import SimulatedTrial, simulate
from shiplog import Signals, UsageError, Vessel, resample
from shiplog.ships import (
    LADDER,
    Model,
    Scale,
    burylin,
    drift_lag,
    nomoto,
    ship_model,
    slipstream,
    three_dof,
)
from shiplog.ships.motion import OUTPUTS, Forcing, motion, observed
from shiplog.ships.path import path_of
from shiplog.types import FloatArray

DT = 1.0
SCALE = Scale(20.0, 8.0, 90.0)
MOTIONS: dict[str, Callable[..., tuple[complex, ...]]] = {
    "nomoto": nomoto._motion,
    "norrbin": nomoto._motion,
    "burylin": burylin._motion,
    "burylin-tied": burylin._motion,
    "slipstream": slipstream._motion,
    "drift-lag": drift_lag._motion,
    "three-dof": three_dof._motion,
}


def a_run(seconds: float = 120.0) -> Signals:
    """A rudder to one side and to the other, in straight lines with knots on samples."""
    time = np.arange(round(seconds / DT) + 1) * DT
    rudder = np.interp(time, [5.0, 15.0, 40.0, 60.0], np.radians([0.0, 15.0, 15.0, -15.0]))
    return Signals(0, DT, {"rudder": rudder, "rpm": np.where(time < 70, 90.0, 80.0)})


def a_ship(name: str) -> tuple[Model, FloatArray, FloatArray, Scale]:
    """A model, parameters at which all of it acts, an initial state, and its scale."""
    model = ship_model(name)
    start = model.starts()
    parameters = start + 0.1 * np.where(start == 0, 1.0, np.abs(start))
    if not model.dimensionless:
        parameters[model.names.index("b3")] = -0.5
    scale = model.scale(160.0, 8.0, 90.0)
    begins = {"speed": 8.0 / scale.speed, "yaw_rate": 1e-3 * scale.secs, "sway": 0.01}
    state = np.array([begins.get(value.channel or "", 0.0) for value in model.state])
    return model, parameters, state, scale


@pytest.mark.parametrize("name", LADDER)
def test_every_model_moves_as_scipy_integrates_its_equations(name: str) -> None:
    model, parameters, state, scale = a_ship(name)
    signals = a_run()
    path, n = path_of(signals), len(signals)
    found = model.simulate(parameters, state, path, n, offset=0.02, scale=scale)
    c = model.kind(*(complex(v) for v in model.expand(parameters.astype(complex))))
    x, rows, scaled = state.astype(complex), [state], scale.scaled(path)
    for k in range(n - 1):

        def rates(t: float, x: FloatArray, k: int = k) -> FloatArray:
            u = Forcing(scaled.delta[k] + scaled.delta_dot[k] * t + 0.02, scaled.delta_dot[k],
                        scaled.rpm[k])  # fmt: skip
            return np.real(MOTIONS[name](c, x, u))

        x = solve_ivp(rates, (0, scaled.secs[k]), np.real(x), rtol=1e-10, atol=1e-13).y[:, -1]
        rows.append(x)
    yaw = [v.channel for v in model.state].index("yaw_rate")
    heading = [v.channel for v in model.state].index("heading")
    states = np.array(rows)
    np.testing.assert_allclose(found[:, 0] * scale.secs, states[:, yaw], atol=1e-6)
    np.testing.assert_allclose(found[:, 3], states[:, heading], atol=1e-5)
    assert np.isfinite(found).all()


@pytest.mark.parametrize("name", LADDER)
def test_sensitivities_are_the_derivatives(name: str) -> None:
    model, parameters, state, scale = a_ship(name)
    signals = a_run()
    path, n, p = path_of(signals), len(signals), len(parameters)
    directions = np.eye(p + len(state) + 1)
    found = model.sensitivities(parameters, state, path, n, directions, offset=0.01, scale=scale)
    at = np.concatenate((parameters, state, [0.01]))
    for along, exact in zip(directions, found, strict=True):
        h = 1e-5 * max(abs(float(at @ along)), 1e-2)

        def moved(by: float, along: FloatArray = along) -> FloatArray:
            z = at + by * along
            return model.simulate(z[:p], z[p:-1], path, n, offset=float(z[-1]), scale=scale)

        differences = (moved(h) - moved(-h)) / (2 * h)
        size = np.abs(exact).max(axis=0) + 1e-9
        np.testing.assert_allclose(exact / size, differences / size, atol=2e-5)


@pytest.fixture(scope="module")
def voyage(vessel: Vessel) -> SimulatedTrial:
    return simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=suite("none"))


def test_the_papers_model_is_the_one_that_is_simulated(
    voyage: SimulatedTrial, vessel: Vessel
) -> None:
    signals = resample(as_log(voyage), channels=("yaw_rate", "speed", "rudder", "rpm"))
    model = ship_model("burylin")
    state = np.array([0.0, 0.0, signals["speed"][0], 0.0])
    parameters = np.array(vessel.coefficients)
    out = model.simulate(parameters, state, path_of(signals), len(signals))
    # the rudder's knots lie between samples: without them these would be off by 3e-6
    np.testing.assert_allclose(out[:, 0], signals["yaw_rate"], atol=2e-9)
    np.testing.assert_allclose(out[:, 1], signals["speed"], atol=1e-7)


def test_knots_between_samples_are_put_back() -> None:
    time = np.arange(0.0, 40.0, 1.0)
    knots, angles = [10.3, 14.7, 25.45, 33.2], [0.0, 0.2, 0.2, -0.1]
    rudder = np.interp(time, knots, angles)
    path = path_of(Signals(0, 1.0, {"rudder": rudder, "rpm": np.full(40, 80.0)}))
    begins = np.concatenate(([0.0], np.cumsum(path.secs)))[:-1]
    assert set(np.round(knots, 6)) <= set(np.round(begins, 6))
    np.testing.assert_allclose(path.delta, np.interp(begins, knots, angles), atol=1e-9)
    assert path.sample[path.sample >= 0].tolist() == list(range(1, 40))


def test_a_rudder_that_is_not_straight_is_left_as_it_was_measured() -> None:
    rudder = np.random.default_rng(1).normal(size=50)
    path = path_of(Signals(0, 1.0, {"rudder": rudder, "rpm": np.full(50, 80.0)}))
    assert len(path.secs) == 49
    np.testing.assert_array_equal(path.delta, rudder[:-1])


def test_a_slow_clock_is_walked_in_short_steps() -> None:
    path = path_of(Signals(0, 10.0, {"rudder": np.linspace(0, 1, 4), "rpm": np.full(4, 80.0)}))
    assert path.secs.max() <= 2.0
    assert path.sample[path.sample >= 0].tolist() == [1, 2, 3]
    np.testing.assert_allclose(path.secs.sum(), 30.0)


def test_the_ties_leave_the_papers_own_coefficients(vessel: Vessel) -> None:
    model, c = ship_model("burylin-tied"), vessel.coefficients
    values = c._asdict() | {"T3": c.e / c.d}
    tied = model.expand(np.array([values[name] for name in model.names], complex))
    np.testing.assert_allclose(np.real(tied), c, rtol=1e-12)


def test_a_ship_that_runs_away_ends_in_nan() -> None:
    model, parameters, state, scale = a_ship("slipstream")
    parameters[model.names.index("b2")] = 50.0
    out = model.simulate(parameters, state, path_of(a_run()), 121, scale=scale)
    assert np.isnan(out[-1]).all()
    assert np.isfinite(out[0]).all()


def test_unknown_models_and_parameters_are_refused_with_the_nearest() -> None:
    with pytest.raises(UsageError, match="did you mean 'nomoto'"):
        ship_model("nomotto")
    with pytest.raises(UsageError, match=r"no parameter 'b4'.*it has a, b1"):
        ship_model("burylin").parameter("b4")


def test_what_has_no_equations_says_so() -> None:
    with pytest.raises(NotImplementedError, match="tuple"):
        motion((), (), Forcing(0, 0, 0))
    with pytest.raises(NotImplementedError, match="tuple"):
        observed((), ())


def test_outputs_of_a_model_are_known_ones() -> None:
    for name in LADDER:
        assert set(ship_model(name).outputs) <= set(OUTPUTS)
