"""Sheets of the runs of an identified ship: measured against simulated, track, and residuals."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.identification.fit.drift import drift_is_unknown, without_sway
from analysis.identification.fit.segment import Segment
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.prediction import dead_reckoning
from analysis.identification.validation import filled_measurements, shifted_to
from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan, manoeuvre_spans
from analysis.report.identification_tables import fitted_run_tables, validation_tables
from analysis.report.markdown import markdown_tables
from analysis.trial.thinned_signals import SEARCHED, ThinnedSignals
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.types import FloatArray

from .manoeuvre_sheets import (
    COMPARED_TITLE,
    ManoeuvreSheet,
    manoeuvre_sheet,
    with_executes,
    with_manoeuvres,
)
from .motion_panels import MotionHistory, motion_panels
from .panels import Panel
from .residual_panels import residual_panels
from .series import GREY, Line, Series
from .track_chart import TrackChart, make_chart


@dataclass(frozen=True, eq=False)
class RunSheet:
    """What a tab shows of one run, measured and simulated.

    Attributes
    ----------
    title
        ``fitted`` or ``validation``, and the log's name.
    origin
        The beginning of the paths of its entities.
    start_ns
        The instant from which its times count, ns since 1970.
    start_secs, end_secs
        Of its time axis, s.
    motion
        Heading with rudder, yaw rate and speed, measured and simulated.
    chart
        The measured and the simulated track; None where no speed is measured.
    text
        Errors and manoeuvring indices, in Markdown.
    residuals
        A panel for each output that was fitted, and their autocorrelations over the lag.
    lag_secs
        The largest lag.
    manoeuvres
        Sheets of the manoeuvres of a run with several; a single one is the run.
    """

    title: str
    origin: str
    start_ns: int
    start_secs: float
    end_secs: float
    motion: tuple[Panel, ...]
    chart: TrackChart | None
    text: str
    residuals: tuple[Panel, ...]
    lag_secs: float
    manoeuvres: tuple[ManoeuvreSheet, ...]

    def panels(self) -> Iterator[Panel]:
        """Yield every panel."""
        yield from self.motion
        yield from self.residuals
        for sheet in self.manoeuvres:
            yield from sheet.panels

    def charts(self) -> Iterator[tuple[str, TrackChart]]:
        """Yield the track of the run and of each manoeuvre, with the origin of its sheet."""
        charts = [
            (self.origin, self.chart),
            *((each.origin, each.chart) for each in self.manoeuvres),
        ]
        yield from ((origin, chart) for origin, chart in charts if chart is not None)


@dataclass(frozen=True, eq=False)
class _Run:
    """A segment with its simulation, (n, 4), and both tracks, (n, 2) north and east, m.

    The prediction of what was measured has the biases and waves that were fitted, too.
    """

    title: str
    origin: str
    segment: Segment
    simulated: FloatArray
    predicted: FloatArray
    measured_track: FloatArray
    track: FloatArray
    text: str


def run_sheets(ship: IdentifiedShip) -> list[RunSheet]:
    """Return a sheet of each segment that was predicted, then of each that was fitted."""
    return [_sheet(ship, run) for run in (*_validations(ship), *_fitted(ship))]


def _validations(ship: IdentifiedShip) -> Iterator[_Run]:
    for k, each in enumerate(ship.validations):
        title = f"validation: {each.segment.name}"
        text = markdown_tables(validation_tables(ship, k))
        yield _Run(
            title, f"validation_{k + 1}", each.segment, each.simulated, each.simulated,
            each.measured_track, each.track, text,
        )  # fmt: skip


def _fitted(ship: IdentifiedShip) -> Iterator[_Run]:
    """Yield the fitted segments.

    A track is of the position fixes and of the simulation with the estimated current, or, without
    fixes, of heading and speed.
    """
    problem, unknowns = ship.fit.problem, ship.fit.minimum.unknowns
    for i, segment in enumerate(problem.segments):
        title, dt = f"fitted: {segment.name}", segment.dt_secs
        simulated = problem.simulated(unknowns, i)
        if drift_is_unknown(problem):
            simulated = without_sway(simulated)
        predicted = simulated.copy()
        for name, values in zip(problem.outputs, problem.predicted(unknowns, i).T, strict=True):
            if name in MODEL_OUTPUTS:
                predicted[:, MODEL_OUTPUTS.index(name)] = values
        measured_track = dead_reckoning(filled_measurements(segment, float(simulated[0, -1])), dt)
        track = dead_reckoning(simulated, dt)
        if problem.uses_positions and segment.fixes is not None:
            track += np.outer(np.arange(len(segment)) * dt, problem.own(unknowns, i).current)
            measured_track = shifted_to(segment.fixes, track)
        yield _Run(
            title,
            f"run_{i + 1}",
            segment,
            simulated,
            predicted,
            measured_track,
            track,
            markdown_tables(fitted_run_tables(ship, i)),
        )


def _sheet(ship: IdentifiedShip, run: _Run) -> RunSheet:
    segment = run.segment
    length = ship.vessel.length if ship.vessel else None
    spans, history = _spans(segment), _history(ship, run)
    reference = spans[0].approach_heading if spans else None
    first, *others = motion_panels(run.origin, history, reference)
    at = history.time_secs
    tracks = [_track_series(at, run.measured_track), _track_series(at, run.track)]
    residuals, lag_secs = residual_panels(ship, run.origin, segment, run.predicted)
    return RunSheet(
        title=run.title,
        origin=run.origin,
        start_ns=segment.signals.start_ns,
        start_secs=float(at[0]),
        end_secs=float(at[-1]),
        motion=(with_executes(first, spans), *others),
        chart=with_manoeuvres(_chart(run, length), spans),
        text=run.text,
        residuals=tuple(residuals),
        lag_secs=lag_secs,
        manoeuvres=_manoeuvre_sheets(run, spans, history, tracks, length),
    )


def _history(ship: IdentifiedShip, run: _Run) -> MotionHistory:
    """Return the motion of a run; what the model predicts is simulated."""
    segment, outputs = run.segment, {*ship.model.outputs, "heading"}
    if drift_is_unknown(ship.fit.problem):
        outputs -= {"sway"}
    columns = dict(enumerate(MODEL_OUTPUTS))
    return MotionHistory(
        segment.signals.time_secs,
        segment.signals["rudder"],
        segment.signals["rpm"],
        {name: segment.measured[:, i] for i, name in columns.items()},
        {name: run.predicted[:, i] for i, name in columns.items() if name in outputs},
    )


def _spans(segment: Segment) -> list[ManoeuvreSpan]:
    """Return the manoeuvres of a segment; their times are those of its signals."""
    signals = ThinnedSignals(len(segment), segment.dt_secs, SEARCHED)
    signals.add(0, segment.signals.values)
    start = float(segment.signals.time_secs[0])
    return [span.later(start) for span in manoeuvre_spans(signals.trial_signals())]


def _manoeuvre_sheets(
    run: _Run,
    spans: Sequence[ManoeuvreSpan],
    history: MotionHistory,
    tracks: Sequence[Series],
    length: float | None,
) -> tuple[ManoeuvreSheet, ...]:
    """Return the sheet of each manoeuvre where the run has several."""
    if len(spans) < 2:
        return ()
    return tuple(
        manoeuvre_sheet(span, history, tracks, length, f"{run.origin}/manoeuvre_{span.number}")
        for span in spans
    )


def _track_series(time_secs: FloatArray, track: FloatArray) -> Series:
    lines = (
        Line(name, values, GREY) for name, values in zip(("north", "east"), track.T, strict=True)
    )
    return Series("track", time_secs, tuple(lines))


def _chart(run: _Run, length: float | None) -> TrackChart | None:
    segment = run.segment
    heading = filled_measurements(segment)[:, MODEL_OUTPUTS.index("heading")]
    return make_chart(
        COMPARED_TITLE.format("track, north up"),
        run.measured_track,
        segment.signals.time_secs,
        heading if segment.has("heading") else None,
        length,
        run.track,
    )
