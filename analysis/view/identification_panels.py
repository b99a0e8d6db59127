"""What is drawn of an identified ship: each run against the simulated one, and how it was found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.identification.comparison.history import ParameterHistory, run_secs
from analysis.identification.comparison.paper_scheme import PAPER_METHOD
from analysis.identification.comparison.parameter_ekf import EKF_METHOD
from analysis.identification.comparison.windows import WINDOW_METHOD
from analysis.identification.identify import IdentifiedShip
from analysis.identification.segment import Segment
from analysis.identification.validation import Validation
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.ships.paper import PAPER_INPUTS
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, conversion_factor

from .decimation import decimated
from .panels import Panel, limits, rounded, thousands
from .series import (
    BLUE,
    CYAN,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Colour,
    Line,
    Series,
    banded,
    measured_line,
)
from .track_chart import TrackChart, make_chart

COLOURS = dict(zip(MODEL_OUTPUTS, (BLUE, ORANGE, CYAN, GREEN), strict=True))
METHODS = {  # by what name, on top of those before it in the alphabet, and in which colour
    PAPER_METHOD: ("a_paper", RED),
    EKF_METHOD: ("kalman", BLUE),
    WINDOW_METHOD: ("windows", GREEN),
}
FAINT = 70  # of 255: how a course that echoes its prior is drawn
LAG_SECS, LAGS_SHARE = 300.0, 0.25  # up to which lag, and up to which share of a run
SIGMA_LIMIT = 2.0  # standard deviations


@dataclass(frozen=True, eq=False)
class RunSheet:
    """A run, measured and simulated: panels side by side, row by row."""

    title: str
    start_ns: int
    duration_secs: float
    outputs: tuple[Panel, ...]
    residuals: tuple[Panel, ...]
    inputs: tuple[Panel, ...]
    correlation: Panel
    lag_secs: float  # up to which the correlation goes
    track: TrackChart | None


def run_sheets(found: IdentifiedShip) -> Iterator[RunSheet]:
    """The runs that were fitted, then those held out."""
    fit, problem = found.fit, found.fit.problem
    for i, segment in enumerate(problem.segments):
        simulated = np.full((len(segment), len(MODEL_OUTPUTS)), np.nan)
        simulated[:, problem.columns] = problem.predicted(fit.minimum.unknowns, i)
        yield _sheet(f"run_{i + 1}", f"fitted: {segment.name}", segment, simulated, found, None)
    for k, validation in enumerate(found.validations):
        segment = validation.segment
        drawn = _track(validation, found.vessel.length if found.vessel else None)
        yield _sheet(
            f"held_out_{k + 1}",
            f"held out: {segment.name}",
            segment,
            validation.simulated,
            found,
            drawn,
        )


def _sheet(
    origin: str, title: str, segment: Segment, simulated: FloatArray, found: IdentifiedShip,
    track: TrackChart | None,
) -> RunSheet:  # fmt: skip
    shown = [
        name
        for i, name in enumerate(MODEL_OUTPUTS)
        if segment.has(name) and np.isfinite(simulated[:, i]).any()
    ]
    judged = [name for name in found.fit.problem.outputs if name in shown]
    normalised = {name: _normalised(segment, simulated, found, name) for name in judged}
    duration = (len(segment) - 1) * segment.dt_secs
    lag_secs = min(LAG_SECS, LAGS_SHARE * duration)
    return RunSheet(
        title, segment.signals.start_ns, duration,
        tuple(_output(origin, segment, simulated, name) for name in shown),
        tuple(_residual(origin, segment, name, values) for name, values in normalised.items()),
        tuple(_input(origin, segment, name) for name in PAPER_INPUTS),
        _correlation(origin, segment, normalised, lag_secs), lag_secs, track,
    )  # fmt: skip


def _output(origin: str, segment: Segment, simulated: FloatArray, name: str) -> Panel:
    column, unit, scale = MODEL_OUTPUTS.index(name), *_peoples(name)
    at, values = _samples(segment, segment.measured[:, column] * scale)
    measured = Series("measured", at, (Line("measured", values, GREY, 2.5),), spiky=True)
    line = Line("simulated", simulated[:, column] * scale, COLOURS[name], 1.5)
    drawn = Series("simulated", segment.signals.time_secs, (line,))
    return Panel(
        f"{origin}/{name}", f"{name.replace('_', ' ')} [{unit}]",
        (decimated(measured), decimated(drawn)), limits(values, line.values),
    )  # fmt: skip


def _samples(segment: Segment, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The times and the values of what was measured; a piece of a log begins within it."""
    at, known = measured_line(values, segment.dt_secs)
    return at + segment.signals.time_secs[0], known


def _peoples(name: str) -> tuple[str, float]:
    entry = CATALOGUE[name]
    return entry.display_unit, conversion_factor(entry.unit, entry.display_unit)


def _input(origin: str, segment: Segment, name: str) -> Panel:
    unit, scale = _peoples(name)
    values = segment.signals[name] * scale
    drawn = Series(
        "given", segment.signals.time_secs, (Line(name, values, GREEN, 1.5),), spiky=True
    )
    title = name if name == unit else f"{name} [{unit}]"
    return Panel(f"{origin}/{name}", title, (decimated(drawn),), limits(values))


def _normalised(
    segment: Segment, simulated: FloatArray, found: IdentifiedShip, name: str
) -> FloatArray:
    """Measured less simulated over what the fit leaves of it as a rule, (n,)."""
    column = MODEL_OUTPUTS.index(name)
    noise = found.fit.noises[found.fit.problem.outputs.index(name)]
    _, usual = noise.stds(simulated[:, column], segment.dt_secs)
    return np.asarray((segment.measured[:, column] - simulated[:, column]) / usual)


def _residual(origin: str, segment: Segment, name: str, normalised: FloatArray) -> Panel:
    at, values = _samples(segment, normalised)
    drawn = Series("normalised", at, (Line("residual", values, COLOURS[name]),), spiky=True)
    ends = segment.signals.time_secs[[0, -1]]
    return Panel(
        f"{origin}/residual_{name}", f"{name.replace('_', ' ')} residual [usual std]",
        (decimated(drawn), _guides(ends, SIGMA_LIMIT)),
        limits(values, np.array([-2.0, 2.0]) * SIGMA_LIMIT),
    )  # fmt: skip


def _guides(ends: FloatArray, bound: float) -> Series:
    lines = (Line(f"±{bound:.2g}", np.full(2, sign * bound), GREY) for sign in (1, -1))
    return Series("over", ends, tuple(lines))


def _correlation(
    origin: str, segment: Segment, normalised: dict[str, FloatArray], lag_secs: float
) -> Panel:
    """Autocorrelations over the lag; between the guides a white residual's would mostly be."""
    lags = np.arange(1, max(2, round(lag_secs / segment.dt_secs)))
    series: list[Series] = []
    counts: list[int] = []
    for name, values in normalised.items():
        found, count = autocorrelation(values, int(lags[-1]))
        line = Line(name.replace("_", " "), found[1:], COLOURS[name], 1.5)
        series.append(decimated(Series(name, lags * segment.dt_secs, (line,))))
        counts.append(count)
    bound = SIGMA_LIMIT / np.sqrt(max(min(counts, default=1), 1))
    series.append(_guides(np.array([0.0, lag_secs]), bound))
    histories = [line.values for drawn in series for line in drawn.lines]
    axis = limits(*histories, np.array([-0.2, 1.0]))
    title = "autocorrelation of the residuals over the lag; grey: ±2σ if they were white"
    return Panel(f"{origin}/correlation", title, tuple(series), axis)


def autocorrelation(values: FloatArray, most: int) -> tuple[FloatArray, int]:
    """Of values with gaps, (n,), at lags of 0 to `most` samples, and how many are known.

    Each lag by the pairs of which both are known; NaN where there are none. About zero, not about
    the mean: a residual that stays off is what is looked for.
    """
    known = np.isfinite(values)
    length = 1 << int(len(values) + most).bit_length()
    sums, pairs = (
        np.fft.irfft(np.abs(np.fft.rfft(x, length)) ** 2, length)[: most + 1]
        for x in (np.where(known, values, 0.0), known.astype(float))
    )
    pairs = np.round(pairs)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(pairs > 0, sums / pairs, np.nan)
        return mean / mean[0], int(known.sum())


def _track(validation: Validation, length: float | None) -> TrackChart | None:
    segment = validation.segment
    heading = (
        segment.measured[:, MODEL_OUTPUTS.index("heading")] if segment.has("heading") else None
    )
    if heading is not None:
        at = np.flatnonzero(np.isfinite(heading))
        heading = np.interp(np.arange(len(heading)), at, heading[at])
    return make_chart(
        "track, north up: grey as sailed, blue as simulated", validation.measured_track,
        segment.signals.time_secs, heading, length, validation.track,
    )  # fmt: skip


def parameter_panels(found: IdentifiedShip) -> list[Panel]:
    """Each coefficient that was sought: its value and interval, and the courses of all methods."""
    end = run_secs(found.fit.problem.segments)
    return [_coefficient(found, i, end) for i in range(len(found.uncertainty.names))]


def _coefficient(found: IdentifiedShip, i: int, end: float) -> Panel:
    told = found.uncertainty
    name, value, half = told.names[i], told.values[i], 1.96 * told.std[i]
    histories = [each for each in found.histories if name in each.names]
    priors = [each.priors[:, each.names.index(name)] for each in histories if len(each.priors) > 1]
    reach = max([float(np.ptp(each)) / 2 for each in priors], default=abs(value) / 3)
    unit = found.model.parameter(name).unit
    prefix, scale = ("", 1.0) if unit == "1" else thousands(abs(value))
    series = [_final(value * scale, half * scale, end, unidentifiable=name in told.unidentifiable)]
    for each in histories:
        series += _course(each, name, scale, limit=(value, 3 * reach))
    said = (
        "not identifiable" if name in told.unidentifiable else rounded(value * scale, half * scale)
    )
    axis = np.array([value - 1.4 * reach, value + 1.4 * reach]) * scale
    title = f"{name} {said}" + ("" if unit == "1" else f" [{prefix}{unit}]")
    return Panel(f"coefficient_{name}", title, tuple(series), limits(axis))


def _final(value: float, half: float, end: float, *, unidentifiable: bool) -> Series:
    """What output error says, with its interval; nothing where nothing is told."""
    shown = np.full(2, np.nan if unidentifiable else value)
    lines = banded("output error", shown, np.full(2, half), GREY)
    return Series("interval", np.array([0.0, end]), lines)


def _course(
    histories: ParameterHistory, name: str, scale: float, limit: tuple[float, float]
) -> Sequence[Series]:
    """One method's courses from its priors, faint where they echo; nothing beyond the limit."""
    i, (slug, colour) = histories.names.index(name), METHODS[histories.method]
    echoes = histories.mostly_prior[:, i]
    lines: list[Line] = []
    for values, stds in zip(histories.values[:, :, i], histories.stds[:, :, i], strict=True):
        seen = np.where(np.abs(values - limit[0]) > limit[1], np.nan, values) * scale
        pale: Colour = (*colour[:3], FAINT)
        lines.append(Line(f"{histories.method}, echoing", np.where(echoes, seen, np.nan), pale))
        sure = np.where(echoes, np.nan, seen)
        if len(histories.values) == 1:
            # a window less sure than the panel is high says nothing, and swings wildly
            sure = np.where(SIGMA_LIMIT * stds > limit[1] / 3, np.nan, sure)
            lines += banded(histories.method, sure, SIGMA_LIMIT * stds * scale, colour)
        else:
            lines.append(Line(histories.method, sure, colour, 1.5))
    return [decimated(Series(slug, histories.time_secs, tuple(lines)))]
