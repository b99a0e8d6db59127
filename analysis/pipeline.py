"""From a log to what it says: the order of the steps.

A log may be longer than memory: it is gone through three times in slabs. First it is surveyed,
then put on one clock to see what its signals usually do and to fit what is fitted to the whole of
it (a second time where that shows that the fit was begun on a wrong guess), and at last replayed.
Every stage takes slabs, gives slabs and carries its state; where the slabs are cut changes nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from shiplog import Channel, LogError, Signals, Vessel
from shiplog.clock import Clock, on_clock, set_clock
from shiplog.errors import UsageError
from shiplog.gyro_bias import GyroWatch
from shiplog.quality import faults
from shiplog.rudder_sign import RudderWatch
from shiplog.settings import FilterSettings
from shiplog.ship import INPUTS, OUTPUTS, Coefficients
from shiplog.survey import Survey, survey_log
from shiplog.types import FloatArray, Log
from shiplog.vessel import parse_vessel

from .disturbance import Course, Disturbance, ForceObserver
from .doubts import doubtful, silent_ends
from .first_model import BARE, fit_first_model
from .gauge import Gauge, Gauger
from .identification import Identification, Identifier
from .inputs import InputHold, held_throughout
from .kalman import OUTPUT_STATES, Estimates, Filter, Noise, noise_of
from .residuals import OutputResiduals, ResidualTest
from .sliding import History
from .stacking import stacked
from .track import Track, Tracker
from .weak_form import WeakForm

FITTED = "a first model, fitted to this log"
FEWEST = 4  # samples of an output: their third difference shows its noise
NEEDED = (*OUTPUTS, *INPUTS)
STEPS = ("check", "one clock", "model", "replay")

Tell = Callable[[str, float], None]  # the step, and the share of it that is done


@dataclass(frozen=True, eq=False)
class Slab:
    """What a replay says of a stretch of the trial; each part as far as it is known by then."""

    signals: Signals  # as measured, NaN where not
    estimates: Estimates
    disturbance: Disturbance
    yaw_history: History
    surge_history: History
    track: Track


@dataclass(frozen=True, eq=False)
class Plan:
    """What is known of a trial before it is replayed, from two passes over its log."""

    survey: Survey
    clock: Clock
    vessel: Vessel
    model_origin: str  # where the model came from, in words
    usual: Gauge
    noise: Noise
    warnings: tuple[str, ...]

    @property
    def name(self) -> str:
        """The log's."""
        return self.survey.name


@dataclass(frozen=True, eq=False)
class Findings(Plan):
    """What a replay comes to."""

    metadata: dict[str, str]  # of the log
    residuals: tuple[OutputResiduals, ...]  # of yaw rate and speed
    courses: dict[str, Course]  # of the disturbances
    yaw: Identification
    surge: Identification
    track_origin: str  # how the track is known, in words


@dataclass(frozen=True, eq=False)
class Analysis(Findings, Slab):
    """All that a replay found: what it comes to, and the whole trial in one slab."""


def analyse(
    log: Log, vessel: Vessel | None = None, *, on_step: Tell = lambda _step, _share: None
) -> Analysis:
    """Replay a log: check it, filter it, observe what disturbed it, identify the ship.

    The model is `vessel`'s, or the one the log carries, or else a first one fitted to the log.
    `on_step` is told each of `STEPS`, and the share of it that is done. For a log longer than
    memory use `Replay`. Raises `LogError` where the log lacks a needed channel or cannot be used
    as it is.
    """
    replay = Replay(log, vessel, on_step=on_step)
    whole = stacked(list(replay.slabs()))
    return Analysis(**vars(whole), **vars(replay.findings))


class Replay:
    """A replay in slabs: go through `slabs`, then ask for the `findings`.

    As `analyse`, except that no more than a slab is held. Its `plan` is made at once, from two
    passes over the log; the slabs are the third.
    """

    def __init__(
        self, log: Log, vessel: Vessel | None = None, *, on_step: Tell = lambda _step, _share: None
    ) -> None:
        self._log, self._tell = log, on_step
        self._warnings: list[str] = []
        survey, clock = self._surveyed()
        stated = _stated_model(log, vessel)
        usual, self._yaw, self._surge = self._gauged(survey, clock, stated[0] if stated else None)
        on_step("model", 0.0)
        vessel, origin = stated or (self._first_model(usual), FITTED)
        settings = _averaged(vessel.filter, survey, clock.dt_secs)
        noise = noise_of(usual, vessel.coefficients, settings)
        self.plan = Plan(survey, clock, vessel, origin, usual, noise, tuple(self._warnings))
        self._begun = False
        self._findings: Findings | None = None

    def slabs(self) -> Iterator[Slab]:
        """Replay the trial, once.

        Raises `LogError` where the model does not fit it at all.
        """
        if self._begun:
            raise ValueError("the slabs of a replay come once; make another")
        self._begun = True
        plan, clock, fastest = self.plan, self.plan.clock, self.plan.usual.fastest
        holding, (filtering, observing) = InputHold(clock), self._designed()
        tests = [self._residual_test(output) for output in range(len(OUTPUTS))]
        weak_form = _weak_form(plan.vessel.coefficients, clock, plan.usual.intervals)
        tracking = Tracker(clock, plan.survey.get("position"))
        on_clock = self._on_clock("replay", clock, holding.add_raw, tracking.add_raw)
        for signals, held, following in held_throughout(on_clock, holding):
            estimates = filtering.step(held, following)
            if not np.all(np.isfinite(estimates.states)):
                raise self._runs_away()
            for i, test in enumerate(tests):
                test.add(estimates.innovations[:, i], estimates.innovation_stds[:, i])
            disturbance = observing.step(held, following)
            yaw_rows, surge_rows = weak_form.step(signals, fastest)
            yaw, surge = self._yaw.step(yaw_rows), self._surge.step(surge_rows)
            track = tracking.step(signals, *(estimates.states[:, i] for i in OUTPUT_STATES))
            yield Slab(signals, estimates, disturbance, yaw, surge, track)
        self._findings = Findings(
            **vars(plan),
            metadata=dict(self._log.metadata),
            residuals=tuple(test.result() for test in tests),
            courses=observing.result(),
            yaw=self._yaw.result(),
            surge=self._surge.result(),
            track_origin=tracking.origin,
        )

    @property
    def findings(self) -> Findings:
        """What the replay came to. Raises `ValueError` before its slabs were gone through."""
        if self._findings is None:
            raise ValueError("go through the slabs first")
        return self._findings

    def _surveyed(self) -> tuple[Survey, Clock]:
        """The first time through the log."""
        self._tell("check", 0.0)
        found = survey_log(self._log, strict=True)
        lacking = [name for name in NEEDED if name not in found]
        if lacking:
            has = ", ".join(sorted({channel.name for channel in found}))
            raise LogError(
                f"no channel {lacking[0]!r} in {found.name}; it has {has or 'none'}; "
                f"a replay needs {', '.join(NEEDED)}"
            )
        also = tuple(name for name in ("heading", "position") if name in found)
        self._warnings += [*self._log.warnings, *faults(found, (*NEEDED, *also))]
        return found, set_clock(self._log, found, channels=NEEDED, optional=("heading",))

    def _gauged(
        self, found: Survey, clock: Clock, vessel: Vessel | None
    ) -> tuple[Gauge, Identifier, Identifier]:
        """The second time: what is usual, and the whole trial's yaw and surge equations.

        For these one must know how far apart samples stand on the clock, which is only told by
        then. It is nearly always what the survey lets expect; where not, they are made once more.
        """
        alphas = vessel.coefficients if vessel else BARE
        doubts = RudderWatch(found), GyroWatch(found)
        holding, gauger = InputHold(clock), Gauger(alphas)
        expected = [clock.channels[name].usual_known_secs / clock.dt_secs for name in OUTPUTS]
        equations = _Equations(alphas, clock, np.maximum(np.round(expected), 1.0))
        watches = holding.add_raw, *(doubt.add for doubt in doubts)
        for signals in self._on_clock("one clock", clock, *watches):
            gauger.add(holding.step(signals))
            equations.add(signals, gauger.fastest)
        usual = gauger.result()
        if not np.array_equal(usual.intervals, equations.intervals):
            equations = _Equations(alphas, clock, usual.intervals)
            for signals in self._on_clock("one clock", clock):
                equations.add(signals, usual.fastest)
        _require_outputs(self._log, usual)
        self._warnings += doubtful(found, NEEDED)
        self._warnings += [said for doubt in doubts if (said := doubt.result())]
        self._warnings += [*silent_ends(found, clock, NEEDED), *holding.said()]
        return usual, equations.yaw, equations.surge

    def _first_model(self, usual: Gauge) -> Vessel:
        vessel = fit_first_model(self._yaw, self._surge, usual, self._log.name)
        model = vessel.coefficients
        if not (model.a < 0 and model.g <= 0 and model.h >= 0):
            self._warnings.append(
                "the model fitted to this log is no ship's: too little moves in it to tell"
            )
        return vessel

    def _on_clock(
        self, step: str, clock: Clock, *watches: Callable[[tuple[Channel, ...]], None]
    ) -> Iterator[Signals]:
        """The signals; each slab of the log is shown to the watches before it is placed."""

        def watched() -> Iterator[tuple[Channel, ...]]:
            for slab in self._log.slabs():
                for watch in watches:
                    watch(slab)
                yield slab

        self._tell(step, 0.0)
        for signals in on_clock(watched(), clock):
            yield signals
            self._tell(step, (signals.first + len(signals)) / clock.count)

    def _designed(self) -> tuple[Filter, ForceObserver]:
        """The filter and the observer; of a model that runs away neither may be had."""
        model, noise, usual = self.plan.vessel.coefficients, self.plan.noise, self.plan.usual
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                return Filter(model, noise, usual), ForceObserver(model, noise, usual)
        except (UsageError, np.linalg.LinAlgError) as error:
            raise self._runs_away() from error

    def _residual_test(self, output: int) -> ResidualTest:
        name, plan = OUTPUTS[output], self.plan
        interval = float(plan.usual.intervals[output])
        unit, noise_measured = plan.survey[name].unit, plan.noise.measured[output]
        return ResidualTest(name, unit, interval, noise_measured=noise_measured)

    def _runs_away(self) -> LogError:
        return LogError(
            f"the filter runs away: the model does not fit this log ({self.plan.model_origin}); "
            f"give the ship's own with --vessel: {self._log.name}"
        )


class _Equations:
    """The whole trial's equations of yaw and surge, from signals in slabs."""

    def __init__(self, alphas: Coefficients, clock: Clock, intervals: FloatArray) -> None:
        self.intervals = intervals
        self._weak_form = _weak_form(alphas, clock, intervals)
        count = self._weak_form.row_count
        self.yaw = Identifier(self._weak_form.yaw, count, constant=True)
        self.surge = Identifier(self._weak_form.surge, count)

    def add(self, signals: Signals, fastest: float) -> None:
        """Take the next signals; `fastest` is the greatest speed so far, m/s."""
        yaw_rows, surge_rows = self._weak_form.step(signals, fastest)
        self.yaw.add(yaw_rows)
        self.surge.add(surge_rows)


def _weak_form(model: Coefficients, clock: Clock, intervals: FloatArray) -> WeakForm:
    """The inputs are known at every instant, but for their gaps."""
    return WeakForm(model, clock.count, clock.dt_secs, (*intervals.tolist(), 1.0, 1.0))


def _stated_model(log: Log, given: Vessel | None) -> tuple[Vessel, str] | None:
    if given is not None:
        return given, "given"
    if log.vessel_toml is not None:
        return parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}"), "carried by the log"
    return None


def _require_outputs(log: Log, usual: Gauge) -> None:
    for name, count in zip(OUTPUTS, usual.measured, strict=True):
        if count < FEWEST:
            raise LogError(
                f"channel {name!r} has {count} samples while the others are there too, "
                f"and {FEWEST} are needed; check the recorder or choose another log: {log.name}"
            )


def _averaged(settings: FilterSettings, found: Survey, dt_secs: float) -> FilterSettings:
    """The noise stated for one sample, as it is in the mean of those that share an instant."""
    stds = []
    for name, std in zip(OUTPUTS, (settings.yaw_rate_std, settings.speed_std), strict=True):
        together = max(1.0, dt_secs / found[name].usual_secs)
        stds.append(None if std is None else std / sqrt(together))
    return replace(settings, yaw_rate_std=stds[0], speed_std=stds[1])
