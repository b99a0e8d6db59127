"""The container ship of Son and Nomoto, 175 m, with roll and the dynamics of its shaft.

K. Son and K. Nomoto, "On the coupled motion of steering and rolling of a high-speed container
ship", Naval Architecture and Ocean Engineering 20, 1982, pages 73 to 83; the coefficients as in
T. I. Fossen, "Guidance and control of ocean vehicles", 1994, with the corrections of its author
(added mass in sway 0.007049; inflow of the propeller in proportion to the speed ahead). The axes
are horizontal: the rate of heading is the yaw rate, whatever the roll. Positive rudder turns the
bow to starboard.
"""

from math import atan, cos, hypot, pi, sin, sqrt

import numpy as np

LENGTH = 175.0  # m
SPEED, RPM = 7.33, 70.0  # m/s, steady at these revolutions
RUDDER_RATE_DEG = 5.0  # per second
DENSITY, GRAVITY = 1025.0, 9.81

MASS, ADDED_AHEAD, ADDED_ACROSS = 0.00792, 0.000238, 0.007049
ROLL_INERTIA, YAW_INERTIA = 0.0000176 + 0.0000034, 0.000456 + 0.000419
ADDED_LEVER, ROLL_LEVER, AHEAD_LEVER = 0.05, 0.0313, 0.0313  # αy, ly, lx
VOLUME, METACENTRIC_HEIGHT = 21_222.0, 0.3  # m³, m
X = {"uu": -0.0004226, "vr": -0.00311, "rr": 0.00020, "ff": -0.00020, "vv": -0.00386}
Y = {
    "v": -0.0116, "r": 0.00242, "p": 0.0, "f": -0.000063, "vvv": -0.109, "rrr": 0.00177,
    "vvr": 0.0214, "vrr": -0.0405, "vvf": 0.04605, "vff": 0.00304, "rrf": 0.009325,
    "rff": -0.001368,
}  # fmt: skip
K = {
    "v": 0.0003026, "r": -0.000063, "p": -0.0000075, "f": -0.000021, "vvv": 0.002843,
    "rrr": -0.0000462, "vvr": -0.000588, "vrr": 0.0010565, "vvf": -0.0012012, "vff": -0.0000793,
    "rrf": -0.000243, "rff": 0.00003569,
}  # fmt: skip
N = {
    "v": -0.0038545, "r": -0.00222, "p": 0.000213, "f": -0.0001424, "vvv": 0.001492,
    "rrr": -0.00229, "vvr": -0.0424, "vrr": 0.00156, "vvf": -0.019058, "vff": -0.0053766,
    "rrf": -0.0038592, "rff": 0.0024195,
}  # fmt: skip
PROPELLER, WAKE, WAKE_CHANGE, PROPELLER_POINT, DEDUCTION = 6.533, 0.184, 1.09, -0.526, 0.175
RUDDER_AREA, ASPECT, JET, INFLOW = 33.0376, 1.8219, 0.631, 0.921
RUDDER_DRAG, INCREASE, RUDDER_HEIGHT, RUDDER_POINT, FORCE_POINT = 0.71, 0.237, 0.033, -0.5, -0.48
ACROSS = {"v": 0.088, "r": -0.156, "rrr": -0.275, "rrv": 1.96}  # flow across at the rudder
MASS_MATRIX = np.array(
    [
        [MASS + ADDED_ACROSS, ADDED_ACROSS * ADDED_LEVER, -ADDED_ACROSS * ROLL_LEVER],
        [ADDED_ACROSS * ADDED_LEVER, YAW_INERTIA, 0.0],
        [-ADDED_ACROSS * ROLL_LEVER, 0.0, ROLL_INERTIA],
    ]
)  # of sway, yaw and roll, nondimensional
TO_ACCELERATIONS = np.linalg.inv(MASS_MATRIX).tolist()


def hull(c: dict[str, float], v: float, r: float, p: float, roll: float) -> float:
    """Return the lateral force, the yaw moment or the roll moment of the hull, nondimensional."""
    return (
        c["v"] * v + c["r"] * r + c["p"] * p + c["f"] * roll + c["vvv"] * v**3 + c["rrr"] * r**3
        + c["vvr"] * v**2 * r + c["vrr"] * v * r**2 + c["vvf"] * v**2 * roll
        + c["vff"] * v * roll**2 + c["rrf"] * r**2 * roll + c["rff"] * r * roll**2
    )  # fmt: skip


def thrust_and_rudder(
    u: float, v: float, r: float, turns: float, rudder: float
) -> tuple[float, float]:
    """Return the thrust and the normal force of the rudder, nondimensional.

    Parameters
    ----------
    u, v, r
        Speed ahead, sway and yaw rate, nondimensional.
    turns
        Revolutions of the propeller times length over speed, nondimensional.
    rudder
        Rudder angle, rad.
    """
    inflow = u * ((1 - WAKE) + WAKE_CHANGE * (v + PROPELLER_POINT * r) ** 2)
    diameter = PROPELLER / LENGTH
    advance = inflow / (turns * diameter)
    coefficient = 0.527 - 0.455 * advance
    thrust = 2 * diameter**4 * coefficient * turns * abs(turns)
    along = inflow * INFLOW * sqrt(max(0.0, 1 + 8 * JET * coefficient / (pi * advance**2)))
    across = ACROSS["v"] * v + ACROSS["r"] * r + ACROSS["rrr"] * r**3 + ACROSS["rrv"] * r**2 * v
    slope = 6.13 * ASPECT / (ASPECT + 2.25) * RUDDER_AREA / LENGTH**2
    normal = -slope * (along**2 + across**2) * sin(rudder + atan(across / along))
    return thrust, normal


def rates(motion: tuple[float, ...], rudder: float, rpm: float) -> tuple[float, ...]:
    """Return the rates of the motion, SI.

    Parameters
    ----------
    motion
        Speed ahead and sway, m/s; yaw rate and roll rate, rad/s; roll, rad; revolutions per minute
        of the shaft.
    rudder
        Rudder angle, rad.
    rpm
        Revolutions per minute ordered.
    """
    speed = hypot(motion[0], motion[1])
    u, v = motion[0] / speed, motion[1] / speed
    r, p, roll = motion[2] * LENGTH / speed, motion[3] * LENGTH / speed, motion[4]
    turns = motion[5] / 60
    thrust, normal = thrust_and_rudder(u, v, r, turns * LENGTH / speed, rudder)
    weight = 2 * GRAVITY * VOLUME / (LENGTH * speed) ** 2
    surge = (
        X["uu"] * u**2 + X["vr"] * v * r + X["vv"] * v**2 + X["rr"] * r**2 + X["ff"] * roll**2
        + (1 - DEDUCTION) * thrust + RUDDER_DRAG * normal * sin(rudder)
        + (MASS + ADDED_ACROSS) * v * r
    ) / (MASS + ADDED_AHEAD)  # fmt: skip
    lift = normal * cos(rudder)
    forces = (
        hull(Y, v, r, p, roll) + (1 + INCREASE) * lift - (MASS + ADDED_AHEAD) * u * r,
        hull(N, v, r, p, roll) + (RUDDER_POINT + INCREASE * FORCE_POINT) * lift,
        hull(K, v, r, p, roll) - (1 + INCREASE) * RUDDER_HEIGHT * lift
        + ADDED_AHEAD * AHEAD_LEVER * u * r - weight * METACENTRIC_HEIGHT / LENGTH * roll,
    )  # fmt: skip
    sway, yaw, rolling = (
        sum(factor * force for factor, force in zip(row, forces, strict=True))
        for row in TO_ACCELERATIONS
    )
    lag = 5.65 / turns if turns > 0.3 else 18.83
    return (
        surge * speed**2 / LENGTH,
        sway * speed**2 / LENGTH,
        yaw * speed**2 / LENGTH**2,
        rolling * speed**2 / LENGTH**2,
        motion[3],
        (rpm - motion[5]) / lag,
    )
