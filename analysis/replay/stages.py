"""Stages of a replay, chunk by chunk: filter, disturbance observer, regression, tests, track."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from analysis.disturbance.disturbances import Disturbance
from analysis.disturbance.filter_forces import FilterForces
from analysis.filters.base import OUTPUT_STATES, Estimates, FurtherStates
from analysis.filters.factory import smoothable
from analysis.filters.further_parts import SENSOR_WALKS
from analysis.filters.noise_model import FURTHER_OUTPUTS
from analysis.filters.smoother import Adjoint, smooth_chunk
from analysis.regression.changes import ShipChangeTest, determined_changes
from analysis.regression.coefficients import CoefficientStage
from shiplog import Signals
from shiplog.screening import ScreenedLog
from shiplog.ships.paper import PAPER_OUTPUTS

from .current import current_of
from .estimator_design import (
    diverged,
    make_estimators,
    require_settings_of_observer,
    without_rejected,
    without_sensor_errors,
)
from .passes import weak_form_on_clock
from .plan import Plan
from .replay_results import Findings, ReplayChunk
from .residuals import ResidualSummary, ResidualTest
from .sensor_errors import Middle, inconsistency_of, noise_remedy, slow_states
from .track import Tracker
from .wind_choice import wind_walks

WIND_IN_MODEL = (
    "the model was fitted to this log and contains part of the wind; give a model with --vessel"
)
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
        further = plan.noise.further
        self._forces = (
            FilterForces(
                plan.vessel.paper_coefficients,
                plan.stats,
                plan.disturbance_settings,
                wind=further.wind,
                rudder_max=plan.vessel.rudder_max,
            )
            if further.yaw
            else None
        )
        self._last: dict[str, tuple[float, float]] = {}
        self._middle: dict[str, tuple[float, float]] = {}
        self._residual_tests = [
            *(_residual_test(plan, i) for i in range(len(PAPER_OUTPUTS))),
            *(_further_residual_test(plan, name) for name in further.outputs),
        ]
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
        adjoints: Iterator[Adjoint] | None,
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
        adjoints
            What the measurements after each piece of the chunk add, as `smooth_chunk` takes it;
            None where the states are not smoothed.
        """
        estimates = self._estimates(held, following, adjoints)
        for i, test in enumerate(self._residual_tests):
            test.add(
                estimates.innovations[:, i],
                estimates.innovation_stds[:, i],
                estimates.rejected[:, i],
            )
        disturbance = self._disturbance(held, following, estimates)
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
        yaw, surge = self._yaw.result(), self._surge.result()
        changes = determined_changes(
            self._change_test.result(), yaw.coefficients | surge.coefficients
        )
        tuned, wrong = self._plan.noise.tuned, inconsistency_of(residuals, self._plan.noise.tuned)
        warnings = _gate_warnings(residuals, tuned)
        disturbances, further = self._forces or self._observer, self._plan.noise.further
        middle = Middle(self._middle, self._plan.clock.count * self._plan.clock.dt_secs / 2)
        warnings += _excess_warnings(self._plan, disturbances.excess_share)
        return Findings(
            plan=self._plan,
            metadata=dict(log.metadata),
            residuals=residuals,
            disturbances=disturbances.result(),
            yaw=yaw,
            surge=surge,
            changes=changes,
            track_origin=self.tracker.origin,
            warnings=(*self._plan.warnings, *warnings, *map(str, changes)),
            events=log.events,
            sensor_errors=slow_states(
                SENSOR_WALKS, further.sensors, self._plan.omitted_sensors, self._last, middle, wrong
            ),
            current=current_of(self._last, wrong),
            wind=slow_states(
                wind_walks(self._plan.vessel.paper_coefficients, self._plan.stats),
                further.wind,
                self._plan.undetermined_wind,
                self._last,
                middle,
                wrong or (WIND_IN_MODEL if self._plan.model_is_fitted else ""),
            ),
        )

    def _disturbance(
        self, held: Signals, following: Mapping[str, float], estimates: Estimates
    ) -> Disturbance:
        """Take the disturbance from the filter, or estimate it by the observer."""
        if estimates.further is not None:
            self._last = _values_at(estimates.further, -1)
            middle = self._plan.clock.count // 2 - held.first
            if 0 <= middle < len(held):
                self._middle = _values_at(estimates.further, middle)
        if self._forces is not None:
            return self._forces.step(held, estimates)
        corrected = without_sensor_errors(without_rejected(held, estimates), estimates)
        disturbance = self._observer.step(corrected, following)
        if self._unchecked and not disturbance.is_finite:
            self._unchecked = False
            require_settings_of_observer(self._plan)
        return disturbance

    def _estimates(
        self, held: Signals, following: Mapping[str, float], adjoints: Iterator[Adjoint] | None
    ) -> Estimates:
        """Filter the next chunk, and smooth it where there are `adjoints`."""
        try:
            if adjoints is None:
                estimates = self._filter.step(held, following)
            else:
                filter_ = smoothable(self._filter)
                estimates = smooth_chunk(filter_, held, following, adjoints)
        except np.linalg.LinAlgError as error:  # of a gain that is designed anew at each instant
            raise diverged(self._plan, f" ({error})") from error
        if not np.all(np.isfinite(estimates.states)):
            raise diverged(self._plan)
        return estimates


def _values_at(further: FurtherStates, instant: int) -> dict[str, tuple[float, float]]:
    """Return value and standard deviation of each further estimate at an instant, by name."""
    rows = zip(further.values[instant], further.stds[instant], strict=True)
    pairs = [(float(value), float(std)) for value, std in rows]
    return dict(zip(further.names, pairs, strict=True))


def _gate_warnings(residuals: Sequence[ResidualSummary], tuned: tuple[bool, bool]) -> list[str]:
    """Warn of each output of which the gate rejected more than spikes explain."""
    others = "separate waves (filter.wave), or widen filter.gate"
    warnings = (
        residual.gate_warning(f"{noise_remedy(residual.name, tuned)}, {others}")
        for residual in residuals
    )
    return [warning for warning in warnings if warning]


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


def _further_residual_test(plan: Plan, output: str) -> ResidualTest:
    """Set up the test of the innovations of the heading, or of the position north or east."""
    values = plan.stats.head[output]
    steps = np.diff(np.flatnonzero(np.isfinite(values)))
    is_heading = output == FURTHER_OUTPUTS[0]
    stated = plan.vessel.filter.heading_std if is_heading else plan.vessel.filter.position_std
    return ResidualTest(
        "heading" if is_heading else output,
        "rad" if is_heading else "m",
        float(np.median(steps)) if len(steps) else 1.0,
        plan.clock.dt_secs,
        noise_measured=stated is None,
        noise_is_bound=stated is None,  # it contains the slow errors of the sensor
        constant=bool(np.ptp(values[np.isfinite(values)]) == 0),
    )
