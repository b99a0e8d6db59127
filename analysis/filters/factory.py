"""The filters by their names, and a trial filtered that is all there."""

from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.ships.paper import Coefficients
from shiplog.types import Signals
from shiplog.vessel.settings import FilterSettings

from .base import Estimates, Filter
from .noise_model import NoiseModel
from .pseudo_input import PseudoInputFilter
from .smoother import SmoothingPass, smoothed
from .three_state import ThreeStateFilter


def make_filter(
    model: Coefficients, noise: NoiseModel, stats: SignalStats, settings: FilterSettings
) -> Filter:
    """The filter chosen, at the trial's start. Raises `UsageError` where it cannot be designed."""
    kind = PseudoInputFilter if settings.chosen == "pseudo-input" else ThreeStateFilter
    return kind(model, noise, stats, settings)


def filter_states(
    signals: Signals, model: Coefficients, noise: NoiseModel, settings: FilterSettings | None = None
) -> Estimates:
    """Filter, and smooth if it is asked for, signals that are all there, their inputs known."""
    settings = settings or FilterSettings()
    filtering = make_filter(model, noise, signal_stats(signals, model), settings)
    following = last_inputs(signals)
    if not settings.smooth:
        return filtering.step(signals, following)
    estimates, trace = filtering.trace(signals, following)
    going = SmoothingPass(filtering.outputs)
    going.add(trace)
    (end,) = going.result()
    return smoothed(filtering, signals, following, estimates, trace, end)
