"""Result of an identification: the model, its uncertainty, fits and validation."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from analysis.identification.comparison.history import ParameterHistory
from analysis.identification.fit.output_error import OutputError
from analysis.identification.fit.problem import residuals
from analysis.identification.fit.uncertainty import Uncertainty
from shiplog.ships import Model
from shiplog.types import FloatArray
from shiplog.vessel.vessel import Vessel

from .advice import TieCheck
from .model_selection import Candidate
from .predicted_indices import PredictedManoeuvre
from .prior_sensitivity import PriorSensitivity
from .simulated_manoeuvres import Approach
from .validation import Validation, nan_rms


@dataclass(frozen=True, eq=False)
class RunFit:
    """How well a fit reproduces one segment, and what was estimated for that segment alone.

    Attributes
    ----------
    name
        The log's name.
    duration_secs
        The segment's duration.
    rms
        Root mean square of the residuals of each output, SI.
    rudder_offset
        The rudder's zero, rad; any constant yaw moment is part of it.
    biases
        Of the sensors that have one, SI.
    wave_secs
        The periods of the swells found.
    """

    name: str
    duration_secs: float
    rms: dict[str, float]
    rudder_offset: float
    biases: dict[str, float]
    wave_secs: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class IdentifiedShip:
    """A ship model identified from logs.

    Attributes
    ----------
    model
        The model that was fitted, or that was chosen.
    fit
        The output-error fit.
    uncertainty
        Standard deviations, intervals and Cramér-Rao bounds of the free parameters.
    prior_sensitivity
        How far the fit depends on its priors.
    histories
        Estimates over time by other methods, for comparison.
    runs
        The segments that were fitted.
    validations
        The segments that were predicted.
    candidates
        The models compared on held-out runs, the best first: all of them, or the one that was
        named; empty for a single run.
    predictions
        The standard manoeuvres as the models predict them, each by its weight.
    no_predictions
        Why there are none; else empty.
    approach
        The straight run before each predicted manoeuvre; None without predictions.
    ties
        Whether the ties of the paper's model hold; None for another model.
    vessel
        The vessel file whose length, rudder parameters and steering gear are used, if any.
    length_given
        Whether the ship's length is given; otherwise one is assumed.
    fixed
        The parameters that were not estimated.
    advice
        By parameter that is not identifiable, the manoeuvre that would determine it.
    warnings
        Warnings about the logs and about the fit.
    data_lost
        Whether a log is damaged and data were lost.
    """

    model: Model
    fit: OutputError
    uncertainty: Uncertainty
    prior_sensitivity: PriorSensitivity
    histories: tuple[ParameterHistory, ...]
    runs: tuple[RunFit, ...]
    validations: tuple[Validation, ...]
    candidates: tuple[Candidate, ...]
    predictions: tuple[PredictedManoeuvre, ...]
    no_predictions: str
    approach: Approach | None
    ties: TieCheck | None
    vessel: Vessel | None
    length_given: bool
    fixed: dict[str, float]
    advice: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    data_lost: bool = False

    @property
    def parameters(self) -> dict[str, float]:
        """All the model's parameters, estimated or fixed, in their own units."""
        return dict(zip(self.model.names, self.fit.parameters.tolist(), strict=True))

    @property
    def covariance(self) -> FloatArray:
        """(p, p) covariance of the free parameters, in the order of `uncertainty.names`."""
        return self.uncertainty.covariance

    @property
    def identifiable(self) -> tuple[str, ...]:
        """The free parameters that these logs determine."""
        return tuple(n for n in self.uncertainty.names if n not in self.uncertainty.unidentifiable)


def run_fits(fit: OutputError) -> Iterator[RunFit]:
    """Yield of each segment of a fit its residuals and the unknowns of its own."""
    problem, z = fit.problem, fit.minimum.unknowns
    residual = residuals(problem, z)
    for i, segment in enumerate(problem.segments):
        own = problem.own(z, i)
        yield RunFit(
            name=segment.name,
            duration_secs=(len(segment) - 1) * segment.dt_secs,
            rms={name: nan_rms(residual[i][:, c]) for c, name in enumerate(problem.outputs)},
            rudder_offset=problem.rudder_zero(z) + own.rudder,
            biases={
                problem.outputs[c]: float(bias)
                for (c, _), bias in zip(problem.biases, own.biases, strict=True)
            },
            wave_secs=tuple(float(2 * np.pi / abs(wave[0])) for wave in own.waves),
        )
