"""Results of a replay: chunk by chunk, of the whole trial, and findings without time series."""

from dataclasses import dataclass

from analysis.disturbance.disturbances import Disturbance, DisturbanceSummary
from analysis.filters.base import Estimates
from analysis.regression.changes import Change
from analysis.regression.coefficients import CoefficientFit
from analysis.regression.sliding import CoefficientHistory
from shiplog import Signals
from shiplog.types import Event

from .current import Current
from .plan import Plan
from .residuals import ResidualSummary
from .sensor_errors import SlowState
from .track import Track


@dataclass(frozen=True, eq=False)
class ReplayChunk:
    """The results of a replay for a stretch of the trial, as far as they are known by its end.

    Attributes
    ----------
    signals
        The resampled signals, as measured; NaN where nothing was measured.
    estimates
        The filter's states, on the clock of the signals.
    disturbance
        The disturbances estimated, on the same clock.
    yaw_history, surge_history
        The coefficients of the windows that end in this stretch.
    track
        The positions that have become known in this stretch.
    """

    signals: Signals
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: CoefficientHistory
    surge_history: CoefficientHistory
    track: Track


@dataclass(frozen=True, eq=False)
class Findings:
    """The results of a replay for the whole trial, without its time series.

    Attributes
    ----------
    plan
        The plan of the replay: vessel, clock, statistics, noise.
    metadata
        The metadata of the log.
    residuals
        The tests of the innovations of yaw rate and speed, and of the heading and the position
        (``north``, ``east``) that the filter uses.
    disturbances
        The summary of each disturbance: ``"yaw"``, ``"rudder"`` (yaw, as the rudder that would do
        the same), ``"surge"``, and ``"yaw_wave"``, ``"surge_wave"``, ``"yaw_wind"`` and
        ``"surge_wind"`` where they are estimated.
    yaw, surge
        The coefficients over the whole trial, with standard deviations.
    changes
        The coefficients that changed within the trial.
    track_origin
        How the track is known, in words.
    warnings
        Those of the plan and those of the replay.
    events
        The events of the log, in the order of time.
    sensor_errors
        The sensor errors that the filter estimates, and those that it was to and cannot.
    current
        The current at the end of the trial; None where the filter does not estimate it.
    wind
        The coefficients of the wind that the filter estimates, and those that it cannot.
    """

    plan: Plan
    metadata: dict[str, str]
    residuals: tuple[ResidualSummary, ...]
    disturbances: dict[str, DisturbanceSummary]
    yaw: CoefficientFit
    surge: CoefficientFit
    changes: tuple[Change, ...]
    track_origin: str
    warnings: tuple[str, ...]
    events: tuple[Event, ...] = ()
    sensor_errors: tuple[SlowState, ...] = ()
    current: Current | None = None
    wind: tuple[SlowState, ...] = ()


@dataclass(frozen=True, eq=False)
class Analysis:
    """All results of a replay: the findings, and the time series of the whole trial.

    Attributes
    ----------
    findings
        What holds for the whole trial: plan, residual tests, coefficients, warnings.
    signals, estimates, disturbance, yaw_history, surge_history, track
        The time series; see `ReplayChunk`.
    """

    findings: Findings
    signals: Signals
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: CoefficientHistory
    surge_history: CoefficientHistory
    track: Track

    def as_chunk(self) -> ReplayChunk:
        """Return the time series as one chunk."""
        return ReplayChunk(
            self.signals,
            self.estimates,
            self.disturbance,
            self.yaw_history,
            self.surge_history,
            self.track,
        )
