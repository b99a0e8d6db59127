"""Surge, sway and yaw by the MMG standard method: hull, propeller and rudder, with priors.

    (m + mx) nu'    = (m + my + xvr) sigma rho + (xrr + xg m) rho^2 + xvv sigma^2
                      + xvvvv sigma^4 / U^2 - r0 (1 + g) nu |nu| + r0 T - (1 - tr) F sin delta
    (m + my) sigma' + xg m rho' = -(m + mx) nu rho + U (yv sigma + yr rho) + Y3 / U
                      - (1 + ah) F cos delta - 2 nw T
    iz rho' + xg m sigma' = -xg m nu rho + U (nv sigma + nr rho) + N3 / U
                      + (1/2 - ah xh) F cos delta + nw T
    Y3 = yvvv sigma^3 + yvvr sigma^2 rho + yvrr sigma rho^2 + yrrr rho^3,   N3 alike

nu is the speed ahead over U0, sigma the sway over U0, rho the yaw rate times L/U0, eta the
revolutions over those of the approach, U^2 = nu^2 + sigma^2; time is in L/U0, and forces are
divided by rho_w L d U0^2 / 2 with the draught d.

The propeller works in the stream u_P = nu (1 + cw± (1 - exp(-2 |b|))) with b = rho/2 - sigma over
U: the wake lessens in drift, by cw + dcw to one side and cw - dcw to the other. Its thrust is
T = |eta| (eta + p (eta - u_P)), with p the slope of the open-water curve about the approach. The
rudder stands in a stream of the speed

    u_R^2 = (d (u_P + k (root - u_P))^2 + (1 - d) u_P^2) / c + ms (u_P^2 - eta^2),
    root^2 = u_P^2 + ct T,

where c makes u_R = 1 in the approach and ct is the thrust loading 8 K_T / (pi J^2) there; ms
corrects how far the propeller determines that stream. With the flow straightening gamma± = gamma
+- dgamma by the side of the inflow, v_R = -gamma± (sigma + lr rho), and the normal force is

    F = f0 sqrt(u_R^2 + v_R^2) (u_R sin delta - v_R cos delta).

nw is a wheeling moment of the propeller, xg the centre of gravity ahead of midship, xh the point of
the force that the rudder induces on the hull. Means and widths of the priors hold for merchant
ships in general: the scatter of published derivatives about their regressions.

References
----------
H. Yasukawa and Y. Yoshimura, "Introduction of MMG standard method for ship maneuvering
predictions", Journal of Marine Science and Technology 20, 2015, equations (4) to (34). Y. Yoshimura
and Y. Masumoto, "Hydrodynamic database and manoeuvring prediction method with medium high-speed
merchant ships and fishing vessels", MARSIM 2012. K. Kijima et al., "On the manoeuvring performance
of a ship with the parameter of loading condition", Journal of the Society of Naval Architects of
Japan 168, 1990.
"""

from typing import NamedTuple

from shiplog.compiled import compiled

from .model import Model, Parameter, StateValue
from .motion import (
    ComplexArray,
    Forcing,
    InputPath,
    equations,
    exponential,
    integrate,
    magnitude,
    observations,
    root,
)

WAKE_CHANGE = 2.0  # C1: how fast the wake lessens with the angle of drift at the propeller
STERN = 0.5  # ship lengths from midship to rudder and propeller
LEAST = 1e-3  # of squared speeds: a stopped ship has no direction of inflow


class Mmg(NamedTuple):
    """The coefficients of the equations, dimensionless.

    Attributes
    ----------
    m, mx, my, iz
        Mass, added masses of surge and sway, and the whole moment of inertia in yaw.
    yv, yr, yvvv, yvvr, yvrr, yrrr
        The hull's side force by sway and yaw rate.
    nv, nr, nvvv, nvvr, nvrr, nrrr
        The hull's yaw moment by the same.
    xvv, xvr, xrr, xvvvv
        The hull's surge force by the same.
    r0, g
        The resistance in the approach, and its share that the thrust does not balance there.
    p, cw, dcw
        The slope of the thrust, and how the wake lessens in drift: mean, and difference by side.
    ct, k, d, ms
        The propeller's race at the rudder.
    f0, gamma, dgamma, lr
        The rudder's normal force and its inflow.
    ah, xh, tr
        Rudder and hull: the increase of the side force, where it acts, the deduction of the drag.
    nw
        The wheeling moment of the propeller.
    xg
        The centre of gravity ahead of midship, in ship lengths.
    """

    m: complex
    mx: complex
    my: complex
    iz: complex
    yv: complex
    yr: complex
    yvvv: complex
    yvvr: complex
    yvrr: complex
    yrrr: complex
    nv: complex
    nr: complex
    nvvv: complex
    nvvr: complex
    nvrr: complex
    nrrr: complex
    xvv: complex
    xvr: complex
    xrr: complex
    xvvvv: complex
    r0: complex
    g: complex
    p: complex
    cw: complex
    ct: complex
    k: complex
    d: complex
    f0: complex
    ah: complex
    xh: complex
    tr: complex
    gamma: complex
    dgamma: complex
    lr: complex
    nw: complex
    xg: complex
    dcw: complex
    ms: complex


@equations(Mmg)
def _motion(c: Mmg, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, sigma, nu = x[0], x[1], x[2]
    square = nu * nu + sigma * sigma + LEAST * LEAST
    speed = root(square)
    rr, vv, vr = rho * rho, sigma * sigma, sigma * rho
    y = (
        speed * (c.yv * sigma + c.yr * rho)
        + (sigma * (c.yvvv * vv + c.yvvr * vr + c.yvrr * rr) + c.yrrr * rho * rr) / speed
    )
    n = (
        speed * (c.nv * sigma + c.nr * rho)
        + (sigma * (c.nvvv * vv + c.nvvr * vr + c.nvrr * rr) + c.nrrr * rho * rr) / speed
    )
    drift = (STERN * rho - sigma) / speed
    lessened = c.cw + (c.dcw if drift.real > 0 else -c.dcw)
    inflow = nu * (1 + lessened * (1 - exponential(-WAKE_CHANGE * magnitude(drift))))
    size = abs(u.n)
    thrust = size * (u.n + c.p * (u.n - inflow))
    raced = inflow * inflow + c.ct * thrust
    if raced.real < LEAST:
        raced = LEAST + 0 * raced
    race = inflow + c.k * (root(raced) - inflow)
    first = 1 + c.k * (root(1 + c.ct) - 1)
    stream = (c.d * race * race + (1 - c.d) * inflow * inflow) / (c.d * first * first + 1 - c.d)
    stream += c.ms * (inflow * inflow - u.n * u.n)
    if stream.real < LEAST:
        stream = LEAST + 0 * stream
    ahead = root(stream)
    side = sigma + c.lr * rho
    straightening = c.gamma + (c.dgamma if side.real > 0 else -c.dgamma)
    across = -straightening * side
    delta = u.delta
    dd = delta * delta
    sine = delta * (1 - dd * (1 - dd / 20) / 6)
    cosine = 1 - dd * (1 - dd * (1 - dd / 30) / 12) / 2
    force = c.f0 * root(stream + across * across) * (ahead * sine - across * cosine)
    wheel = c.nw * thrust
    surge = (
        (c.m + c.my + c.xvr) * vr
        + c.xvv * vv
        + (c.xrr + c.xg * c.m) * rr
        + c.xvvvv * vv * vv / square
        - c.r0 * (1 + c.g) * nu * magnitude(nu)
        + c.r0 * thrust
        - (1 - c.tr) * force * sine
    )
    sway = -(c.m + c.mx) * nu * rho + y - (1 + c.ah) * force * cosine - wheel / STERN
    yaw = n + (STERN - c.ah * c.xh) * force * cosine + wheel - c.xg * c.m * nu * rho
    arm, mass = c.xg * c.m, c.m + c.my
    shared = mass * c.iz - arm * arm
    return (
        (mass * yaw - arm * sway) / shared,
        (c.iz * sway - arm * yaw) / shared,
        surge / (c.m + c.mx),
        rho,
    )


@observations(Mmg)
def _observed(c: Mmg, x: ComplexArray) -> tuple[complex, complex, complex, complex]:  # noqa: ARG001
    return x[0], x[2], x[1], x[3]


@compiled
def _integrate(
    c: Mmg, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


MMG = Model(
    "mmg", "surge, sway and yaw by the MMG standard method", Mmg,
    (
        Parameter("m", "1", 0.26, 0.05, 1.0, fixed=True),
        Parameter("mx", "1", 0.015, 0.0, 0.2, fixed=True),
        Parameter("my", "1", 0.20, 0.005, 1.0, prior_std=0.04),
        Parameter("iz", "1", 0.027, 0.002, 0.2, prior_std=0.005),
        Parameter("yv", "1", -0.30, -3.0, 1.0, prior_std=0.06),
        Parameter("yr", "1", 0.06, -1.0, 1.0, prior_std=0.04),
        Parameter("yvvv", "1", -1.3, -20.0, 10.0, prior_std=0.7),
        Parameter("yvvr", "1", 0.0, -10.0, 10.0, prior_std=0.6, typical=0.5),
        Parameter("yvrr", "1", -0.4, -10.0, 10.0, prior_std=0.3),
        Parameter("yrrr", "1", 0.0, -2.0, 2.0, prior_std=0.03, typical=0.02),
        Parameter("nv", "1", -0.12, -1.0, 0.5, prior_std=0.03),
        Parameter("nr", "1", -0.050, -0.5, 0.2, prior_std=0.010),
        Parameter("nvvv", "1", -0.10, -5.0, 5.0, prior_std=0.15),
        Parameter("nvvr", "1", -0.35, -5.0, 5.0, prior_std=0.15),
        Parameter("nvrr", "1", 0.05, -5.0, 5.0, prior_std=0.06),
        Parameter("nrrr", "1", -0.02, -1.0, 1.0, prior_std=0.012),
        Parameter("xvv", "1", -0.03, -1.0, 1.0, prior_std=0.06),
        Parameter("xvr", "1", 0.0, -1.0, 1.0, prior_std=0.07, typical=0.1),
        Parameter("xrr", "1", 0.005, -0.5, 0.5, prior_std=0.015),
        Parameter("xvvvv", "1", 0.4, -5.0, 5.0, prior_std=0.4),
        Parameter("r0", "1", 0.018, 0.002, 0.2, prior_std=0.006),
        Parameter("g", "1", 0.0, -0.5, 0.5, prior_std=0.02),
        Parameter("p", "1", 0.9, -3.0, 8.0, prior_std=0.35),
        Parameter("cw", "1", 0.3, -3.0, 3.0, prior_std=0.25),
        Parameter("ct", "1", 2.5, 0.1, 20.0, prior_std=1.2, fixed=True),
        Parameter("k", "1", 0.55, 0.0, 1.5, prior_std=0.1, fixed=True),
        Parameter("d", "1", 0.75, 0.0, 1.0, prior_std=0.1, fixed=True),
        Parameter("f0", "1", 0.045, 0.002, 0.5, prior_std=0.012),
        Parameter("ah", "1", 0.3, -1.0, 2.0, prior_std=0.08),
        Parameter("xh", "1", -0.45, -1.0, 0.0, prior_std=0.05, fixed=True),
        Parameter("tr", "1", 0.3, -2.0, 2.0, prior_std=0.1),
        Parameter("gamma", "1", 0.45, -1.0, 3.0, prior_std=0.12),
        Parameter("dgamma", "1", 0.0, -1.0, 1.0, prior_std=0.08, typical=0.1),
        Parameter("lr", "1", -0.8, -3.0, 1.0, prior_std=0.1),
        Parameter("nw", "1", 0.0, -0.01, 0.01, prior_std=0.0002, typical=0.0005, fixed=True),
        Parameter("xg", "1", 0.0, -0.2, 0.2, prior_std=0.015, typical=0.02),
        Parameter("dcw", "1", 0.0, -3.0, 3.0, prior_std=0.1, typical=0.2),
        Parameter("ms", "1", 0.0, -5.0, 5.0, prior_std=0.4, typical=0.4),
    ),
    (
        StateValue("rho", "yaw_rate"),
        StateValue("sigma", "sway", prior_std=0.1),
        StateValue("nu", "speed"),
        StateValue("psi", "heading"),
    ),
    _integrate, ("yaw_rate", "speed", "sway", "heading"),
)  # fmt: skip
