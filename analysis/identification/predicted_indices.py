"""Manoeuvring indices predicted from an identified ship, with intervals.

Ships are drawn from what the fit states of the parameters and of the rudder zero, and each draw
sails the manoeuvre. Where several models predict held-out runs about as well, draws are taken from
each by its weight, so that the spread between models is part of the interval. The squared errors
on held-out runs, where they exceed those predicted, have enlarged the covariance before
(`tempered_fit`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, radians

import numpy as np

from analysis.identification.fit.drift import (
    DRIFT_INDICES,
    DRIFT_REMEDY,
    DRIFT_UNKNOWN,
    shows_drift,
)
from analysis.identification.fit.output_error import OutputError, tempered_fit
from analysis.identification.fit.uncertainty import parameter_covariance
from analysis.manoeuvres.imo_criteria import criterion_of, probability_below
from analysis.manoeuvres.index_names import SYMBOLS, index_unit
from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind
from analysis.manoeuvres.trial_index import TrialIndex
from shiplog.types import FloatArray

from .held_out import PREDICTED, TRACK
from .model_selection import Candidate, largest_rudder
from .simulated_manoeuvres import (
    Approach,
    ShipDraws,
    SimulatedZigzag,
    simulate_circles,
    simulate_zigzags,
)

DRAWS = 60  # in all models together
LEAST_DRAWS = 10  # of a model, however small its weight
SEED = 20020  # of the draws: the same fit gives the same intervals
MIN_SPREAD = radians(0.1)  # of the rudder zero from run to run
MAX_MISSED = 0.05  # of the ships drawn, that do not reach an index, without a note
MAX_GROWTH = 3.0  # of the model's error with the rudder angle
OUTPUT_OF = {  # whose error on held-out runs stands for that of an index
    TRACK: ("advance", "transfer", "tactical diameter", "initial turning distance"),
    "heading": (
        "time to 90°", "time to 180°", "overshoot 1", "overshoot 2", "initial turning time",
    ),
    "yaw_rate": ("steady yaw rate",),
    "speed": ("steady speed",),
}  # fmt: skip
# whose error stands for that of an output that was not measured
SUBSTITUTES = (("heading", "yaw_rate"), ("yaw_rate", "heading"), (TRACK, "heading"))
CIRCLE_INDICES = {
    "advance": "advance",
    "transfer": "transfer",
    "tactical diameter": "tactical_diameter",
    "time to 90°": "time_90_secs",
    "time to 180°": "time_180_secs",
    "steady yaw rate": "steady_yaw_rate",
    "steady speed": "steady_speed",
}


@dataclass(frozen=True)
class StandardManoeuvre:
    """A manoeuvre to predict.

    Attributes
    ----------
    rudder
        The first rudder order, rad, positive to starboard.
    switch
        The change of heading at which the rudder is reversed, rad; None for a turning circle.
    """

    rudder: float
    switch: float | None = None

    @property
    def kind(self) -> ManoeuvreKind:
        """A turning circle or a zig-zag."""
        return ManoeuvreKind.TURNING_CIRCLE if self.switch is None else ManoeuvreKind.ZIGZAG

    @property
    def name(self) -> str:
        """Such as ``turning circle 35° to starboard``.

        Examples
        --------
        >>> from math import radians
        >>> StandardManoeuvre(radians(-10.0), radians(10.0)).name
        'zig-zag 10°/10° to port'
        """
        side = "starboard" if self.rudder > 0 else "port"
        angle = f"{abs(degrees(self.rudder)):.0f}°"
        if self.switch is None:
            return f"turning circle {angle} to {side}"
        return f"zig-zag {angle}/{degrees(self.switch):.0f}° to {side}"


def _both_sides(rudder_deg: float, switch_deg: float | None = None) -> list[StandardManoeuvre]:
    switch = None if switch_deg is None else radians(switch_deg)
    return [StandardManoeuvre(side * radians(rudder_deg), switch) for side in (1, -1)]


IMO_MANOEUVRES = (*_both_sides(35.0), *_both_sides(10.0, 10.0), *_both_sides(20.0, 20.0))


@dataclass(frozen=True)
class PredictedManoeuvre:
    """The predicted indices of a manoeuvre.

    Attributes
    ----------
    manoeuvre
        The manoeuvre.
    indices
        With 95 % intervals, standard uncertainty by source, and the limit of the norm. The value is
        NaN for what the predicted ship does not reach, and for what its drift changes where the
        logs do not show it; the note of the index is the reason. It also
        states how many of the ships drawn do not reach a value.
    note
        Why the prediction reaches beyond the logs; empty where it does not.
    """

    manoeuvre: StandardManoeuvre
    indices: tuple[TrialIndex, ...]
    note: str = ""


def predict_manoeuvres(
    candidates: Sequence[Candidate],
    approach: Approach,
    manoeuvres: Sequence[StandardManoeuvre] = IMO_MANOEUVRES,
    draws: int = DRAWS,
) -> tuple[PredictedManoeuvre, ...]:
    """Predict manoeuvres with intervals.

    Parameters
    ----------
    candidates
        The models with their fits and weights; those of weight 0 are not used.
    approach
        The straight run before each manoeuvre; its speed is V of the norm.
    manoeuvres
        The manoeuvres to predict.
    draws
        The number of ships drawn, in all models together.
    """
    used = [each for each in candidates if each.weight > 0 and each.fit is not None]
    weights = np.array([each.weight for each in used])
    members = [
        _members(each, approach, max(LEAST_DRAWS, round(draws * each.weight))) for each in used
    ]
    return tuple(_predicted(each, members, weights) for each in manoeuvres)


@dataclass(frozen=True, eq=False)
class _Members:
    """Ships drawn from one model: its best estimate, two with other rudder zeros, the draws."""

    ships: ShipDraws
    fitted_rudder: float
    misfits: Mapping[str, float]
    hard_ratio: float
    shows_drift: bool

    def discrepancy(self, name: str, manoeuvre: StandardManoeuvre) -> float:
        """Return the relative error of an index that held-out runs show.

        It grows with the rudder angle beyond the fitted ones, as it did in the hardest runs.
        """
        ratio = abs(manoeuvre.rudder) / self.fitted_rudder
        growth = min(max(ratio, 1.0), MAX_GROWTH) / max(self.hard_ratio, 1.0)
        return self.misfits[next(o for o, names in OUTPUT_OF.items() if name in names)] * max(
            growth, 1 / MAX_GROWTH
        )


CENTRAL, ZERO_UP, ZERO_DOWN, FIRST_DRAW = range(4)


def _members(candidate: Candidate, approach: Approach, count: int) -> _Members:
    assert candidate.fit is not None  # noqa: S101 - for the type checker
    fit = tempered_fit(candidate.fit, candidate.excess)
    problem, z = fit.problem, fit.minimum.unknowns
    common = z[: problem.common]
    covariance = parameter_covariance(fit)
    rng = np.random.default_rng(SEED)
    lowest, highest = (limits[: problem.common] for limits in problem.bounds)
    drawn = rng.multivariate_normal(common, covariance, size=count, method="eigh")
    drawn = np.clip(drawn, lowest, highest)
    rows = np.vstack((common, common, common, drawn))
    zeros = np.array([problem.rudder_zero(row) for row in rows])
    spread = _zero_spread(fit)
    zeros[ZERO_UP] += spread
    zeros[ZERO_DOWN] -= spread
    parameters = np.array([problem.parameters(row) for row in rows])
    largest = max(largest_rudder(segment) for segment in problem.segments)
    misfits = dict(zip(PREDICTED, candidate.hard_misfits.tolist(), strict=True))
    for name, substitute in SUBSTITUTES:
        if not np.isfinite(misfits[name]):
            misfits[name] = misfits[substitute]
    ships = ShipDraws(problem.model, problem.scale, approach, parameters, zeros)
    drift = shows_drift(problem)
    return _Members(ships, largest, misfits, candidate.hard_ratio, drift)


def _zero_spread(fit: OutputError) -> float:
    """Return the standard deviation of the rudder zero from run to run, rad."""
    own = [
        fit.problem.own(fit.minimum.unknowns, i).rudder for i in range(len(fit.problem.segments))
    ]
    return max(float(np.sqrt(np.mean(np.square(own)))), MIN_SPREAD)


def _predicted(
    manoeuvre: StandardManoeuvre, members: Sequence[_Members], weights: FloatArray
) -> PredictedManoeuvre:
    values = [_values(manoeuvre, each.ships) for each in members]
    approach = members[0].ships.approach
    indices = []
    for name in values[0]:
        if name in DRIFT_INDICES and not members[0].shows_drift:
            indices.append(_without_value(name, f"{DRIFT_UNKNOWN}; {DRIFT_REMEDY}"))
            continue
        discrepancy = [each.discrepancy(name, manoeuvre) for each in members]
        of_models = _OfModels([each[name] for each in values], weights, np.array(discrepancy))
        indices.append(_index(name, manoeuvre, of_models, approach))
    fitted = degrees(max(each.fitted_rudder for each in members))
    beyond = degrees(abs(manoeuvre.rudder)) > 1.1 * fitted
    note = f"extrapolated: the logs have rudder angles up to {fitted:.0f}°" if beyond else ""
    return PredictedManoeuvre(manoeuvre, tuple(indices), note)


def _values(manoeuvre: StandardManoeuvre, ships: ShipDraws) -> Mapping[str, FloatArray]:
    """Return by index its values, (k,), of k ships, SI."""
    if manoeuvre.switch is None:
        circles = simulate_circles(ships, manoeuvre.rudder)
        return {
            name: np.array([getattr(each, attribute) for each in circles])
            for name, attribute in CIRCLE_INDICES.items()
        }
    zigzags = simulate_zigzags(ships, manoeuvre.rudder, manoeuvre.switch)
    return {
        name: np.array([value(each) for each in zigzags]) for name, value in ZIGZAG_INDICES.items()
    }


ZIGZAG_INDICES: Mapping[str, Callable[[SimulatedZigzag], float]] = {
    "initial turning time": lambda zigzag: zigzag.initial_turning_secs,
    "initial turning distance": lambda zigzag: zigzag.initial_turning_distance,
    "overshoot 1": lambda zigzag: zigzag.overshoots[0],
    "overshoot 2": lambda zigzag: zigzag.overshoots[1],
}


@dataclass(frozen=True, eq=False)
class _OfModels:
    """Of each of the m models the values of an index, (k,), its weight and relative discrepancy."""

    values: Sequence[FloatArray]
    weights: FloatArray
    discrepancy: FloatArray


def _index(
    name: str, manoeuvre: StandardManoeuvre, of_models: _OfModels, approach: Approach
) -> TrialIndex:
    """Return an index with its interval."""
    values, weights = of_models.values, of_models.weights
    central = np.array([each[CENTRAL] for each in values])
    sound = np.isfinite(central)
    if not sound.any():
        return _without_value(name, "the predicted ship does not reach it")
    share = np.where(sound, weights, 0.0) / weights[sound].sum()
    value = float(np.nansum(share * np.nan_to_num(central)))
    within = np.array([_robust_std(each[FIRST_DRAW:]) for each in values])
    zero = np.array([abs(each[ZERO_UP] - each[ZERO_DOWN]) / 2 for each in values])
    sources = {
        "parameters": float(np.sqrt(np.nansum(share * within**2))),
        "choice of model": float(np.sqrt(np.sum(share * np.nan_to_num(central - value) ** 2))),
        "rudder zero": float(np.sqrt(np.nansum(share * zero**2))),
    }
    # an overshoot is the end of a swing of the heading, whose error does not shrink with it
    size = abs(value) + (manoeuvre.switch or 0.0) * name.startswith("overshoot")
    errors = np.where(sound, of_models.discrepancy, 0.0)
    sources["model error"] = float(np.sqrt(np.sum(share * errors**2))) * size
    further = float(np.hypot(sources["rudder zero"], sources["model error"]))
    low, high = _interval(value, values, share, further)
    std = (high - low) / (2 * 1.96)
    unit = index_unit(name)
    angles = manoeuvre.rudder, manoeuvre.switch or 0.0
    length = approach.length if approach.length_given else float("nan")
    data = {"length": length, "test_speed": approach.speed}
    criterion = criterion_of(name, manoeuvre.kind, angles, data, astern=False)
    missed = float(share @ [np.mean(~np.isfinite(each[FIRST_DRAW:])) for each in values])
    note = f"{100 * missed:.0f} % of the ships drawn do not reach it, nor count in the interval"
    return TrialIndex(
        name, SYMBOLS.get(name, ""), value, unit, std, low, high,
        sources=sources,
        in_lengths=value / length if unit == "m" else float("nan"),
        criterion=criterion,
        probability=probability_below(criterion.limit, value, std) if criterion else float("nan"),
        note=note if missed > MAX_MISSED else "",
    )  # fmt: skip


def _without_value(name: str, reason: str) -> TrialIndex:
    nan = float("nan")
    return TrialIndex(
        name, SYMBOLS.get(name, ""), nan, index_unit(name), nan, nan, nan, note=reason
    )


def _robust_std(values: FloatArray) -> float:
    low, high = np.nanquantile(values, (0.1587, 0.8413)) if np.isfinite(values).any() else (0, 0)
    return float(high - low) / 2


def _interval(
    value: float, values: Sequence[FloatArray], share: FloatArray, further_std: float
) -> tuple[float, float]:
    """Return the 95 % interval from the draws of all models and further sources."""
    pooled = np.concatenate([each[FIRST_DRAW:] for each in values])
    weight = np.concatenate(
        [np.full(len(each) - FIRST_DRAW, w / (len(each) - FIRST_DRAW))
         for each, w in zip(values, share, strict=True)]
    )  # fmt: skip
    finite = np.isfinite(pooled)
    order = np.argsort(pooled[finite])
    ranked, cumulated = pooled[finite][order], np.cumsum(weight[finite][order])
    if not len(ranked):
        return float("nan"), float("nan")
    cumulated = (cumulated - weight[finite][order] / 2) / cumulated[-1]
    low, high = np.interp((0.025, 0.975), cumulated, ranked)
    extra = 1.96 * further_std
    below, above = max(value - low, 0.0), max(high - value, 0.0)
    return value - float(np.hypot(below, extra)), value + float(np.hypot(above, extra))
