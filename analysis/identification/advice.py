"""Manoeuvres that identify a parameter, and the ties of the paper's model."""

from dataclasses import dataclass

import numpy as np

from analysis.identification.fit.output_error import OutputError, output_error
from analysis.identification.fit.uncertainty import uncertainty
from shiplog.ships import ship_model

MAX_TIE_DEVIATION = 3.0  # standard deviations of (b1 + d)/d from zero: beyond, the tie fails
MAX_TIE_HALF_INTERVAL = 1.0  # of (b1 + d)/d at 95 %: beyond, the data do not decide
RUDDER_PARAMETERS = ("alpha1", "alpha2", "alpha3")  # the paper's, given by a vessel file
_SLOW_TURN = "a 10/10 zig-zag or a pull-out, which hold a slow turn that grows or decays by itself"
_FAST_TURN = "a 20/20 zig-zag or a 35° turning circle, which hold a fast turn"
_REVERSALS = "a zig-zag or a pseudo-random run, in which the rudder is often reversed"
_CIRCLE = "a 35° turning circle, held until the speed is steady"
_TWO_SPEEDS = "straight runs or turns at two or more rates of revolutions"
DRIFT_MANOEUVRES = "a zig-zag and a turning circle with positions or the sway velocity measured too"
MANOEUVRES = {
    **dict.fromkeys(("a", "d", "e", "T3", "k", "yd", "nd"), _REVERSALS),
    **dict.fromkeys(("b1", "nr", "nv"), _SLOW_TURN),
    **dict.fromkeys(("b2", "b3", "a3", "cy", "cn"), _FAST_TURN),
    **dict.fromkeys(("f", "f1", "f2", "xvr", "x4", "xd"), _CIRCLE),
    **dict.fromkeys(("g", "h", "p", "m", "w", *RUDDER_PARAMETERS), _TWO_SPEEDS),
    **dict.fromkeys(("c1", "c2", "Td", "yv", "yr"), DRIFT_MANOEUVRES),
    "e0": "the same manoeuvre to port and to starboard",
}


def manoeuvres_to_identify(name: str) -> str:
    """Name the manoeuvre whose log would determine a parameter of any ship model.

    Examples
    --------
    >>> manoeuvres_to_identify("f")
    'a 35° turning circle, held until the speed is steady'
    """
    return MANOEUVRES.get(name, "a manoeuvre that excites the term of this parameter")


@dataclass(frozen=True)
class TieCheck:
    """Whether b1 = -d holds, by a fit of the paper's model with b1 and d both free.

    Attributes
    ----------
    sum_over_d
        (b1 + d)/d, zero where the tie holds.
    std
        Its standard deviation.
    marginal
        Whether b1 may be zero or positive, where the tied form is singular.
    """

    sum_over_d: float
    std: float
    marginal: bool

    @property
    def contradicted(self) -> bool:
        """Whether the data contradict the tie."""
        return abs(self.sum_over_d) > MAX_TIE_DEVIATION * self.std

    def advice(self, *, tied: bool) -> str:
        """Recommend the tied or the free form; `tied` where the fit is of the tied form."""
        half = 1.96 * self.std
        result = f"(b1 + d)/d = {self.sum_over_d:.2g} ± {half:.2g} (95 %) in the free form"
        ties = "Ties b1 = −d and e = T3·d"
        if half > MAX_TIE_HALF_INTERVAL:
            return f"{ties}: undecided, {result}; the tied form assumes them."
        if self.contradicted:
            return f"{ties}: contradicted by the data, {result}; use the free form, burylin."
        if self.marginal:
            return (
                f"{ties}: not contradicted, {result}, but b1 may be zero, where they are singular; "
                "use the free form, burylin, or add a 10/10 zig-zag or a pull-out."
            )
        more = "" if tied else "; the model burylin-tied gives narrower intervals of b1 and e"
        return (
            f"{ties}: consistent with the data, {result}{more}, "
            "provided that the rudder parameters α are right."
        )


def check_ties(fit: OutputError) -> TieCheck | None:
    """Test the ties of the paper's model.

    Parameters
    ----------
    fit
        A fit of either form; the tied form is fitted again in the free form.

    Returns
    -------
    check
        None for any other model, or where b1 or d is fixed.
    """
    if fit.problem.model.name not in ("burylin", "burylin-tied"):
        return None
    free = fit if fit.problem.model.name == "burylin" else _free_form(fit)
    estimates = uncertainty(free, between_runs=False)
    if not {"b1", "d"} <= set(estimates.names):
        return None
    i, j = estimates.names.index("b1"), estimates.names.index("d")
    b1, d = estimates.values[i], estimates.values[j]
    covariance = estimates.covariance[np.ix_((i, j), (i, j))]
    gradient = np.array([1 / d, -b1 / d**2])
    std = float(np.sqrt(gradient @ covariance @ gradient))
    return TieCheck(float((b1 + d) / d), std, bool(b1 + 1.96 * estimates.std[i] >= 0))


def _free_form(fit: OutputError) -> OutputError:
    """Fit the free form, starting from a fit of the tied form."""
    problem = fit.problem
    start = problem.model.coefficients(fit.parameters)._asdict()
    fixed = {name: start.pop(name) for name in RUDDER_PARAMETERS}
    return output_error(
        problem.segments, ship_model("burylin"), start=start, fixed=fixed,
        nuisance=problem.nuisance, outputs=problem.outputs,
    )  # fmt: skip
