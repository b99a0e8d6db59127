"""The tanker of 190,000 tonnes deadweight of van Berlekom and Goddard, 304.8 m, in deep water.

W. B. van Berlekom and T. A. Goddard, "Maneuvering of large tankers", Transactions of the Society of
Naval Architects and Marine Engineers 80, 1972, pages 264 to 298, Appendix A; the coefficients as in
T. I. Fossen, "Guidance and control of ocean vehicles", 1994, with its author's correction of the
slipstream (c² = cun u n + cnn n²). The terms of shallow water are zero here. The ship is unstable
on a straight course. Positive rudder turns the bow to starboard here.
"""

from math import atan, sqrt

LENGTH = 304.8  # m
SPEED = 8.23  # m/s, 16 knots, the ship's design speed
RPM = 80.0
RUDDER_RATE_DEG = 2.33  # per second

MASSES = {"x": 1.050, "y": 2.020, "n": 0.1232}  # with the added ones, over the ship's mass
THRUST = {"uu": -0.00695, "un": -0.00063, "nn": 0.0000354}
DEDUCTION = 0.22
SLIPSTREAM = {"un": 0.605, "nn": 38.2}
X = {"uu": -0.0377, "vr": 2.020, "vv": 0.3, "ccdd": -0.093, "ccbd": 0.152}
Y = {"uv": -1.205, "vv": -2.400, "ur": -0.752, "ccd": 0.208, "ccbbd": -2.16, "t": 0.04}
N = {"uv": -0.451, "vr": -0.300, "ur": -0.231, "ccd": -0.098, "ccbbd": 0.688, "t": -0.02}


def rates(motion: tuple[float, ...], rudder: float, rpm: float) -> tuple[float, ...]:
    """Return the rates of speed ahead, sway (m/s²) and yaw rate (rad/s²).

    Parameters
    ----------
    motion
        Speed ahead, which is positive, sway, m/s, and yaw rate, rad/s.
    rudder
        Rudder angle, rad.
    rpm
        Revolutions per minute of the shaft.
    """
    u, v, r = motion
    d, n = -rudder, rpm / 60
    drift = atan(v / u)
    thrust = (
        THRUST["uu"] * u**2 / LENGTH + THRUST["un"] * u * n + LENGTH * THRUST["nn"] * n * abs(n)
    )
    c = sqrt(max(0.0, SLIPSTREAM["un"] * u * n + SLIPSTREAM["nn"] * n**2))
    cross = c**2 * abs(drift) * drift * abs(d)
    surge = (
        X["uu"] * u**2 + LENGTH * X["vr"] * v * r + X["vv"] * v**2
        + X["ccdd"] * c**2 * d**2 + X["ccbd"] * c**2 * drift * d
        + LENGTH * thrust * (1 - DEDUCTION)
    )  # fmt: skip
    sway = (
        Y["uv"] * u * v + Y["vv"] * abs(v) * v + Y["ccd"] * c**2 * d + LENGTH * Y["ur"] * u * r
        + Y["ccbbd"] * cross + Y["t"] * thrust * LENGTH
    )  # fmt: skip
    yaw = (
        N["uv"] * u * v + LENGTH * N["vr"] * abs(v) * r + N["ccd"] * c**2 * d
        + LENGTH * N["ur"] * u * r + N["ccbbd"] * cross + N["t"] * thrust * LENGTH
    )  # fmt: skip
    return (
        surge / LENGTH / MASSES["x"],
        sway / LENGTH / MASSES["y"],
        yaw / LENGTH**2 / MASSES["n"],
    )
