"""Warnings about a fit: residuals, contradicting runs, other minima."""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.identification.fit.drift import (
    DRIFT_INDICES,
    DRIFT_REMEDY,
    DRIFT_UNKNOWN,
    drift_is_unknown,
)
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.problem import residuals
from analysis.identification.fit.uncertainty import Uncertainty

from .prior_sensitivity import PriorSensitivity
from .validation import Validation, nan_rms

MAX_RESIDUAL_SHARE = 0.2  # rms of a run's residuals, white noise subtracted, over the measured std
MAX_CONTRADICTION = 3.0  # difference between runs over what their noise explains


def fit_warnings(
    fit: OutputError,
    fitted: Uncertainty,
    sensitivity: PriorSensitivity,
    validations: Sequence[Validation],
) -> Iterator[str]:
    """Yield a line for each reason not to trust a fit."""
    if not fit.minimum.converged:
        yield "the fit has not converged; its values are those of the last iteration"
    if sensitivity.other_minimum:
        better = "better" if sensitivity.worse_by < 0 else "worse"
        yield (
            f"from another start the fit ends in another minimum, which is {better}: the logs "
            "hardly determine this model; add manoeuvres, or fit a model with fewer parameters"
        )
    yield from _unknown_drift(fit, fitted)
    yield from _large_residuals(fit)
    yield from _contradiction(fit, fitted)
    if set(fitted.unidentifiable) == set(fitted.names):
        yield "no parameter is identifiable from these logs; add manoeuvres"
    for validation in validations:
        if validation.diverged:
            yield f"{validation.segment.name}: the simulation diverges, so there is no prediction"


def _unknown_drift(fit: OutputError, fitted: Uncertainty) -> Iterator[str]:
    """Yield a line where nothing that was measured shows the drift of the model."""
    if not drift_is_unknown(fit.problem):
        return
    names = f" ({', '.join(fitted.unobserved)})" if fitted.unobserved else ""
    *first, last = DRIFT_INDICES
    yield (
        f"the drift{names} is {DRIFT_UNKNOWN}: {', '.join(first)} and {last} are not predicted; "
        f"{DRIFT_REMEDY}"
    )


def _large_residuals(fit: OutputError) -> Iterator[str]:
    """Yield the runs that the fit does not explain, white noise excepted."""
    problem = fit.problem
    all_residuals = residuals(problem, fit.minimum.unknowns)
    for i, (segment, residual, stds) in enumerate(
        zip(problem.segments, all_residuals, fit.residual_stds, strict=True)
    ):
        for c, output in enumerate(problem.outputs):
            measured = problem.measured(i)[:, c]
            white = max(float(np.mean(stds.typical[:, c] ** 2)) - fit.noises[c].slow ** 2, 0.0)
            rms = np.sqrt(max(nan_rms(residual[:, c]) ** 2 - white, 0.0))
            size = float(np.nanstd(measured)) if np.isfinite(measured).any() else 0.0
            if rms > MAX_RESIDUAL_SHARE * size and rms**2 > white:
                yield (
                    f"{segment.name}: the residual of the {output.replace('_', ' ')} is "
                    f"{100 * rms / size:.0f} % of its standard deviation; check that the ship goes "
                    "ahead throughout, that it is the same ship, the units, and the choice of model"
                )


def _contradiction(fit: OutputError, fitted: Uncertainty) -> Iterator[str]:
    """Yield a line where the runs contradict each other."""
    ratio = fitted.agreement.contradiction
    if ratio <= MAX_CONTRADICTION:
        return
    if len(fit.problem.runs) == 1:
        which = f"the halves of {fit.problem.segments[0].name} contradict each other"
    else:
        which = "the logs contradict each other"
    if fitted.agreement.outlier:
        which += f", most of all {fitted.agreement.outlier}"
    yield (
        f"{which}: they differ by {ratio:.0f} times what their noise explains; another ship, "
        "loading or water depth, or a model that does not fit the ship; the intervals allow for it"
    )
