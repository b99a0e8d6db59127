"""Stages of a replay, chunk by chunk: filter, disturbance observer, regression, tests, track."""

from collections.abc import Mapping

import numpy as np

from analysis.filters.base import OUTPUT_STATES, Estimates
from analysis.filters.factory import smoothable
from analysis.filters.smoother import Adjoint, smoothed
from analysis.regression.changes import ShipChangeTest
from analysis.regression.coefficients import CoefficientStage
from shiplog import Signals
from shiplog.screening import ScreenedLog
from shiplog.ships.paper import PAPER_OUTPUTS

from .estimator_design import (
    diverged,
    make_estimators,
    require_settings_of_observer,
    without_rejected,
)
from .passes import weak_form_on_clock
from .plan import Plan
from .replay_results import Findings, ReplayChunk
from .residuals import ResidualTest
from .track import Tracker

MIN_EXCESS_SHARE = 0.5  # of the trial, with a disturbance beyond the rudder: the model is wrong


class Stages:
    """The stages of a replay; each takes a chunk, returns a chunk and carries its state.

    Parameters
    ----------
    plan
        The plan of the replay.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan, self._unchecked = plan, True
        self._filter, self._observer = make_estimators(plan)
        self._residual_tests = [_residual_test(plan, i) for i in range(len(PAPER_OUTPUTS))]
        weak_form = weak_form_on_clock(
            plan.vessel.paper_coefficients, plan.clock, plan.stats.intervals
        )
        count, window_secs = weak_form.row_count, plan.vessel.identifier.window_secs
        self._yaw = CoefficientStage(
            weak_form.yaw, count, plan.yaw_solution, constant=True, window_secs=window_secs
        )
        self._surge = CoefficientStage(
            weak_form.surge, count, plan.surge_solution, window_secs=window_secs
        )
        self._weak_form = weak_form
        self._change_test = ShipChangeTest(weak_form, model_is_fitted=plan.model_is_fitted)
        self.tracker = Tracker(plan.clock, plan.log_stats.get("position"))

    def step(
        self,
        signals: Signals,
        held: Signals,
        following: Mapping[str, float],
        adjoint: Adjoint | None,
    ) -> ReplayChunk:
        """Replay the next chunk.

        Parameters
        ----------
        signals
            The chunk as measured.
        held
            The same with the inputs held where they were not measured.
        following
            The inputs at the instant after the chunk.
        adjoint
            What the measurements after the chunk add; None where the states are not smoothed.
        """
        estimates = self._estimates(held, following, adjoint)
        for i, test in enumerate(self._residual_tests):
            test.add(
                estimates.innovations[:, i],
                estimates.innovation_stds[:, i],
                estimates.rejected[:, i],
            )
        disturbance = self._observer.step(without_rejected(held, estimates), following)
        if self._unchecked and not disturbance.is_finite:
            self._unchecked = False
            require_settings_of_observer(self._plan)
        yaw_rows, surge_rows = self._weak_form.step(signals, self._plan.stats.max_speed)
        self._change_test.add(yaw_rows, surge_rows)
        return ReplayChunk(
            signals,
            estimates,
            disturbance,
            self._yaw.step(yaw_rows),
            self._surge.step(surge_rows),
            self.tracker.step(signals, *(estimates.states[:, i] for i in OUTPUT_STATES)),
        )

    def findings(self, log: ScreenedLog) -> Findings:
        """Return the findings, once all chunks of the log were replayed."""
        residuals = tuple(test.result() for test in self._residual_tests)
        changes = self._change_test.result()
        warnings = [residual.warning for residual in residuals if residual.warning]
        warnings += _excess_warnings(self._plan, self._observer.excess_share)
        return Findings(
            plan=self._plan,
            metadata=dict(log.metadata),
            residuals=residuals,
            disturbances=self._observer.result(),
            yaw=self._yaw.result(),
            surge=self._surge.result(),
            changes=changes,
            track_origin=self.tracker.origin,
            warnings=(*self._plan.warnings, *warnings, *map(str, changes)),
            events=log.events,
        )

    def _estimates(
        self, held: Signals, following: Mapping[str, float], adjoint: Adjoint | None
    ) -> Estimates:
        """Filter the next chunk, and smooth it where `adjoint` is given."""
        try:
            if adjoint is None:
                estimates = self._filter.step(held, following)
            else:
                tracing = smoothable(self._filter)
                filtered, trace = tracing.trace(held, following)
                estimates = smoothed(tracing, held, following, filtered, trace, adjoint)
        except np.linalg.LinAlgError as error:  # of a gain that is designed anew at each instant
            raise diverged(self._plan, f" ({error})") from error
        if not np.all(np.isfinite(estimates.states)):
            raise diverged(self._plan)
        return estimates


def _excess_warnings(plan: Plan, share: float) -> list[str]:
    """Warn where the yaw disturbance is worth more rudder than the ship has."""
    if share < MIN_EXCESS_SHARE:
        return []
    text = (
        f"for {100 * share:.0f} % of the trial the yaw disturbance is worth more than the largest "
        f"rudder angle ({np.degrees(plan.vessel.rudder_max):.0f}°): the model "
        f"({plan.model_origin}) is wrong for this log; check the signs and units of rudder and "
        "yaw rate, or give another model with --vessel"
    )
    return [text]


def _residual_test(plan: Plan, output: int) -> ResidualTest:
    """Set up the test of the innovations of yaw rate, 0, or speed, 1."""
    name, interval = PAPER_OUTPUTS[output], float(plan.stats.intervals[output])
    channel, noise_measured = plan.log_stats[name], plan.noise.measured[output]
    low, high = channel.value_range
    return ResidualTest(
        name,
        channel.unit,
        interval,
        plan.clock.dt_secs,
        noise_measured=noise_measured,
        constant=low == high,
    )
