"""Surge, sway and yaw with cross-flow drag, with wide priors on all parameters.

    sigma' = yv nu sigma + yr nu rho - cy Y(sigma, rho) + yd F
    rho'   = nv nu sigma + nr nu rho - cn N(sigma, rho) + nd F
    nu'    = h (eta (eta + p (eta - nu)) - (1 + g) nu^2) + xd F delta
             + xvr sigma rho + x4 sigma^4 / (nu^2 + sigma^2)
    Y, N   = int |sigma + x rho| (sigma + x rho) (1, x) dx over the length, x from -1/2 to 1/2
    F      = s delta + w sqrt(s) (sigma - 0.8 rho),  s = (1 - m) nu^2 + m eta^2

nu is the speed ahead over U0, sigma the sway over U0, rho the yaw rate times L/U0, eta the
revolutions over those of the approach, time is in L/U0; the forces are divided by the inertias. On
the straight run thrust and resistance balance, except for g; the propeller of a slower ship gives
more thrust, by p. The rudder works in a stream s of which the fraction m is the propeller's. The
sideways motion of the stern turns that stream by w, which reduces the rudder's angle of attack in a
turn and adds damping to that of the hull.

The priors are wide and hold for ships in general: slender-body regressions for the linear hull
terms [1]_, a drag coefficient near 0.6 for the cross-flow [2]_, the driving force at large drift
[3]_, and the usual magnitudes of thrust, flow straightening and rudder drag in the MMG model [4]_.
Zig-zags determine surge least, so that the priors of its terms come from their physical meaning:
xvr from the inertia of a ship that moves sideways, the ratio of its mass, without or with the added
mass of sway, to its mass with the added mass of surge, 0.95 to 1.75; xd from the size of the
rudder, on which its drag and its side force both depend; g from how steady the approach of a trial
is.

References
----------
.. [1] D. Clarke, P. Gedling and G. Hine, "The application of manoeuvring criteria in hull design
   using linear theory", 1983.
.. [2] J. P. Hooft, "The cross-flow drag on a manoeuvring ship", 1994.
.. [3] Y. Yoshimura and Y. Masumoto, "Hydrodynamic database and manoeuvring prediction method with
   medium high-speed merchant ships and fishing vessels", 2012.
.. [4] H. Yasukawa and Y. Yoshimura, "Introduction of MMG standard method for ship maneuvering
   predictions", 2015.
"""

from typing import NamedTuple

from shiplog.compiled import compiled, compiled_in_caller

from .model import Model, Parameter, StateValue
from .motion import (
    ComplexArray,
    Forcing,
    InputPath,
    equations,
    integrate,
    magnitude,
    observations,
    root,
)

RUDDER_ARM = 0.8  # ship lengths: effective lever of the yaw rate at the rudder, beyond its position


class ThreeDof(NamedTuple):
    """The coefficients of the equations, dimensionless.

    Attributes
    ----------
    yv, yr, cy, yd
        The side force by sway, by the yaw rate, by cross-flow drag and by the rudder.
    nv, nr, cn, nd
        The yaw moment by the same.
    m
        The propeller's fraction of the stream in which the rudder works.
    w
        Flow straightening: the inflow angle at the rudder by the sideways motion of the stern.
    xvr, x4
        The surge force by sway and turning, and by large drift.
    g
        The imbalance of resistance and thrust on the straight run.
    h
        The thrust at the speed and revolutions of the approach.
    p
        How the thrust grows where the ship is slower than its propeller.
    xd
        The drag of the rudder.
    """

    yv: complex
    yr: complex
    cy: complex
    yd: complex
    nv: complex
    nr: complex
    cn: complex
    nd: complex
    m: complex
    w: complex
    xvr: complex
    x4: complex
    g: complex
    h: complex
    p: complex
    xd: complex


@compiled_in_caller
def _cross_flow(sigma: complex, rho: complex) -> tuple[complex, complex]:
    """Compute Y and N by Gauss-Legendre quadrature with five points."""
    middle, inner, outer = 128 / 450, 0.4786286704993665 / 2, 0.2369268850561891 / 2
    near, far = 0.5384693101056831 / 2, 0.9061798459386640 / 2
    y = middle * sigma * magnitude(sigma)
    n = 0 * sigma
    for weight, x in ((inner, near), (inner, -near), (outer, far), (outer, -far)):
        flow = sigma + x * rho
        force = weight * flow * magnitude(flow)
        y += force
        n += x * force
    return y, n


@equations(ThreeDof)
def _motion(c: ThreeDof, x: ComplexArray, u: Forcing) -> tuple[complex, ...]:
    rho, sigma, nu = x[0], x[1], x[2]
    y, n = _cross_flow(sigma, rho)
    stream = (1 - c.m) * nu * nu + c.m * u.n * u.n
    force = stream * u.delta + c.w * root(stream) * (sigma - RUDDER_ARM * rho)
    drift = sigma * sigma
    thrust = c.h * u.n * (u.n + c.p * (u.n - nu))
    return (
        c.nv * nu * sigma + c.nr * nu * rho - c.cn * n + c.nd * force,
        c.yv * nu * sigma + c.yr * nu * rho - c.cy * y + c.yd * force,
        c.xvr * sigma * rho
        + c.x4 * drift * drift / (nu * nu + drift)
        + thrust
        - c.h * (1 + c.g) * nu * nu
        + c.xd * force * u.delta,
        rho,
    )


@observations(ThreeDof)
def _observed(c: ThreeDof, x: ComplexArray) -> tuple[complex, complex, complex, complex]:  # noqa: ARG001
    return x[0], x[2], x[1], x[3]


@compiled
def _integrate(
    c: ThreeDof, x: ComplexArray, offset: ComplexArray, path: InputPath, count: int
) -> ComplexArray:
    return integrate(c, x, offset, path, count)


THREE_DOF = Model(
    "three-dof", "surge, sway and yaw with cross-flow", ThreeDof,
    (
        Parameter("yv", "1", -0.75, -5.0, 0.0, prior_std=0.4),
        Parameter("yr", "1", -0.45, -2.0, 1.0, prior_std=0.2),
        Parameter("cy", "1", 1.0, 0.0, 10.0, prior_std=0.7),
        Parameter("yd", "1", -0.15, -2.0, 0.0, prior_std=0.1),
        Parameter("nv", "1", -4.0, -20.0, 5.0, prior_std=2.5),
        Parameter("nr", "1", -1.8, -10.0, 0.0, prior_std=0.8),
        Parameter("cn", "1", 15.0, 0.0, 500.0, prior_std=15.0),
        Parameter("nd", "1", 1.0, 0.0, 10.0, prior_std=0.5),
        Parameter("m", "1", 0.4, -3.0, 1.5, prior_std=0.3),
        Parameter("w", "1", 0.4, 0.0, 1.0, prior_std=0.15),
        Parameter("xvr", "1", 1.35, 0.0, 5.0, prior_std=0.35),
        Parameter("x4", "1", 1.5, prior_std=1.0),
        Parameter("g", "1", 0.0, -0.5, 0.5, prior_std=0.02),
        Parameter("h", "1", 0.05, 0.0, 1.0, prior_std=0.03),
        Parameter("p", "1", 0.7, 0.0, 2.0, prior_std=0.2),
        Parameter("xd", "1", -0.1, -1.0, 0.0, prior_std=0.03),
    ),
    (
        StateValue("rho", "yaw_rate"),
        StateValue("sigma", "sway", prior_std=0.1),
        StateValue("nu", "speed"),
        StateValue("psi", "heading"),
    ),
    _integrate, ("yaw_rate", "speed", "sway", "heading"),
)  # fmt: skip
