"""Whether runs are of one ship, as far as a model tells: each fitted by itself against all at once.

What a run loses in likelihood by the parameters of all, against those of its own, is a chi-squared
number where the model is true and the ship the same (Wilks, "The large-sample distribution of the
likelihood ratio for testing composite hypotheses", 1938). A run that tells little loses little,
whatever its own values are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan, sqrt

import numpy as np
from scipy.special import gammaincinv

from shiplog.types import FloatArray

from .least_squares import Minimum, ResidualStd, marginal_information, minimise, total_cost
from .output_error import OutputError, reweighted_fit
from .problem import Problem, residuals
from .segment import MIN_SEGMENT_SECS

DOUBTFUL = 0.01  # by chance so rarely, and runs contradict each other
INDEPENDENT = 2  # of the parameters, in effect: they are correlated
HALVES = ("its first half", "its second half")


@dataclass(frozen=True)
class Agreement:
    """How many times more than noise explains runs are off what all of them say together.

    Each is a ratio of standard deviations, about 1 where the model is true: against the noise that
    a run has by itself, NaN where it is too short to be judged so, and against that of the fit to
    all, which holds what they contradict each other in.
    """

    names: tuple[str, ...]
    by_own_noise: tuple[float, ...]
    by_common_noise: tuple[float, ...]
    outlier: str | None = None  # without it the others agree best

    @property
    def contradiction(self) -> float:
        """How many times more than their noise runs are apart; 1 where it may be chance."""
        return _together(self.by_own_noise)

    @property
    def enlargement(self) -> float:
        """By how much errors by the noise of all are to be enlarged; 1 where it may be chance."""
        return _together(self.by_common_noise)


def _together(ratios: Sequence[float]) -> float:
    known = np.array(ratios)[np.isfinite(ratios)]
    if len(known) < 2:
        return 1.0
    # all runs together lose as much as their number less one would, each fitted by itself
    told = float(np.sum(known**2)) / (len(known) - 1)
    chance = 2 * float(gammaincinv(INDEPENDENT / 2, 1 - DOUBTFUL)) / INDEPENDENT  # of chi-squared
    return float(np.sqrt(told)) if told > chance else 1.0


def assess_agreement(fit: OutputError) -> Agreement:
    """How the runs of a fit agree, or the halves of a single one."""
    parts = _runs(fit) if len(fit.problem.runs) > 1 else _halves(fit)
    alone = [_alone(part) for part in parts]
    names = tuple(part.name for part in parts)
    ratios = (tuple(each.by_own_noise for each in alone), tuple(each.by_all for each in alone))
    return Agreement(names, *ratios, _odd(names, alone))


@dataclass(frozen=True, eq=False)
class _Part:
    """A run, or half of one, as a problem of its own, and what the fit to all says of it."""

    name: str
    problem: Problem
    unknowns: FloatArray
    residual_stds: tuple[ResidualStd, ...]


def _runs(fit: OutputError) -> list[_Part]:
    problem, z = fit.problem, fit.minimum.unknowns
    return [
        _Part(
            problem.segments[run[0]].name, *problem.select_segments(run, z),
            tuple(fit.residual_stds[i] for i in run),
        )
        for run in problem.runs
    ]  # fmt: skip


def _halves(fit: OutputError) -> list[_Part]:
    """None where they are too short."""
    segments, z = fit.problem.segments, fit.minimum.unknowns
    if min(len(segment) // 2 * segment.dt_secs for segment in segments) < MIN_SEGMENT_SECS:
        return []
    halves = []
    for name, share in zip(HALVES, (0.0, 0.5), strict=True):
        cuts = [_half(len(segment), share) for segment in segments]
        cut = [segment.part(*at) for segment, at in zip(segments, cuts, strict=True)]
        problem = replace(fit.problem, segments=tuple(cut))
        residual_stds = (s.part(*at) for s, at in zip(fit.residual_stds, cuts, strict=True))
        halves.append(
            _Part(name, problem, _begun_anew(problem, z) if share else z, tuple(residual_stds))
        )
    return halves


def _half(count: int, share: float) -> tuple[int, int]:
    return (count // 2, count) if share else (0, count // 2)


def _begun_anew(problem: Problem, z: FloatArray) -> FloatArray:
    """The unknowns but for the states that the segments begin in: those are of other instants."""
    begun, start = z.copy(), problem.start()
    for i in range(len(problem.segments)):
        at = problem.own_slice(i).start
        states = slice(at, at + len(problem.model.state))
        begun[states] = start[states]
    return begun


@dataclass(frozen=True, eq=False)
class _Alone:
    """A run fitted by itself."""

    by_own_noise: float  # by how many stds, in the mean over the parameters, it is off all runs
    by_all: float  # the same by the noise of the fit to all
    values: FloatArray  # (p,) its own
    information: FloatArray  # (p, p) on them


def _alone(part: _Part) -> _Alone:
    alone, shared = part.problem, part.unknowns[: len(part.problem.free)]
    pinned = replace(alone, values=alone.parameters(part.unknowns), free=())
    first = minimise(pinned, part.unknowns[len(shared) :], part.residual_stds)
    loose = minimise(alone, np.concatenate((shared, first.unknowns)), part.residual_stds)
    own = reweighted_fit(alone, loose)
    there = minimise(pinned, first.unknowns, own.residual_stds)
    by_own = _lost(alone, shared, there, own.minimum, own.residual_stds)
    by_all = _lost(alone, shared, first, loose, part.residual_stds)
    free = _freedom(own)
    whole = own.minimum.information + np.diag(alone.prior[1])
    return _Alone(
        sqrt(by_own * free) if free > 0 else nan, sqrt(by_all),
        own.parameters[list(alone.free)], marginal_information(whole, len(shared)),
    )  # fmt: skip


def _lost(
    alone: Problem,
    shared: FloatArray,
    pinned: Minimum,
    free: Minimum,
    residual_stds: Sequence[ResidualStd],
) -> float:
    """What a run loses by the parameters that all share, as squared stds for each parameter."""
    z = np.concatenate((shared, pinned.unknowns))
    lost = total_cost(alone, z, residuals(alone, z), residual_stds) - free.cost
    return max(2 * lost, 0.0) / len(shared) if np.isfinite(lost) else np.nan


def _freedom(fit: OutputError) -> float:
    """Which share of what a fit could leave its unknowns have not taken; none at zero or below.

    A slow noise leaves few numbers that are independent, and the more unknowns there are the
    smaller it looks.
    """
    problem = fit.problem
    independent = sum(
        float(np.sum((spread.typical / spread.effective)[problem.measured_mask(i)] ** 2))
        for i, spread in enumerate(fit.residual_stds)
    )
    told = fit.minimum.information
    precision = np.diag(problem.prior[1])
    taken = float(np.trace(np.linalg.lstsq(told + precision, told, rcond=None)[0]))
    return 1 - taken / independent


def _odd(names: Sequence[str], alone: Sequence[_Alone]) -> str | None:
    """The run without which the others come nearest to each other."""
    if len(names) < 3:
        return None
    apart = [_apart([each for j, each in enumerate(alone) if j != i]) for i in range(len(alone))]
    return names[int(np.argmin(apart))]


def _apart(runs: Sequence[_Alone]) -> float:
    """The weighted sum of squares of their values about what they have in common."""
    total = sum(each.information for each in runs)
    pulled = sum(each.information @ each.values for each in runs)
    common = np.linalg.lstsq(np.asarray(total), np.asarray(pulled), rcond=None)[0]
    off = [each.values - common for each in runs]
    return float(sum(x @ each.information @ x for x, each in zip(off, runs, strict=True)))
