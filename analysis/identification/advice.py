"""What would tell a parameter that these data cannot tell, and whether to tie the paper's."""

from dataclasses import dataclass

import numpy as np

from shiplog.ships import ship_model

from .output_error import OutputError, output_error
from .uncertainty import uncertainty

CONTRADICTED = 3.0  # standard deviations by which a tie is off
UNDECIDED = 1.0  # half an interval of (b1 + d)/d: between a tie and a ship at the margin
_SMALL = "a 10/10 zig-zag or a pull-out: a slow turn that grows or dies by itself"
_HARD = "a 20/20 zig-zag or a 35° turning circle: a fast turn"
_QUICK = "a zig-zag or a pseudo-random run: the rudder often reversed"
_CIRCLE = "a 35° turning circle, held until the speed is steady"
_SPEEDS = "straight runs or turns at two rates of revolutions or more"
_DRIFT = "a zig-zag and a circle with the sway measured too (layouts derive it from velocities)"
TOLD_BY = {
    **dict.fromkeys(("a", "d", "e", "T3", "k", "yd", "nd"), _QUICK),
    **dict.fromkeys(("b1", "nr", "nv"), _SMALL),
    **dict.fromkeys(("b2", "b3", "a3", "cy", "cn"), _HARD),
    **dict.fromkeys(("f", "f1", "f2", "xvr", "x4", "xd"), _CIRCLE),
    **dict.fromkeys(("g", "h", "p", "m", "w", "alpha1", "alpha2", "alpha3"), _SPEEDS),
    **dict.fromkeys(("c1", "c2", "Td", "yv", "yr"), _DRIFT),
    "e0": "the same manoeuvre to both sides",
}


def manoeuvres_to_identify(name: str) -> str:
    """The manoeuvre that would tell a parameter of any model, in words."""
    return TOLD_BY.get(name, "a manoeuvre that moves what it multiplies")


@dataclass(frozen=True)
class TieCheck:
    """Whether b1 = -d holds, by a fit in the free form."""

    sum_over_d: float  # (b1 + d) / d: zero where it holds
    std: float  # of it
    marginal: bool  # whether b1 may be zero or positive, where the tie is singular

    @property
    def contradicted(self) -> bool:
        """Whether the data speak against it."""
        return abs(self.sum_over_d) > CONTRADICTED * self.std

    def advice(self, *, tied: bool) -> str:
        """In words: for the tie, or against it; `tied` where it is made already."""
        off = f"(b1 + d)/d = {self.sum_over_d:.2g} ± {1.96 * self.std:.2g} in the free form"
        if 1.96 * self.std > UNDECIDED:
            return f"Ties b1 = −d, e = T3·d: the data cannot tell, {off}; tied, they are believed."
        if self.contradicted:
            return f"Ties b1 = −d, e = T3·d: the data speak against them, {off}; leave it free."
        if self.marginal:
            return (
                f"Ties b1 = −d, e = T3·d: not contradicted ({off}), but b1 may be zero, where they "
                "are singular; leave it free, or add a manoeuvre that tells b1."
            )
        more = "" if tied else "; --model burylin-tied tells b1 and e more surely"
        return (
            f"Ties b1 = −d, e = T3·d: the data allow them, {off}{more}, "
            "if the ship's gear is as the α's say."
        )


def check_ties(fit: OutputError) -> TieCheck | None:
    """Whether the paper's ties hold for the ship of a fit to either of its forms; else None."""
    if fit.problem.model.name not in ("burylin", "burylin-tied"):
        return None
    free = fit if fit.problem.model.name == "burylin" else _in_free_form(fit)
    found = uncertainty(free, between_runs=False)
    if not {"b1", "d"} <= set(found.names):
        return None
    i, j = found.names.index("b1"), found.names.index("d")
    b1, d = found.values[i], found.values[j]
    covariance = found.covariance[np.ix_((i, j), (i, j))]
    slope = np.array([1 / d, -b1 / d**2])
    std = float(np.sqrt(slope @ covariance @ slope))
    return TieCheck(float((b1 + d) / d), std, bool(b1 + 1.96 * found.std[i] >= 0))


def _in_free_form(fit: OutputError) -> OutputError:
    problem, free = fit.problem, ship_model("burylin")
    start = problem.model.coefficients(fit.parameters)._asdict()
    known = {name: start[name] for name in ("alpha1", "alpha2", "alpha3")}
    start = {name: value for name, value in start.items() if name not in known}
    return output_error(
        problem.segments, free, start=start, fixed=known, nuisance=problem.nuisance,
        outputs=problem.outputs,
    )  # fmt: skip
