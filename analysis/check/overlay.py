"""A failed check in Rerun: the replay drawn over its reference."""

import os

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from analysis.view.rerun_io import WHOLE_RUN, save_recording
from shiplog.printable import printable
from shiplog.types import FloatArray, TimeArray

from .compare import Comparison

MAX_VIEWS = 9  # of the first channels to differ, which are where to look


def write_overlay(comparison: Comparison, path: str | os.PathLike[str]) -> None:
    """Write the channels that differ to an .rrd file, the reference grey, the replay red over it.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to.
    """
    recording = rr.RecordingStream("shiplog check", recording_id=comparison.name)
    with save_recording(recording, path):
        rr.send_blueprint(_blueprint(comparison), recording=recording)
        for difference in comparison.changed:
            for label, log, colour, width in (
                ("reference", comparison.reference, (150, 150, 150), 3.0),
                ("replay", comparison.replay, (200, 40, 40), 1.5),
            ):
                channel = log.get(difference.topic) if log else None
                if channel is not None and len(channel):
                    entity = f"{difference.topic}/{label}"
                    style = rr.SeriesLines(names=label, colors=colour, widths=width)
                    recording.log(entity, style, static=True)
                    _send(recording, entity, channel.measured_ns, channel.values)


def _send(
    recording: rr.RecordingStream, entity: str, stamps_ns: TimeArray, values: FloatArray
) -> None:
    """Send the finite values of a channel on the timeline of its times of measurement."""
    known = np.isfinite(values)
    time = rr.TimeColumn("stamp", timestamp=stamps_ns[known].astype("M8[ns]"))
    recording.send_columns(entity, [time], rr.Scalars.columns(scalars=values[known]))


def _blueprint(comparison: Comparison) -> rrb.Blueprint:
    views = [
        rrb.TimeSeriesView(
            name=printable(f"{difference.topic} [{difference.unit}]"),
            origin=difference.topic,
            axis_x=WHOLE_RUN,
        )
        for difference in comparison.changed[:MAX_VIEWS]
    ]
    panel = rrb.TimePanel(state="collapsed", timeline="stamp", play_state="Paused")
    return rrb.Blueprint(rrb.Grid(*views), panel, auto_views=False, auto_layout=False)
