"""What is known of a trial before it is replayed, from two passes over its log.

First it is surveyed; then it is put on one clock to see what its signals usually do, and to fit
what is fitted to the whole of it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from analysis.disturbance.observer import blindness
from analysis.filters.noise_model import NoiseModel
from analysis.filters.tuning import noise_of, wave_in
from analysis.regression.coefficients import Identifier
from analysis.regression.first_model import BARE, fit_first_model
from analysis.regression.sliding import least_window_secs
from analysis.regression.weak_form import WeakForm
from analysis.signals.hold import InputHold
from analysis.signals.signal_stats import SignalStats, SignalStatsCollector
from shiplog import Channel, LogError, Signals, Vessel
from shiplog.checks.channel_stats import LogStats, compute_log_stats
from shiplog.checks.data_quality import faults
from shiplog.checks.gyro_bias import GyroBiasCheck
from shiplog.checks.rudder_sign import RudderSignCheck
from shiplog.progress import ProgressCallback
from shiplog.resampling import Clock, choose_clock, resample_chunks
from shiplog.ships.paper import PAPER_INPUTS, PAPER_OUTPUTS, Coefficients
from shiplog.types import FloatArray, Log
from shiplog.vessel.settings import SHORTEST_WINDOW_SECS, DisturbanceSettings, FilterSettings
from shiplog.vessel.vessel import idle, parse_vessel, with_settings

from .channel_warnings import doubtful, silent_ends

FITTED = "a first model, fitted to this log"
FEWEST = 4  # samples of an output: their third difference shows its noise
OF_WINDOWS = ("yaw", "surge")
NEEDED = (*PAPER_OUTPUTS, *PAPER_INPUTS)
USUAL_SEA = 0.6  # rad/s, where no wave shows


@dataclass(frozen=True, eq=False)
class Plan:
    """What is known of a trial before it is replayed."""

    log_stats: LogStats
    clock: Clock
    vessel: Vessel
    model_origin: str  # where the model came from, in words
    stats: SignalStats
    noise: NoiseModel
    observed: DisturbanceSettings  # the vessel's, with what the log tells of a wave
    warnings: tuple[str, ...]

    @property
    def name(self) -> str:
        """The log's."""
        return self.log_stats.name


class Planner:
    """Goes through a log twice; `yaw` and `surge` then know the whole trial's equations."""

    def __init__(
        self,
        log: Log,
        vessel: Vessel | None,
        settings: Mapping[str, object],
        tell: ProgressCallback,
    ) -> None:
        self._log, self._tell = log, tell
        self._warnings: list[str] = []
        vessel, origin = _stated_model(log, vessel, settings)
        log_stats, clock = self._log_stats_and_clock()
        stats, self.yaw, self.surge = self._signal_stats_and_equations(log_stats, clock, vessel)
        tell("model", 0.0)
        if vessel.coefficients is None:
            vessel, origin = self._with_first_model(vessel, stats), FITTED
        elif vessel.model is not None:
            self._warnings.append(
                f"filters are built on the paper's model: this is a replay by [yaw] and [surge] of "
                f"the vessel file, not by its {vessel.model.name}; what differs between the two "
                "counts as disturbance"
            )
        self._warnings += idle(vessel)
        noise = self._noise(vessel, log_stats, clock, stats)
        observed = self._observed(vessel, stats, noise)
        self.plan = Plan(
            log_stats, clock, vessel, origin, stats, noise, observed, tuple(self._warnings)
        )

    def _log_stats_and_clock(self) -> tuple[LogStats, Clock]:
        """The first time through the log."""
        self._tell("check", 0.0)
        found = compute_log_stats(self._log, strict=True)
        lacking = [name for name in NEEDED if name not in found]
        if lacking:
            has = ", ".join(sorted({channel.name for channel in found}))
            raise LogError(
                f"no channel {lacking[0]!r} in {found.name}; it has {has or 'none'}; "
                f"a replay needs {', '.join(NEEDED)}"
            )
        also = tuple(name for name in ("heading", "position") if name in found)
        self._warnings += [*self._log.warnings, *faults(found, (*NEEDED, *also))]
        return found, choose_clock(self._log, found, channels=NEEDED, optional=("heading",))

    def _signal_stats_and_equations(
        self, found: LogStats, clock: Clock, vessel: Vessel
    ) -> tuple[SignalStats, Identifier, Identifier]:
        """The second time: what is usual, and the whole trial's yaw and surge equations.

        For these one must know how far apart samples stand on the clock, which is only told by
        then. It is nearly always what the log_stats lets expect; where not, they are made once
        more.
        """
        alphas, window_secs = vessel.coefficients or BARE, vessel.identifier.window_secs
        doubts = RudderSignCheck(found), GyroBiasCheck(found)
        holding, collector = InputHold(clock), SignalStatsCollector(alphas)
        expected = [clock.channels[name].usual_known_secs / clock.dt_secs for name in PAPER_OUTPUTS]
        intervals = np.maximum(np.round(expected), 1.0)
        equations = _Equations(alphas, clock, intervals, window_secs)
        watches = holding.add_raw, *(doubt.add for doubt in doubts)
        for signals in signals_of(self._log, clock, self._tell, "one clock", *watches):
            collector.add(holding.step(signals))
            equations.add(signals, collector.fastest)
        stats = collector.result()
        if not np.array_equal(stats.intervals, equations.intervals):
            equations = _Equations(alphas, clock, stats.intervals, window_secs)
            for signals in signals_of(self._log, clock, self._tell, "one clock"):
                equations.add(signals, stats.fastest)
        _require_outputs(self._log, stats)
        self._warnings += doubtful(found, NEEDED)
        self._warnings += [said for doubt in doubts if (said := doubt.result())]
        self._warnings += [*silent_ends(found, clock, NEEDED), *holding.said()]
        self._warnings += equations.said()
        return stats, equations.yaw, equations.surge

    def _with_first_model(self, known: Vessel, stats: SignalStats) -> Vessel:
        """What is known of a ship, with a model fitted to this log."""
        first = fit_first_model(self.yaw, self.surge, stats, self._log.name)
        vessel, model = replace(known, coefficients=first.coefficients), first.paper
        if known.model is None:
            vessel = replace(vessel, name=first.name, approach_rpm=first.approach_rpm)
        else:
            self._warnings.append(
                f"the vessel file has {known.model.name} alone, and filters are built on the "
                "paper's model: a first one is fitted to this log"
            )
        if not (model.a < 0 and model.g <= 0 and model.h >= 0):
            self._warnings.append(
                "the model fitted to this log is no ship's: too little moves in it to tell"
            )
        return vessel

    def _noise(
        self, vessel: Vessel, found: LogStats, clock: Clock, stats: SignalStats
    ) -> NoiseModel:
        settings = _averaged(vessel.filter, found, clock.dt_secs)
        noise = noise_of(stats, vessel.paper, settings)
        if settings.wave and noise.wave is None:
            self._warnings.append(
                "no wave stands out of the yaw rate's residual: none is told from the ship's "
                "turning; if there is one state filter.wave_frequency, filter.wave_damping and "
                "filter.wave_std"
            )
        if noise.wave is not None and noise.wave.evidence < 0:
            self._warnings.append(
                "the wave stated is less likely than none: the yaw rate's residual has no such peak"
            )
        return noise

    def _observed(
        self, vessel: Vessel, stats: SignalStats, noise: NoiseModel
    ) -> DisturbanceSettings:
        """What shall be observed, with the frequency of a wave if the file does not state it."""
        wanted = vessel.disturbance
        if "wave" not in wanted.models:
            return wanted
        frequency = wanted.wave_frequency or vessel.filter.wave_frequency
        if frequency is None:
            wave = noise.wave or wave_in(stats, vessel.paper, noise, vessel.filter)
            frequency = wave.frequency if wave is not None and wave.stands_out else None
        if frequency is None:
            frequency = USUAL_SEA
            self._warnings.append(
                f"no wave stands out of the yaw rate's residual: one of {USUAL_SEA:g} rad/s is"
                " observed, where the sea often is; state disturbance.wave_frequency"
            )
        self._warnings += blindness(frequency, stats)
        return replace(wanted, wave_frequency=frequency)


def signals_of(
    log: Log,
    clock: Clock,
    tell: ProgressCallback,
    step: str,
    *watches: Callable[[tuple[Channel, ...]], None],
) -> Iterator[Signals]:
    """A log on its clock; each chunk of it is shown to the watches before it is placed."""

    def watched() -> Iterator[tuple[Channel, ...]]:
        for chunk in log.chunks():
            for watch in watches:
                watch(chunk)
            yield chunk

    tell(step, 0.0)
    for signals in resample_chunks(watched(), clock):
        yield signals
        tell(step, (signals.first + len(signals)) / clock.count)


class _Equations:
    """The whole trial's equations of yaw and surge, from signals in chunks."""

    def __init__(
        self, alphas: Coefficients, clock: Clock, intervals: FloatArray, window_secs: float
    ) -> None:
        self.intervals, self._window_secs = intervals, window_secs
        self._log_secs = clock.count * clock.dt_secs
        self._weak_form = weak_form_of(alphas, clock, intervals)
        count = self._weak_form.row_count
        self.yaw = Identifier(self._weak_form.yaw, count, constant=True, window_secs=window_secs)
        self.surge = Identifier(self._weak_form.surge, count, window_secs=window_secs)

    def add(self, signals: Signals, fastest: float) -> None:
        """Take the next signals; `fastest` is the greatest speed so far, m/s."""
        yaw_rows, surge_rows = self._weak_form.step(signals, fastest)
        self.yaw.add(yaw_rows)
        self.surge.add(surge_rows)

    def said(self) -> list[str]:
        """What is to be said of the windows, in words."""
        window = f"identifier.window_secs = {self._window_secs:g}"
        least = {name: least_window_secs(getattr(self._weak_form, name)) for name in OF_WINDOWS}
        if self._window_secs > self._log_secs:
            said = f"{window} is longer than the log ({self._log_secs:.0f} s): the whole of it is "
            room = self._log_secs > max(*least.values(), SHORTEST_WINDOW_SECS)
            shorter = "ask for shorter windows, or " if room else ""
            return [said + f"the one window; {shorter}give a longer log"]
        blind = [name for name, secs in least.items() if self._window_secs <= secs]
        if not blind:
            return []
        needed = max(least[name] for name in blind)
        said = f"{window} is too short to tell so many coefficients of {' and '.join(blind)}: its "
        return [said + f"windows are blank; ask for more than {needed:.0f} s"]


def weak_form_of(model: Coefficients, clock: Clock, intervals: FloatArray) -> WeakForm:
    """The equations in integral form; the inputs are known at every instant, but for their gaps."""
    return WeakForm(model, clock.count, clock.dt_secs, (*intervals.tolist(), 1.0, 1.0))


def _stated_model(
    log: Log, given: Vessel | None, settings: Mapping[str, object]
) -> tuple[Vessel, str]:
    """What is known of the vessel, the settings given in place of her own, and where it is from."""
    if given is not None:
        return with_settings(given, settings), "given"
    if log.vessel_toml is not None:
        carried = parse_vessel(log.vessel_toml, f"vessel.toml in {log.name}")
        return with_settings(carried, settings), "carried by the log"
    return with_settings(Vessel("", None), settings), FITTED


def _require_outputs(log: Log, stats: SignalStats) -> None:
    for name, count in zip(PAPER_OUTPUTS, stats.measured, strict=True):
        if count < FEWEST:
            raise LogError(
                f"channel {name!r} has {count} samples while the others are there too, "
                f"and {FEWEST} are needed; check the recorder or choose another log: {log.name}"
            )


def _averaged(settings: FilterSettings, found: LogStats, dt_secs: float) -> FilterSettings:
    """The noise stated for one sample, as it is in the mean of those that share an instant."""
    stds = []
    for name, std in zip(PAPER_OUTPUTS, (settings.yaw_rate_std, settings.speed_std), strict=True):
        together = max(1.0, dt_secs / found[name].usual_secs)
        stds.append(None if std is None else std / sqrt(together))
    return replace(settings, yaw_rate_std=stds[0], speed_std=stds[1])
