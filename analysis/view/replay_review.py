"""The review of a replay in Rerun: its series, tracks, events and text."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256

import numpy as np
import rerun as rr

from analysis.filters.base import OUTPUT_STATES
from analysis.manoeuvres.manoeuvre_spans import ManoeuvreSpan, manoeuvre_spans
from analysis.replay.plan import Plan
from analysis.replay.replay_results import Analysis, Findings, ReplayChunk
from analysis.trial.thinned_signals import SEARCHED, ThinnedSignals
from shiplog.printable import printable
from shiplog.ships.paper import PAPER_OUTPUTS
from shiplog.types import Event, EventLevel, Log

from .further_channels import FurtherChannels
from .manoeuvre_sheets import (
    MAX_NAMED,
    ManoeuvreSheet,
    manoeuvre_events,
    manoeuvre_sheet,
    with_executes,
    with_manoeuvres,
)
from .motion_panels import MotionHistory
from .replay_layout import ReplayPage, replay_blueprint
from .replay_panels import equation_panels, history_panels, trial_panels
from .rerun_io import (
    save_recording,
    send_chart,
    send_events,
    send_points,
    send_style,
    send_text,
)
from .review_tabs import SUMMARY, TRACK, track_origin
from .sensor_panels import sensor_panels
from .series import Series
from .series_builder import SeriesBuilder
from .track_chart import draw_track

ESTIMATES = dict(zip(PAPER_OUTPUTS, OUTPUT_STATES, strict=True))  # states, by output


class ReplayReview:
    """A review drawn while the chunks of a replay come; made by `open_replay_review`."""

    def __init__(self, plan: Plan, recording: rr.RecordingStream, *, full: bool) -> None:
        self._recording, self._full = recording, full
        self._start_ns = plan.clock.start_ns
        self._builder = SeriesBuilder(plan.clock, plan.stats)
        names = (*SEARCHED, *map(_estimate_name, ESTIMATES))
        self._thinned = ThinnedSignals(plan.clock.count, plan.clock.dt_secs, names)
        self._dense: set[str] = set()  # entities sent with every sample
        self._further = FurtherChannels(plan.screening, plan.clock, full=full)

    def add(self, chunk: ReplayChunk) -> None:
        """Draw the next chunk."""
        dense = self._builder.add(chunk)
        states = chunk.estimates.states
        estimates = {_estimate_name(name): states[:, i] for name, i in ESTIMATES.items()}
        self._thinned.add(chunk.signals.first, {**chunk.signals.values, **estimates})
        if self._full:
            self._dense.update(dense)
            for entity, series in dense.items():
                send_points(self._recording, entity, series, self._start_ns)

    def add_further_channels(self, log: Log) -> None:
        """Draw the channels that the replay does not use: a pass over the log if it has any.

        Parameters
        ----------
        log
            The log as recorded, as it was given to `plan_replay`.
        """
        if self._further:
            for chunk in log.chunks():
                self._further.add(chunk)

    def finish(self, findings: Findings, text: str) -> None:
        """Draw what is known only at the end.

        Parameters
        ----------
        findings
            The findings of the replay.
        text
            The page of text, in Markdown.
        """
        recording, start_ns = self._recording, self._start_ns
        drawn, spans = self._builder.result(), manoeuvre_spans(self._thinned.trial_signals())
        sheets = _manoeuvre_sheets(findings, drawn, spans, self._thinned)
        steering, *others = trial_panels(drawn)
        page = ReplayPage(
            motion=[with_executes(steering, spans, legend=len(spans) <= MAX_NAMED), *others],
            chart=with_manoeuvres(draw_track(findings, drawn), spans),
            has_events=bool(spans or findings.events or findings.changes),
            manoeuvres=sheets,
            equations=equation_panels(findings, drawn),
            coefficients=history_panels(findings, drawn),
            sensors=sensor_panels(findings, drawn),
            further=self._further.panels(),
            duration_secs=(findings.plan.clock.count - 1) * findings.plan.clock.dt_secs,
        )
        rr.send_blueprint(replay_blueprint(page), recording=recording)
        _send_properties(recording, findings)
        send_text(recording, SUMMARY, text)
        for panel in page.panels():
            for series in panel.series:
                entity = f"{panel.name}/{series.name}"
                send_style(recording, entity, series)
                if entity not in self._dense:
                    send_points(recording, entity, series, start_ns)
        charts = {TRACK: page.chart} | {track_origin(each.origin): each.chart for each in sheets}
        for origin, chart in charts.items():
            if chart is not None:
                send_chart(recording, origin, chart, start_ns)
        if page.has_events:
            send_events(recording, "events", _all_events(findings, spans, start_ns), start_ns)


def _estimate_name(output: str) -> str:
    return f"{output}_estimate"


def _manoeuvre_sheets(
    findings: Findings,
    drawn: Mapping[str, Series],
    spans: Sequence[ManoeuvreSpan],
    thinned: ThinnedSignals,
) -> list[ManoeuvreSheet]:
    """Return the sheet of each manoeuvre, measured and estimated."""
    values = thinned.values()
    history = MotionHistory(
        thinned.time_secs,
        values["rudder"],
        values["rpm"],
        {name: values[name] for name in ("heading", *PAPER_OUTPUTS)},
        {name: values[_estimate_name(name)] for name in PAPER_OUTPUTS},
        "estimated",
    )
    length = findings.plan.vessel.length
    return [
        manoeuvre_sheet(span, history, [drawn["track"]], length, f"manoeuvre_{span.number}")
        for span in spans
    ]


@contextmanager
def open_replay_review(
    plan: Plan, path: str | os.PathLike[str], *, full: bool = False
) -> Iterator[ReplayReview]:
    """Open a review, which becomes an .rrd file once it is finished.

    Parameters
    ----------
    plan
        The plan of the replay.
    path
        The file to write.
    full
        Whether to keep every sample; by default the series of a long trial are decimated to what a
        screen can show, with every extreme kept.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to.
    """
    recording = _recording(plan)
    with save_recording(recording, path):
        yield ReplayReview(plan, recording, full=full)


def write_replay_review(
    analysis: Analysis,
    path: str | os.PathLike[str],
    *,
    text: str,
    full: bool = False,
    log: Log | None = None,
) -> None:
    """Write the review of an analysis to an .rrd file; see `open_replay_review`.

    The channels that the replay did not use are drawn where the log is given.
    """
    with open_replay_review(analysis.findings.plan, path, full=full) as review:
        review.add(analysis.as_chunk())
        if log is not None:
            review.add_further_channels(log)
        review.finish(analysis.findings, text)


def _recording(plan: Plan) -> rr.RecordingStream:
    """Return a stream whose names depend only on the log, the model and the noise.

    Each log is an application of its own to Rerun, which shares one layout among the recordings
    of an application; the axes of another ship would be wrong for this one.
    """
    name, stats, noise = plan.name, plan.stats, plan.noise
    identity = (name, plan.clock.start_ns, plan.clock.count, plan.vessel, stats.sample_counts)
    digest = sha256(repr(identity).encode())
    for array in (stats.std, noise.measurement_std, noise.process_ratio):
        digest.update(np.ascontiguousarray(array).tobytes())
    return rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog {name}"),
        recording_id=digest.hexdigest()[:32],
        send_properties=False,
    )


def _send_properties(recording: rr.RecordingStream, findings: Findings) -> None:
    """Send the recording's name, start and properties."""
    recording.send_recording_name(printable(findings.plan.name))
    rr.send_recording_start_time_nanos(findings.plan.clock.start_ns, recording=recording)
    trial = rr.AnyValues(
        vessel=findings.plan.vessel.name,
        model=findings.plan.model_origin,
        duration_secs=findings.plan.log_stats.duration_secs,
        dt_secs=findings.plan.clock.dt_secs,
        samples=findings.plan.clock.count,
        warnings=list(findings.warnings) or ["none"],
    )
    recording.send_property("trial", trial)


def _all_events(
    findings: Findings, spans: Sequence[ManoeuvreSpan], start_ns: int
) -> tuple[Event, ...]:
    """Return the events of the log, the manoeuvres, and changes of coefficients as warnings."""
    changes = (
        Event(start_ns + round(change.at_secs * 1e9), str(change), "replay", EventLevel.WARNING)
        for change in findings.changes
    )
    events = (*findings.events, *changes, *manoeuvre_events(spans, start_ns))
    return tuple(sorted(events, key=lambda event: event.time_ns))
