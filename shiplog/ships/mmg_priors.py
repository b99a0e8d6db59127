"""Priors of the MMG model from the form of hull, rudder and propeller.

With k = 2 T/L and c = CB B/L, and everything in the dimensions of `shiplog.ships.mmg`:

    m    = 2 c                                        displacement
    mx   = 0.05 m
    my   = m (0.882 - 0.54 CB (1 - 1.6 T/B) - 0.156 (1 - 0.673 CB) L/B
              + 0.826 (T/B) (L/B) (1 - 0.678 T/B) - 0.638 CB (T/B) (L/B) (1 - 0.669 T/B))
    jz   = m (0.33 - 0.7685 CB (1 - 0.784 CB) + 0.0343 (L/B) (1 - 0.63 CB))^2
    iz   = m 0.25^2 + jz
    yv   = -(pi k / 2 + 1.4 c)                        yr   = mx + 0.5 c
    nv   = -k                                         nr   = -0.54 k + k^2
    yvvv = -(0.185 L/B + 0.48)
    yvrr = -(0.26 (1 - CB) L/B + 0.11), averaged with -5.95 (T/B) (1 - CB)
    xvv  = 1.15 c - 0.18     xvvvv = -6.68 c + 1.1    xrr  = -0.085 c + 0.008
    f0   = A/(L T) 6.13 Λ/(Λ + 2.25) (u_R/U)^2        Λ the aspect ratio
    ct   = r0 L T / ((1 - t) (1 - w)^2 pi D^2/4)      w = 0.5 CB - 0.05, t = 0.6 w
    d    = D / rudder height, at most 1

with u_R/U of the race by the model's own d, k and ct behind a wake of e (1 - w) = 0.68, which
e = 2.26 - 1.82 (1 - w) of Yoshimura and Masumoto gives to 0.04 for CB of 0.5 to 0.85; t = 0.6 w is
assumed. Copies of their yvvv in print have 0.48 - 0.185 L/B; the force in drift by Kijima's
regression is that of the sum above.

Widths. Of yv, yr, nv and nr, the root-mean-square difference of four other regressions (Wagner
Smitt, Norrbin, Inoue, Clarke) from these, over L/B of 5 to 8, B/T of 2.3 to 3.8 and CB of 0.55 to
0.85: 12, 33, 4 and 20 %; not less than 15 %, which is assumed, as the regressions share ships and
scatter less than single ships do. Of my and jz, the difference from Clarke's: 15 and 13 %. The
radius of gyration 0.25 L is assumed to 6 %. yvvv: the difference from Kijima's quadratic force at
a drift of 0.35; yvrr: that between the two regressions. f0: 25 %, as Kijima's e (1 - w) is 12 %
lower. Where there is one regression only, the width is that of ships in general.

The derivatives yvvr, yrrr, nvvv, nvvr, nvrr, nrrr and xvr, the increase ah and the flow
straightening gamma keep the priors of ships in general: for these the sources differ by more than
that width, or in sign. So does everything where L/B, B/T or CB is outside the range of `RANGES`,
but mass and propeller.

References
----------
Y. Yoshimura and Y. Masumoto, "Hydrodynamic database and manoeuvring prediction method with medium
high-speed merchant ships and fishing vessels", MARSIM 2012, its regressions of the derivatives by
drift angle: those of odd power change their sign here. K. Kijima et al., "On the manoeuvring
performance of a ship with the parameter of loading condition", Journal of the Society of Naval
Architects of Japan 168, 1990: the linear derivatives, and yvrr. Zhou Z. et al., "Manoeuvring
prediction of multi-purpose cargo ships", 1983: my and jz, regressions of the charts of S. Motora,
1959. D. Clarke, P. Gedling and G. Hine, "The application of manoeuvring criteria in hull design
using linear theory", Transactions of RINA 125, 1983, with the regressions of Wagner Smitt, Norrbin
and Inoue. H. Fujii and T. Tuda, "Experimental researches on rudder performance", Journal of the
Society of Naval Architects of Japan 110, 1961: the slope of the normal force. D. W. Taylor, "The
speed and power of ships", 1933: the wake. O. F. Sukas, O. K. Kinaci and S. Bal, "Theoretical
background and application of MANSIM for ship maneuvering simulations", Ocean Engineering 192, 2019,
which reviews most of these formulas.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import hypot, pi, sqrt
from typing import NamedTuple

from .hull_form import HullForm
from .model import Model, Parameter

# of the forms to which the regressions were fitted: L/B, B/T and CB of merchant ships
RANGES = {"L/B": (4.0, 9.0), "B/T": (2.0, 5.0), "CB": (0.5, 0.87)}
GYRATION = 0.25  # radius in yaw over the length
GYRATION_SCATTER = 0.06  # relative
LINEAR_SCATTER = {"yv": 0.15, "yr": 0.33, "nv": 0.15, "nr": 0.20}  # relative
SWAY_MASS_SCATTER, YAW_MASS_SCATTER = 0.15, 0.13  # relative
CUBIC_STD = {"yvvv": 0.6, "yvrr": 0.15}
BEHIND_WAKE = 0.68  # e (1 - w): 0.64 to 0.70 for CB of 0.5 to 0.85
RUDDER_SCATTER = 0.25  # relative
LOADING_SCATTER = 0.4  # relative: the resistance to 33 %, the wake to 10 %


class Prior(NamedTuple):
    """The mean and the standard deviation of a parameter before the data; NaN to keep the width."""

    mean: float
    std: float = float("nan")


def mmg_with_hull(model: Model, form: HullForm) -> Model:
    """Return the MMG model with the priors of a hull form.

    Parameters
    ----------
    model
        `shiplog.ships.mmg.MMG`.
    form
        The dimensions; a parameter changes only where all that it depends on is known.

    Returns
    -------
    Model
        The same equations and limits, with other means and widths.
    """
    priors = _hull_priors(form)
    priors |= _propeller_priors(form, model.parameter("r0").start)
    at = {name: model.parameter(name).start for name in ("d", "k", "ct")}
    race = at | {name: prior.mean for name, prior in priors.items() if name in at}
    priors |= _rudder_priors(form, race)
    return replace(model, parameters=tuple(_with_prior(p, priors) for p in model.parameters))


def beyond_regressions(form: HullForm) -> str:
    """Describe how a form is outside the range of the regressions; an empty text where it is not.

    Examples
    --------
    >>> beyond_regressions(HullForm(breadth=0.4, draught=0.1, block_coefficient=0.7))
    'L/B = 2.5, regressions hold from 4 to 9'
    """
    b, t, fullness = form.breadth, form.draught, form.block_coefficient
    values = {"L/B": 1 / b if b else None, "B/T": b / t if b and t else None, "CB": fullness}
    for name, value in values.items():
        lowest, highest = RANGES[name]
        if value is not None and not lowest <= value <= highest:
            return f"{name} = {value:.3g}, regressions hold from {lowest:g} to {highest:g}"
    return ""


def _with_prior(parameter: Parameter, priors: Mapping[str, Prior]) -> Parameter:
    if parameter.name not in priors:
        return parameter
    mean, std = priors[parameter.name]
    mean = min(max(mean, parameter.lowest), parameter.highest)
    return replace(parameter, start=mean, prior_std=std if std > 0 else parameter.prior_std)


def _hull_priors(form: HullForm) -> dict[str, Prior]:
    """Return the priors of masses and hull derivatives; none where a dimension is missing."""
    b, t, fullness = form.breadth, form.draught, form.block_coefficient
    if b is None or fullness is None:
        return {}
    c = fullness * b
    mass = {"m": Prior(2 * c)}
    if t is None or beyond_regressions(form):
        return mass
    k, slender = 2 * t, 1 / b
    linear = {
        "yv": -(pi / 2 * k + 1.4 * c),
        "yr": 0.05 * 2 * c + 0.5 * c,
        "nv": -k,
        "nr": -0.54 * k + k * k,
    }
    cubic = {
        "yvvv": -(0.185 * slender + 0.48),
        "yvrr": -(0.26 * (1 - fullness) * slender + 0.11 + 5.95 * t / b * (1 - fullness)) / 2,
    }
    surge = {"xvv": 1.15 * c - 0.18, "xvvvv": -6.68 * c + 1.1, "xrr": -0.085 * c + 0.008}
    return (
        mass
        | _added_masses(b, t, fullness)
        | {name: Prior(y, LINEAR_SCATTER[name] * abs(y)) for name, y in linear.items()}
        | {name: Prior(y, CUBIC_STD[name]) for name, y in cubic.items()}
        | {name: Prior(y) for name, y in surge.items()}
    )


def _added_masses(b: float, t: float, fullness: float) -> dict[str, Prior]:
    """Return the priors of the added masses and of the moment of inertia."""
    m, flat, slender = 2 * fullness * b, t / b, 1 / b
    sway = m * (
        0.882
        - 0.54 * fullness * (1 - 1.6 * flat)
        - 0.156 * (1 - 0.673 * fullness) * slender
        + 0.826 * flat * slender * (1 - 0.678 * flat)
        - 0.638 * fullness * flat * slender * (1 - 0.669 * flat)
    )
    radius = 0.33 - 0.7685 * fullness * (1 - 0.784 * fullness)
    radius += 0.0343 * slender * (1 - 0.63 * fullness)
    added, own = m * radius**2, m * GYRATION**2
    return {
        "mx": Prior(0.05 * m),
        "my": Prior(sway, SWAY_MASS_SCATTER * sway),
        "iz": Prior(added + own, hypot(YAW_MASS_SCATTER * added, 2 * GYRATION_SCATTER * own)),
    }


def _propeller_priors(form: HullForm, resistance: float) -> dict[str, Prior]:
    """Return the priors of the thrust loading and of the share of the rudder in the race."""
    diameter, priors = form.propeller_diameter, {}
    if diameter is None:
        return {}
    if form.draught is not None and form.block_coefficient is not None:
        wake = 0.5 * form.block_coefficient - 0.05
        thrust = resistance * form.draught / (1 - 0.6 * wake)
        loading = thrust / ((1 - wake) ** 2 * pi * diameter**2 / 4)
        priors["ct"] = Prior(loading, LOADING_SCATTER * loading)
    if form.rudder_height is not None:
        priors["d"] = Prior(min(diameter / form.rudder_height, 1.0))
    return priors


def _rudder_priors(form: HullForm, race: Mapping[str, float]) -> dict[str, Prior]:
    """Return the prior of the rudder's normal force."""
    if form.rudder_area is None or form.rudder_aspect_ratio is None:
        return {}
    slope = 6.13 * form.rudder_aspect_ratio / (form.rudder_aspect_ratio + 2.25)
    jet = (1 + race["k"] * (sqrt(1 + race["ct"]) - 1)) ** 2
    square = BEHIND_WAKE**2 * (race["d"] * jet + 1 - race["d"])
    force = form.rudder_area * slope * square
    return {"f0": Prior(force, RUDDER_SCATTER * force)}
