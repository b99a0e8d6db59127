"""How far the parameters of a fit may be off, by what the data themselves show.

Four answers, for four reasons to be off. The Cramér-Rao bound is of white noise of the size
found. What stays off for a while makes it too small; White's sandwich with Newey and West's (1987)
sums allows for that. What differs from run to run, as the ship's trim and her rudder's zero do,
shows when each run is left out in turn (the jackknife; Tukey, 1958). And where there are too few
runs for that, it shows how much more their estimates differ than they should if the model were
true: all errors are enlarged by so much (Birge, 1932).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, t

from shiplog.types import FloatArray

from .least_squares import Spread, linearised, minimise, weighed
from .output_error import OutputError
from .problem import Problem, residuals
from .trial import LEAST_SECS, Trial

LEAST_RUNS = 4  # for a jackknife
DOUBTFUL = 0.01  # by chance so rarely, and runs contradict each other
INDEPENDENT = 2  # of the parameters, in effect: they are correlated
LEAST_WINDOW_SECS = 5.0  # over which neighbours are taken together, at the least
VAGUE = 0.25  # relative std of a parameter that these data cannot tell,
ECHO = 0.5  # and how much of it may be what was believed before
NOTHING = 1e-200  # of information: its inverse is still a number
SINGULAR = 1e-13  # of the scaled information: less of it is none


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the p parameters sought. `std` is the one to be believed; the others say why."""

    names: tuple[str, ...]
    values: FloatArray  # (p,)
    std: FloatArray  # (p,) half the 95 % interval over 1.96
    bound: FloatArray  # (p,) Cramér and Rao's
    coloured: FloatArray  # (p,) for noise that stays
    between_runs: FloatArray  # (p,) by the jackknife; NaN with too few runs
    enlarged: float  # by how much, for a model that is not the ship
    prior_share: FloatArray  # (p,) of each value: how much of it was believed before any data
    covariance: FloatArray  # (p, p) that `std` is of
    condition: float  # of the scaled information on the parameters

    @property
    def interval(self) -> FloatArray:
        """(p, 2) in which 95 of 100 times the truth is."""
        return np.column_stack((self.values - 1.96 * self.std, self.values + 1.96 * self.std))

    @property
    def correlation(self) -> FloatArray:
        """(p, p) between them."""
        scale = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(scale, scale))

    @property
    def vague(self) -> tuple[str, ...]:
        """The parameters that are not identifiable from these data."""
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = self.std / np.abs(self.values)
        told = (relative <= VAGUE) & (self.prior_share <= ECHO)
        return tuple(name for name, is_told in zip(self.names, told, strict=True) if not is_told)


def uncertainty(fit: OutputError, *, between_runs: bool = True) -> Uncertainty:
    """How far off a fit's parameters may be.

    With `between_runs` the fit is repeated without each run in turn, or of a single one without
    each half.
    """
    problem, z = fit.problem, fit.minimum.unknowns
    p = len(problem.free)
    inverse = _inverse(problem, fit.minimum.information)
    share = np.diag(inverse)[:p] * problem.prior[1][:p]
    bound = _stds(_inverse(problem, _white_information(fit)))[:p]
    covariance = _sandwich(fit, inverse)[:p, :p]
    coloured = _stds(covariance)
    jackknife, enlarged = np.full(p, np.nan), 1.0
    if between_runs:
        others, variances = _left_out(fit)
        if len(others) >= LEAST_RUNS:
            jackknife = _jackknife(others)
        elif len(others) > 1:
            enlarged = _birge(others - z[:p], variances - np.diag(inverse)[:p], coloured, inverse)
    std = np.fmax(np.maximum(coloured, bound) * enlarged, jackknife)
    grown = std / np.where(coloured > 0, coloured, 1.0)
    information = fit.minimum.information + np.diag(problem.prior[1])
    return Uncertainty(
        problem.free_names, z[:p].copy(), std, bound, coloured, jackknife, enlarged, share,
        covariance * np.outer(grown, grown), _condition(information, p),
    )  # fmt: skip


def _inverse(problem: Problem, information: FloatArray) -> FloatArray:
    """The covariance of all unknowns; what nothing tells has a variance beyond all bounds."""
    whole = information + np.diag(problem.prior[1])
    scale = np.sqrt(np.maximum(np.diag(whole), NOTHING))
    values, vectors = np.linalg.eigh(whole / np.outer(scale, scale))
    scaled = (vectors / np.maximum(values, SINGULAR)) @ vectors.T
    return np.asarray(scaled / np.outer(scale, scale))


def _condition(information: FloatArray, p: int) -> float:
    """Of the root of the parameters' scaled information, the nuisances eliminated."""
    own = information[p:, p:]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    across = information[:p, p:] / scale
    solved = np.linalg.lstsq(own / np.outer(scale, scale), across.T, rcond=None)[0]
    left = information[:p, :p] - across @ solved
    size = np.sqrt(np.maximum(np.diag(left), 1e-300))
    values = np.linalg.eigvalsh(left / np.outer(size, size))
    return float(np.sqrt(values[-1] / max(values[0], 1e-16)))


def _stds(covariance: FloatArray) -> FloatArray:
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def _white_information(fit: OutputError) -> FloatArray:
    """The information if each sample were off by itself."""
    white = [replace(spread, effective=spread.usual) for spread in fit.spreads]
    left = residuals(fit.problem, fit.minimum.unknowns)
    return linearised(fit.problem, fit.minimum.unknowns, left, white, fit.minimum.jacobians)[1]


def _sandwich(fit: OutputError, inverse: FloatArray) -> FloatArray:
    """White's covariance, neighbouring scores summed over windows as Newey and West have it."""
    problem, z = fit.problem, fit.minimum.unknowns
    middle, left = np.diag(problem.prior[1]), residuals(problem, z)
    longest = max(noise.slow_secs for noise in fit.noises)
    for i, spread in enumerate(fit.spreads):
        off, weight = weighed(left[i], spread)
        scores = np.einsum("ncq,nc->nq", fit.minimum.jacobians[i], weight * off)
        together = max(longest, LEAST_WINDOW_SECS) / problem.trials[i].dt_secs
        window = int(min(max(together, 1), len(scores) / 2))
        sums = np.cumsum(scores, axis=0)
        ends = np.vstack((sums, np.tile(sums[-1], (window, 1))))
        starts = np.vstack((np.zeros((window, sums.shape[1])), sums))
        runs = ends - starts
        at = problem.places(i)
        middle[np.ix_(at, at)] += few(window / len(scores)) ** 2 * (runs.T @ runs) / window
    return np.asarray(inverse @ middle @ inverse)


def few(b: float) -> float:
    """The 95 % point of Kiefer and Vogelsang (2005) over the Gaussian's, windows b of the whole."""
    return (1.96 + b * (2.9694 + b * (0.4160 - b * 0.5324))) / 1.96


def _left_out(fit: OutputError) -> tuple[FloatArray, FloatArray]:
    """The parameters without each run in turn, and their variances by information: (r, p) each."""
    problem, p = fit.problem, len(fit.problem.free)
    pieces, spreads, sources = _pieces(fit)
    found, variances = [], []
    for i in range(len(pieces)):
        kept = [j for j in range(len(pieces)) if j != i]
        waves = tuple(problem.waves[sources[j]] for j in kept) if problem.waves else ()
        rest = replace(problem, trials=tuple(pieces[j] for j in kept), waves=waves)
        start = rest.start()
        start[:p] = fit.minimum.unknowns[:p]
        if len(problem.trials) > 1:  # whole runs: their own unknowns are known already
            for at, j in enumerate(kept):
                start[rest.own_slice(at)] = fit.minimum.unknowns[problem.own_slice(j)]
        minimum = minimise(rest, start, [spreads[j] for j in kept])
        found.append(minimum.unknowns[:p])
        variances.append(np.diag(_inverse(rest, minimum.information))[:p])
    return np.array(found).reshape(-1, p), np.array(variances).reshape(-1, p)


def _pieces(fit: OutputError) -> tuple[list[Trial], list[Spread], list[int]]:
    """The runs, of a single one its halves; their spreads; of which run each is."""
    problem = fit.problem
    if len(problem.trials) > 1:
        return list(problem.trials), list(fit.spreads), list(range(len(problem.trials)))
    trial, spread = problem.trials[0], fit.spreads[0]
    half = len(trial) // 2
    if half * trial.dt_secs < LEAST_SECS:
        return [], [], []
    cuts = ((0, half), (half, len(trial)))
    return (
        [trial.part(*cut) for cut in cuts],
        [Spread(spread.effective[slice(*cut)], spread.usual[slice(*cut)]) for cut in cuts],
        [0, 0],
    )


def _jackknife(others: FloatArray) -> FloatArray:
    """The std of what was found without each run in turn, its few runs allowed for."""
    count = len(others)
    spread = np.sum((others - others.mean(axis=0)) ** 2, axis=0) * (count - 1) / count
    return np.asarray(np.sqrt(spread) * t.ppf(0.975, count - 1) / 1.96)


def _birge(off: FloatArray, grown: FloatArray, coloured: FloatArray, inverse: FloatArray) -> float:
    """How much more the runs differ than they should, at least 1; 1 where it may be chance.

    `off` is what the fit changes by without each run, `grown` by how much its variance should grow
    then if noise were white; both (r, p).
    """
    expected = grown * (coloured**2 / np.diag(inverse)[: off.shape[1]])
    ratios = off**2 / np.maximum(expected, 1e-300)
    told = float(np.median(ratios) / chi2.ppf(0.5, 1))
    chance = chi2.ppf(1 - DOUBTFUL, INDEPENDENT) / INDEPENDENT
    return float(np.sqrt(told)) if told > chance else 1.0
