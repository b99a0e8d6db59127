"""Filters by their names, and signals filtered in one call."""

from analysis.signals.hold import last_inputs
from analysis.signals.signal_stats import SignalStats, signal_stats
from shiplog.errors import ShiplogError
from shiplog.extensions import extension_names, load_extension
from shiplog.ships.paper import Coefficients
from shiplog.types import Signals
from shiplog.vessel.settings import FILTER_GROUP, FilterSettings

from .base import Estimates, Filter, FilterKind, SmoothableFilter
from .noise_model import NoiseModel
from .smoother import SmoothingPass, smooth_chunk, trace_chunk


def filter_names() -> tuple[str, ...]:
    """List the names of the installed filters, in alphabetical order, importing none.

    Examples
    --------
    >>> filter_names()
    ('extended', 'per-tick', 'pseudo-input', 'quality', 'steady-state')
    """
    return extension_names(FILTER_GROUP)


def filter_kind(name: str) -> FilterKind:
    """Load the filter of a name.

    Raises
    ------
    UsageError
        No installed package declares a filter of that name.
    ShiplogError
        The package that declares it cannot be imported; the message names it.

    Examples
    --------
    >>> filter_kind("extended").smoothable
    True
    """
    return load_extension(FILTER_GROUP, name, FilterKind, "filter")


def make_filter(
    model: Coefficients,
    noise: NoiseModel,
    stats: SignalStats,
    settings: FilterSettings,
    kind: FilterKind | None = None,
) -> Filter:
    """Make a filter at the start of a trial.

    Parameters
    ----------
    model
        The coefficients of the identification paper's model.
    noise
        The noise that the filter assumes.
    stats
        The statistics of the signals.
    settings
        The settings of ``[filter]``.
    kind
        The kind of filter; by default the one that `settings` names.

    Raises
    ------
    UsageError
        The filter cannot be designed for this model and noise.
    """
    return (kind or filter_kind(settings.chosen)).make(model, noise, stats, settings)


def smoothable(filter_: Filter) -> SmoothableFilter:
    """Return the same filter as one that can be smoothed; raise `ShiplogError` if it cannot."""
    if not isinstance(filter_, SmoothableFilter):
        raise ShiplogError(
            f"{type(filter_).__name__} is declared smoothable, but lacks trace or"
            " to_estimates; correct its FilterKind"
        )
    return filter_


def filter_states(
    signals: Signals, model: Coefficients, noise: NoiseModel, settings: FilterSettings | None = None
) -> Estimates:
    """Filter the signals of a whole trial, and smooth the states where the settings ask for it.

    Parameters
    ----------
    signals
        Yaw rate and speed, NaN where not measured, and the inputs, which must not be NaN.
    model
        The coefficients of the identification paper's model.
    noise
        The noise that the filter assumes.
    settings
        The settings of ``[filter]``; by default those of an empty section.
    """
    settings = settings or FilterSettings()
    stats = signal_stats(signals, model)
    filter_ = make_filter(model, noise, stats, settings)
    following = last_inputs(signals)
    if not settings.smooth:
        return filter_.step(signals, following)
    tracing = smoothable(filter_)
    first = SmoothingPass()
    trace_chunk(tracing, signals, following, first)
    again = smoothable(make_filter(model, noise, stats, settings))
    return smooth_chunk(again, signals, following, iter(first.result()))
