"""The Mariner class cargo ship, by its full nonlinear equations.

M. S. Chislett and J. Strøm-Tejsen, "Planar motion mechanism tests and full-scale steering and
manoeuvring predictions for a Mariner class vessel", Hydro- and Aerodynamics Laboratory, Lyngby,
report Hy-6, 1965; the coefficients and the matrix of inertia as in T. I. Fossen, "Guidance and
control of ocean vehicles", 1994. Positive rudder turns the bow to starboard here.
"""

from math import hypot

LENGTH = 160.93  # m
SPEED = 7.7175  # m/s, for which the coefficients hold
RPM = 80.0
RUDDER_RATE_DEG = 5.0  # per second

MASS, INERTIA, CENTRE = 798e-5, 39.2e-5, -0.023
X_UDOT, Y_VDOT, Y_RDOT, N_VDOT, N_RDOT = -42e-5, -748e-5, -9.354e-5, 4.646e-5, -43.8e-5
X = {
    "u": -184e-5, "uu": -110e-5, "uuu": -215e-5, "vv": -899e-5, "rr": 18e-5, "rv": 798e-5,
    "dd": -95e-5, "udd": -190e-5, "vd": 93e-5, "uvd": 93e-5,
}  # fmt: skip
Y = {
    "v": -1160e-5, "r": -499e-5, "vvv": -8078e-5, "vvr": 15356e-5, "vu": -1160e-5, "ru": -499e-5,
    "d": 278e-5, "ddd": -90e-5, "ud": 556e-5, "uud": 278e-5, "vdd": -4e-5, "vvd": 1190e-5,
    "0": -4e-5, "0u": -8e-5, "0uu": -4e-5,
}  # fmt: skip
N = {
    "v": -264e-5, "r": -166e-5, "vvv": 1636e-5, "vvr": -5483e-5, "vu": -264e-5, "ru": -166e-5,
    "d": -139e-5, "ddd": 45e-5, "ud": -278e-5, "uud": -139e-5, "vdd": 13e-5, "vvd": -489e-5,
    "0": 3e-5, "0u": 6e-5, "0uu": 3e-5,
}  # fmt: skip


def lateral(c: dict[str, float], u: float, v: float, r: float, d: float) -> float:
    """Return a lateral force or a yaw moment, nondimensional, of the coefficients given."""
    return (
        c["v"] * v + c["r"] * r + c["vvv"] * v**3 + c["vvr"] * v**2 * r + c["vu"] * v * u
        + c["ru"] * r * u + c["d"] * d + c["ddd"] * d**3 + c["ud"] * u * d + c["uud"] * u**2 * d
        + c["vdd"] * v * d**2 + c["vvd"] * v**2 * d + c["0"] + c["0u"] * u + c["0uu"] * u**2
    )  # fmt: skip


def rates(motion: tuple[float, ...], rudder: float, _rpm: float) -> tuple[float, ...]:
    """Return the rates of speed ahead, sway (m/s²) and yaw rate (rad/s²); rudder in rad."""
    speed = hypot(motion[0], motion[1])
    u, v, r = (motion[0] - SPEED) / speed, motion[1] / speed, motion[2] * LENGTH / speed
    d = -rudder
    surge = (
        X["u"] * u + X["uu"] * u**2 + X["uuu"] * u**3 + X["vv"] * v**2 + X["rr"] * r**2
        + X["rv"] * r * v + X["dd"] * d**2 + X["udd"] * u * d**2 + X["vd"] * v * d
        + X["uvd"] * u * v * d
    )  # fmt: skip
    force, moment = lateral(Y, u, v, r, d), lateral(N, u, v, r, d)
    m22, m23 = MASS - Y_VDOT, MASS * CENTRE - Y_RDOT
    m32, m33 = MASS * CENTRE - N_VDOT, INERTIA - N_RDOT
    determinant = m22 * m33 - m23 * m32
    return (
        surge * speed**2 / LENGTH / (MASS - X_UDOT),
        (m33 * force - m23 * moment) * speed**2 / LENGTH / determinant,
        (m22 * moment - m32 * force) * speed**2 / LENGTH**2 / determinant,
    )
