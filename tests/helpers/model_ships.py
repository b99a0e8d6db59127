"""A ship of each dimensionless model: its vessel file, and its equations written a second time."""

from collections.abc import Callable, Mapping

import numpy as np

from shiplog import Vessel
from shiplog.types import FloatArray
from shiplog.vessel.vessel_parser import parse_vessel

LENGTH, SPEED, RPM = 180.0, 8.0, 90.0
_SLIPSTREAM = {
    "a": -1.6, "b1": -0.4, "b2": -2.0, "k": 0.7, "m": 0.4, "T3": 0.3,
    "f": -0.4, "g": -0.05, "h": 0.05, "c1": -0.4, "c2": -0.1,
}  # fmt: skip
SHIPS: dict[str, dict[str, float]] = {
    "nomoto": {"a": -0.6, "k": 0.5, "f": -0.5, "g": -0.05, "h": 0.05},
    "norrbin": {"a": -0.4, "a3": -1.0, "k": 0.5, "f": -0.5, "g": -0.05, "h": 0.05},
    "slipstream": _SLIPSTREAM,
    "drift-lag": _SLIPSTREAM
    | {"f": -0.2, "f1": 0.4, "f2": -0.3, "Td": 0.4, "e0": 0.01, "h": 0.06, "g": -0.06},
    "three-dof": {
        "yv": -0.75, "yr": -0.45, "cy": 1.0, "yd": -0.15, "nv": -3.0, "nr": -2.0, "cn": 12.0,
        "nd": 1.0, "m": 0.4, "w": 0.4, "xvr": 1.2, "x4": 1.5, "g": 0.02, "h": 0.05, "p": 0.7,
        "xd": -0.1,
    },
}  # fmt: skip


def toml_of(name: str, parameters: Mapping[str, float] | None = None, head: str = "") -> str:
    """The text of the vessel file of a ship of a model, with the section `[model]` alone."""
    values = SHIPS[name] if parameters is None else parameters
    lines = [f'name = "a {name}"', f"length = {LENGTH}", f"approach_rpm = {RPM}", head]
    lines += ["[model]", f'name = "{name}"', f"speed = {SPEED}", f"rpm = {RPM}"]
    return "\n".join([*lines, *(f"{key} = {value!r}" for key, value in values.items())]) + "\n"


def vessel_of(name: str) -> Vessel:
    """Return the ship of a model as parsed from its vessel file."""
    return parse_vessel(toml_of(name), f"{name}.toml")


# ---- the equations as the models' files document them: rates, speed ahead and sway

Motion = tuple[list[float], float, float]


def _first_order(p: Mapping[str, float], x: FloatArray, d: float, _: float, n: float) -> Motion:
    r, u = x[:2]
    yaw = p["a"] * r + p.get("a3", 0.0) * r**3 + p["k"] * d
    return [yaw, p["f"] * r**2 + p["g"] * u**2 + p["h"] * n, r], u, 0.0


def _yaw(p: Mapping[str, float], r: float, r_dot: float, u: float, d: float, d_dot: float,
             n: float) -> float:  # fmt: skip
    ks = p["k"] * ((1 - p["m"]) * u**2 + p["m"] * n**2)
    hull = p["a"] * u * r_dot + p["b1"] * u**2 * r + p["b2"] * u * r * abs(r)
    return hull + ks * (u * d + p["T3"] * d_dot)


def _slipstream(p: Mapping[str, float], x: FloatArray, d: float, d_dot: float, n: float) -> Motion:
    r, r_dot, u = x[:3]
    v = p["c1"] * r + p["c2"] * r * abs(r) / u
    surge = p["f"] * r**2 + p["g"] * u**2 + p["h"] * n
    return [r_dot, _yaw(p, r, r_dot, u, d, d_dot, n), surge, r], np.sqrt(u**2 - v**2), v


def _drift_lag(p: Mapping[str, float], x: FloatArray, d: float, d_dot: float, n: float) -> Motion:
    r, r_dot, u, v = x[:4]
    surge = p["f"] * r**2 + p["f1"] * r * v + p["f2"] * v**2 + p["g"] * u**2 + p["h"] * n
    drift = (p["c1"] * u * r + p["c2"] * r * abs(r) - u * v) / p["Td"]
    yaw = _yaw(p, r, r_dot, u, d, d_dot, n) + p["e0"] * u * n**2
    return [r_dot, yaw, surge, drift, r], np.sqrt(u**2 - v**2), v


def _three_dof(p: Mapping[str, float], x: FloatArray, d: float, _: float, n: float) -> Motion:
    r, v, u = x[:3]
    at, weights = np.polynomial.legendre.leggauss(5)
    flow = v + at / 2 * r
    y = float(weights / 2 @ (np.abs(flow) * flow))
    moment = float(weights / 2 @ (np.abs(flow) * flow * at / 2))
    s = (1 - p["m"]) * u**2 + p["m"] * n**2
    force = s * d + p["w"] * np.sqrt(s) * (v - 0.8 * r)
    surge = p["h"] * (n * (n + p["p"] * (n - u)) - (1 + p["g"]) * u**2) + p["xd"] * force * d
    surge += p["xvr"] * v * r + p["x4"] * v**4 / (u**2 + v**2)
    yaw = p["nv"] * u * v + p["nr"] * u * r - p["cn"] * moment + p["nd"] * force
    drift = p["yv"] * u * v + p["yr"] * u * r - p["cy"] * y + p["yd"] * force
    return [yaw, drift, surge, r], u, v


EQUATIONS: dict[str, Callable[..., Motion]] = {
    "nomoto": _first_order,
    "norrbin": _first_order,
    "slipstream": _slipstream,
    "drift-lag": _drift_lag,
    "three-dof": _three_dof,
}
AHEAD = {"nomoto": 1, "norrbin": 1, "slipstream": 2, "drift-lag": 2, "three-dof": 2}


def rates_in_si(name: str, x: FloatArray, rudder: tuple[float, float], rpm: float,
                *, moment: float = 0.0, force: float = 0.0) -> FloatArray:  # fmt: skip
    """The rates per s of a dimensionless state, and after it of the position in metres.

    `moment` is a yaw moment as the rudder that turns the ship as much on its approach at `RPM`.
    """
    p, secs, (d, d_dot) = SHIPS[name], LENGTH / SPEED, rudder
    own, ahead, sway = EQUATIONS[name](p, x, d, d_dot * secs, rpm / RPM)
    straight = np.zeros(len(own))
    straight[AHEAD[name]] = approach(name) / SPEED
    sides = [np.array(EQUATIONS[name](p, straight, side * moment, 0.0, 1.0)[0]) for side in (1, -1)]
    rates = (np.array(own) + (sides[0] - sides[1]) / 2) / secs
    rates[AHEAD[name]] += force / SPEED
    heading = x[len(own) - 1]
    over_ground = SPEED * complex(ahead, sway) * np.exp(1j * heading)
    return np.array([*rates, over_ground.real, over_ground.imag])


def approach(name: str) -> float:
    """The steady speed at `RPM`, m/s: the surge equations above solved by hand."""
    p = SHIPS[name]
    if name != "three-dof":
        return SPEED * float(np.sqrt(p["h"] / -p["g"]))
    thrust, drag = p["p"], 1 + p["g"]  # 1 + p (1 - u) - (1 + g) u^2 = 0
    return SPEED * float((-thrust + np.sqrt(thrust**2 + 4 * drag * (1 + thrust))) / (2 * drag))
