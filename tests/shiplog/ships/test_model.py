"""Ship models: simulated runs and sensitivities against independent references."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from trial_logs import as_log

from recorders.simulated.sensors import suite
from recorders.simulated.simulate import SimulatedTrial, simulate
from shiplog import Signals, Vessel, resample
from shiplog.ships import (
    Model,
    Scale,
    model_names,
    ship_model,
)
from shiplog.ships.motion import MODEL_OUTPUTS, Forcing, observed, state_rates
from shiplog.ships.path import input_path
from shiplog.types import FloatArray

DT = 1.0
LENGTH, SPEED, RPM = 160.0, 8.0, 90.0
TOLERANCES = {"yaw_rate": 1e-7, "speed": 1e-5, "sway": 1e-5, "heading": 1e-5}


# ---- the models written again from their descriptions: rates of the state, and outputs


Oracle = Callable[[SimpleNamespace, FloatArray, float, float, float], tuple[list[float], ...]]


def as_norrbin(
    c: SimpleNamespace, x: FloatArray, delta: float, _: float, eta: float
) -> tuple[list[float], ...]:
    rho, nu, psi = x
    a3 = getattr(c, "a3", 0.0)
    rates = [c.a * rho + a3 * rho**3 + c.k * delta, c.f * rho**2 + c.g * nu**2 + c.h * eta, rho]
    return rates, [rho, nu, 0.0, psi]


def as_burylin(
    c: SimpleNamespace, x: FloatArray, delta: float, delta_dot: float, n: float
) -> tuple[list[float], ...]:
    w, w_dot, v, psi = x
    b1, e = (-c.d, c.T3 * c.d) if hasattr(c, "T3") else (c.b1, c.e)
    ks = c.alpha1 * v + c.alpha2 * n * np.exp(-c.alpha3 * v)
    w_2dot = c.a * w_dot + b1 * w + c.b2 * w * abs(w) + c.b3 * w**3
    w_2dot += ks * (c.d * delta + e * delta_dot)
    return [w_dot, w_2dot, c.f * w**2 + c.g * v**2 + c.h * n, w], [w, v, 0.0, psi]


def turning(
    c: SimpleNamespace, rho: float, rho_dot: float, nu: float, delta: float, delta_dot: float,
    eta: float,
) -> float:  # fmt: skip
    """rho'' of the slipstream model."""
    ks = c.k * ((1 - c.m) * nu**2 + c.m * eta**2)
    hull = c.a * nu * rho_dot + c.b1 * nu**2 * rho + c.b2 * nu * rho * abs(rho)
    return float(hull + ks * (nu * delta + c.T3 * delta_dot))


def as_slipstream(
    c: SimpleNamespace, x: FloatArray, delta: float, delta_dot: float, eta: float
) -> tuple[list[float], ...]:
    rho, rho_dot, nu, psi = x
    sigma = c.c1 * rho + c.c2 * rho * abs(rho) / nu
    rates = [
        rho_dot,
        turning(c, rho, rho_dot, nu, delta, delta_dot, eta),
        c.f * rho**2 + c.g * nu**2 + c.h * eta,
        rho,
    ]
    return rates, [rho, np.sqrt(nu**2 - sigma**2), sigma, psi]


def as_drift_lag(
    c: SimpleNamespace, x: FloatArray, delta: float, delta_dot: float, eta: float
) -> tuple[list[float], ...]:
    rho, rho_dot, nu, sigma, psi = x
    rates = [
        rho_dot,
        turning(c, rho, rho_dot, nu, delta, delta_dot, eta) + c.e0 * nu * eta**2,
        c.f * rho**2 + c.f1 * rho * sigma + c.f2 * sigma**2 + c.g * nu**2 + c.h * eta,
        (c.c1 * nu * rho + c.c2 * rho * abs(rho) - nu * sigma) / c.Td,
        rho,
    ]
    return rates, [rho, np.sqrt(nu**2 - sigma**2), sigma, psi]


def as_three_dof(
    c: SimpleNamespace, x: FloatArray, delta: float, _: float, eta: float
) -> tuple[list[float], ...]:
    rho, sigma, nu, psi = x
    at, weights = np.polynomial.legendre.leggauss(5)  # the rule is a part of the model
    along = at / 2
    flow = weights / 2 * np.abs(sigma + along * rho) * (sigma + along * rho)
    side, moment = flow.sum(), (along * flow).sum()
    s = (1 - c.m) * nu**2 + c.m * eta**2
    rudder = s * delta + c.w * np.sqrt(s) * (sigma - 0.8 * rho)
    surge = c.h * (eta * (eta + c.p * (eta - nu)) - (1 + c.g) * nu**2) + c.xd * rudder * delta
    surge += c.xvr * sigma * rho + c.x4 * sigma**4 / (nu**2 + sigma**2)
    rates = [
        c.nv * nu * sigma + c.nr * nu * rho - c.cn * moment + c.nd * rudder,
        c.yv * nu * sigma + c.yr * nu * rho - c.cy * side + c.yd * rudder,
        surge,
        rho,
    ]
    return rates, [rho, nu, sigma, psi]


def as_mmg(
    c: SimpleNamespace, x: FloatArray, delta: float, _: float, eta: float
) -> tuple[list[float], ...]:
    rho, sigma, nu, psi = x
    speed = np.hypot(nu, sigma)

    def hull(k: str) -> float:
        cubic = [sigma**3, sigma**2 * rho, sigma * rho**2, rho**3]
        terms = [getattr(c, k + name) for name in ("vvv", "vvr", "vrr", "rrr")]
        linear = getattr(c, k + "v") * sigma + getattr(c, k + "r") * rho
        return float(speed * linear + np.dot(terms, cubic) / speed)

    slip = (rho / 2 - sigma) / speed
    wake = c.cw + np.sign(slip) * c.dcw
    into = nu * (1 + wake * (1 - np.exp(-2 * abs(slip))))
    thrust = abs(eta) * (eta + c.p * (eta - into))

    def race(u: float, t: float) -> float:
        behind = u + c.k * (np.sqrt(u**2 + c.ct * t) - u)
        return float(c.d * behind**2 + (1 - c.d) * u**2)

    ahead = np.sqrt(race(into, thrust) / race(1.0, 1.0) + c.ms * (into**2 - eta**2))
    side = sigma + c.lr * rho
    across = -(c.gamma + np.sign(side) * c.dgamma) * side
    force = c.f0 * (ahead**2 + across**2) * np.sin(delta - np.arctan2(across, ahead))
    surge = (
        (c.m + c.my + c.xvr) * sigma * rho + c.xvv * sigma**2 + (c.xrr + c.xg * c.m) * rho**2
        + c.xvvvv * sigma**4 / speed**2 + c.r0 * (thrust - (1 + c.g) * nu * abs(nu))
        - (1 - c.tr) * force * np.sin(delta)
    )  # fmt: skip
    sway = -(c.m + c.mx) * nu * rho + hull("y") - (1 + c.ah) * force * np.cos(delta)
    yaw = -c.xg * c.m * nu * rho + hull("n") + (0.5 - c.ah * c.xh) * force * np.cos(delta)
    sway, yaw = sway - 2 * c.nw * thrust, yaw + c.nw * thrust
    inertia = [[c.m + c.my, c.xg * c.m], [c.xg * c.m, c.iz]]
    sigma_dot, rho_dot = np.linalg.solve(inertia, [sway, yaw])
    return [rho_dot, sigma_dot, surge / (c.m + c.mx), rho], [rho, nu, sigma, psi]


ORACLES: dict[str, Oracle] = {
    "mmg": as_mmg,
    "nomoto": as_norrbin,
    "norrbin": as_norrbin,
    "burylin": as_burylin,
    "burylin-tied": as_burylin,
    "slipstream": as_slipstream,
    "drift-lag": as_drift_lag,
    "three-dof": as_three_dof,
}


def a_run(seconds: float = 120.0) -> Signals:
    """A rudder to both sides, in straight lines with knots on samples."""
    time = np.arange(round(seconds / DT) + 1) * DT
    rudder = np.interp(time, [5.0, 15.0, 40.0, 60.0], np.radians([0.0, 15.0, 15.0, -15.0]))
    return Signals(0, DT, {"rudder": rudder, "rpm": np.where(time < 70, 90.0, 80.0)})


def a_ship(name: str) -> tuple[Model, FloatArray, FloatArray, Scale]:
    """A model, parameters at which every term acts, an initial state, and the scale."""
    model = ship_model(name)
    start = model.start_values()
    parameters = start + 0.1 * np.array([parameter.size for parameter in model.parameters])
    if not model.dimensionless:
        parameters[model.names.index("b3")] = -0.5
    scale = model.scale(LENGTH, SPEED, RPM)
    begins = {"speed": SPEED / scale.speed, "yaw_rate": 1e-3 * scale.secs, "sway": 0.02}
    state = np.array([begins.get(value.channel or "", 0.0) for value in model.state])
    return model, parameters, state, scale


def integrated(
    name: str, parameters: FloatArray, state: FloatArray, signals: Signals, offset: float
) -> FloatArray:
    """(n, 4) the outputs by scipy: a linear rudder between samples, constant revolutions."""
    model, secs = ship_model(name), LENGTH / SPEED
    units = (1.0, 1.0, 1.0) if "burylin" in name else (secs, SPEED, RPM)
    c = SimpleNamespace(**dict(zip(model.names, parameters.tolist(), strict=True)))
    rudder, eta = signals["rudder"] + offset, signals["rpm"] / units[2]
    slopes = np.diff(rudder) / DT
    states = [state]
    for begun, slope, driven in zip(rudder, slopes, eta, strict=False):

        def rates(
            t: float, x: FloatArray, begun: float = begun, slope: float = slope, n: float = driven
        ) -> FloatArray:
            result = ORACLES[name](c, x, begun + slope * t, slope * units[0], n)[0]
            return np.array(result) / units[0]

        states.append(solve_ivp(rates, (0, DT), states[-1], rtol=1e-10, atol=1e-13).y[:, -1])
    outputs = np.array([ORACLES[name](c, x, 0.0, 0.0, 0.0)[1] for x in states])
    return np.asarray(outputs * [1 / units[0], units[1], units[1], 1.0])


@pytest.mark.parametrize("name", model_names())
def test_every_model_agrees_with_scipys_integration_of_its_equations(name: str) -> None:
    model, parameters, state, scale = a_ship(name)
    signals = a_run()
    result = model.simulate(
        parameters, state, input_path(signals), len(signals), offset=0.02, scale=scale
    )
    exact = integrated(name, parameters, state, signals, 0.02)
    assert np.ptp(exact[:, 3]) > 0.1
    for output, got, right in zip(MODEL_OUTPUTS, result.T, exact.T, strict=True):
        np.testing.assert_allclose(got, right, atol=TOLERANCES[output], err_msg=output)


@pytest.mark.parametrize("name", model_names())
def test_sensitivities_are_the_derivatives_of_the_outputs(name: str) -> None:
    model, parameters, state, scale = a_ship(name)
    signals = a_run()
    path, n, p = input_path(signals), len(signals), len(parameters)
    directions = np.eye(p + len(state) + 1)
    result = model.sensitivities(parameters, state, path, n, directions, offset=0.01, scale=scale)
    at = np.concatenate((parameters, state, [0.01]))
    for along, exact in zip(directions, result, strict=True):
        h = 1e-5 * max(abs(float(at @ along)), 1e-2)

        def moved(by: float, along: FloatArray = along) -> FloatArray:
            z = at + by * along
            return model.simulate(z[:p], z[p:-1], path, n, offset=float(z[-1]), scale=scale)

        differences = (moved(h) - moved(-h)) / (2 * h)
        size = np.abs(exact).max(axis=0) + 1e-9
        np.testing.assert_allclose(exact / size, differences / size, atol=2e-5)


@pytest.mark.parametrize("name", ["nomoto", "burylin-tied", "three-dof"])
def test_derivatives_along_many_directions_are_those_along_each_to_the_last_bit(name: str) -> None:
    model, parameters, state, scale = a_ship(name)
    path, n = input_path(a_run()), 121
    directions = np.random.default_rng(5).normal(size=(4, len(parameters) + len(state) + 1))
    together = model.propagate(parameters, state, path, n, directions, scale=scale)
    assert np.any(together.outputs_by[0] != together.outputs_by[1])
    for i in range(len(directions)):
        alone = model.propagate(parameters, state, path, n, directions[[i]], scale=scale)
        np.testing.assert_array_equal(alone.outputs_by[0], together.outputs_by[i])
        np.testing.assert_array_equal(alone.end_by[0], together.end_by[i])
        np.testing.assert_array_equal(alone.end, together.end)


@pytest.fixture(scope="module")
def trial(vessel: Vessel) -> SimulatedTrial:
    return simulate(vessel, "zigzag-20-20", duration_secs=500.0, sensors=suite("none"))


def test_the_papers_model_reproduces_the_recorder_simulation(
    trial: SimulatedTrial, vessel: Vessel
) -> None:
    signals = resample(as_log(trial), channels=("yaw_rate", "speed", "rudder", "rpm"))
    model = ship_model("burylin")
    state = np.array([0.0, 0.0, signals["speed"][0], 0.0])
    parameters = np.array(vessel.coefficients)
    out = model.simulate(parameters, state, input_path(signals), len(signals))
    # the rudder's knots lie between samples: without them the error would be 3e-6
    np.testing.assert_allclose(out[:, 0], signals["yaw_rate"], atol=2e-9)
    np.testing.assert_allclose(out[:, 1], signals["speed"], atol=1e-7)


def test_knots_between_samples_are_restored() -> None:
    time = np.arange(0.0, 40.0, 1.0)
    knots, angles = [10.3, 14.7, 25.45, 33.2], [0.0, 0.2, 0.2, -0.1]
    rudder = np.interp(time, knots, angles)
    path = input_path(Signals(0, 1.0, {"rudder": rudder, "rpm": np.full(40, 80.0)}))
    begins = np.concatenate(([0.0], np.cumsum(path.secs)))[:-1]
    assert set(np.round(knots, 6)) <= set(np.round(begins, 6))
    np.testing.assert_allclose(path.delta, np.interp(begins, knots, angles), atol=1e-9)
    assert path.sample[path.sample >= 0].tolist() == list(range(1, 40))


def test_a_rudder_without_straight_lines_keeps_its_samples() -> None:
    rudder = np.random.default_rng(1).normal(size=50)
    path = input_path(Signals(0, 1.0, {"rudder": rudder, "rpm": np.full(50, 80.0)}))
    assert len(path.secs) == 49
    np.testing.assert_array_equal(path.delta, rudder[:-1])


def test_a_slow_clock_is_divided_into_short_steps() -> None:
    path = input_path(Signals(0, 10.0, {"rudder": np.linspace(0, 1, 4), "rpm": np.full(4, 80.0)}))
    assert path.secs.max() <= 2.0
    assert path.sample[path.sample >= 0].tolist() == [1, 2, 3]
    np.testing.assert_allclose(path.secs.sum(), 30.0)


def test_the_tied_model_expands_to_the_papers_coefficients(vessel: Vessel) -> None:
    model, c = ship_model("burylin-tied"), vessel.coefficients
    values = c._asdict() | {"T3": c.e / c.d}
    tied = model.expand(np.array([values[name] for name in model.names], complex))
    np.testing.assert_allclose(np.real(tied), c, rtol=1e-12)


def test_a_diverging_run_ends_in_nan() -> None:
    model, parameters, state, scale = a_ship("slipstream")
    parameters[model.names.index("b2")] = 50.0
    out = model.simulate(parameters, state, input_path(a_run()), 121, scale=scale)
    assert np.isnan(out[-1]).all()
    assert np.isfinite(out[0]).all()


def test_a_type_without_equations_is_reported() -> None:
    with pytest.raises(NotImplementedError, match="tuple"):
        state_rates((), (), Forcing(0, 0, 0))
    with pytest.raises(NotImplementedError, match="tuple"):
        observed((), ())


def test_the_outputs_of_a_model_are_among_those_of_all_models() -> None:
    for name in model_names():
        assert set(ship_model(name).outputs) <= set(MODEL_OUTPUTS)
