"""Review of the estimation of a linear system in Rerun: outputs, inputs, estimates, innovations."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from analysis.linear.estimate import EstimateChunk
from analysis.linear.estimate_plan import EstimatePlan
from analysis.report.display import BAND_STDS
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.types import FloatArray

from .decimation import Decimator, bucket_size
from .panels import Panel, limits, title_of, words
from .rerun_io import (
    make_blueprint,
    plot_view,
    save_recording,
    send_points,
    send_style,
    send_text,
)
from .series import (
    BLUE,
    CYAN,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Line,
    MeasuredSamples,
    Series,
    banded,
)

COLOURS = {"state": BLUE, "disturbance": RED, "noise": CYAN}
LEGEND = """
## Legend

- **grey**: measured; in panels of innovations, ±2σ
- **blue**: predicted outputs, and estimated states with ±2σ
- **red**: disturbances with ±2σ
- **cyan**: coloured noise with ±2σ
- **green**: inputs as recorded; **orange**: as the regulator commands
"""


class EstimateReview:
    """A review drawn while the chunks of an estimation come; made by `open_estimate_review`."""

    def __init__(self, plan: EstimatePlan, recording: rr.RecordingStream) -> None:
        self._plan, self._recording = plan, recording
        self._series: dict[str, Decimator] = {}
        gaps = [
            gap_threshold_secs(float(secs)) / plan.clock.dt_secs for secs in plan.model.intervals
        ]
        self._samples = [MeasuredSamples(gap) for gap in gaps]

    def add(self, chunk: EstimateChunk) -> None:
        """Draw the next chunk."""
        plan, dt = self._plan, self._plan.clock.dt_secs
        at = (chunk.first + np.arange(len(chunk.values))) * dt
        for j, (output, samples) in enumerate(zip(plan.outputs, self._samples, strict=True)):
            normalised = chunk.innovations[:, j] / chunk.innovation_stds[:, j]
            columns = (chunk.measured[:, j], chunk.predicted[:, j], normalised)
            rows, (measured, predicted, normalised) = _sampled(samples, chunk.first, columns)
            name = _entity("output", output.binding.name)
            lines = Line("measured", measured, GREY, 2.5), Line("predicted", predicted, BLUE)
            self._add(f"{name}/outputs", Series("outputs", rows * dt, lines))
            line = Line("innovation / σ", normalised, BLUE)
            entity = f"{_entity('innovation', output.binding.name)}/normalised"
            self._add(entity, Series("normalised", rows * dt, (line,), spiky=True))
        for k, quantity in enumerate(plan.quantities):
            half_width = BAND_STDS * chunk.stds[:, k]
            colour = COLOURS[quantity.kind]
            band = banded("estimate", chunk.values[:, k], half_width, colour)
            self._add(
                f"{_entity(quantity.kind, quantity.name)}/estimate", Series("estimate", at, band)
            )
        for j, signal in enumerate(plan.inputs):
            inputs = [Line("recorded", chunk.inputs[:, j], GREEN, 1.5)]
            if chunk.commanded.size:
                inputs.append(Line("commanded", chunk.commanded[:, j], ORANGE))
            self._add(
                f"{_entity('input', signal.binding.name)}/inputs",
                Series("inputs", at, tuple(inputs)),
            )

    def finish(self, text: str) -> None:
        """Draw what is known only at the end; `text` is the page in Markdown."""
        series = {entity: decimator.result() for entity, decimator in self._series.items()}
        outputs, estimates, innovations = self._panels(series)
        page = rrb.Horizontal(
            rrb.Vertical(*map(plot_view, outputs)),
            rrb.Vertical(*map(plot_view, estimates)),
            rrb.Vertical(
                rrb.TextDocumentView(origin="summary", name="summary"),
                *map(plot_view, innovations),
                row_shares=[2, *[1] * len(innovations)],
            ),
            name="estimate",
        )
        rr.send_blueprint(make_blueprint(page), recording=self._recording)
        self._recording.send_recording_name(f"{self._plan.system.name}: {self._plan.name}")
        send_text(self._recording, "summary", text + LEGEND)
        for panel in (*outputs, *estimates, *innovations):
            for each in panel.series:
                entity = f"{panel.name}/{each.name}"
                send_style(self._recording, entity, each)
                send_points(self._recording, entity, each, self._plan.clock.start_ns)

    def _add(self, entity: str, series: Series) -> None:
        if entity not in self._series:
            clock = self._plan.clock
            size = bucket_size(clock.count, len(series.lines))
            self._series[entity] = Decimator(size * clock.dt_secs)
        self._series[entity].add(series)

    def _panels(self, series: dict[str, Series]) -> tuple[list[Panel], list[Panel], list[Panel]]:
        """Return the panels of outputs and inputs, of estimates, and of innovations."""
        plan = self._plan
        signals = [
            _panel(_entity(kind, each.binding.name), title_of(each.binding.name, each.unit), drawn)
            for kind, bound in (("output", plan.outputs), ("input", plan.inputs))
            for each in bound
            for drawn in [series[f"{_entity(kind, each.binding.name)}/{kind}s"]]
        ]
        estimates = [
            _panel(name, title_of(q.name, q.unit), series[f"{name}/estimate"])
            for q in plan.quantities
            for name in [_entity(q.kind, q.name)]
        ]
        end = (plan.clock.count - 1) * plan.clock.dt_secs
        lines = (Line("±2σ", np.full(2, sign * BAND_STDS), GREY) for sign in (1, -1))
        guides = Series("band", np.array([0.0, end]), tuple(lines))
        innovations = [
            _panel(name, f"{words(each.binding.name)} innovation / expected σ", drawn, guides)
            for each in plan.outputs
            for name in [_entity("innovation", each.binding.name)]
            for drawn in [series[f"{name}/normalised"]]
        ]
        return signals, estimates, innovations


@contextmanager
def open_estimate_review(
    plan: EstimatePlan, path: str | os.PathLike[str]
) -> Iterator[EstimateReview]:
    """Open a review, which becomes an .rrd file once it is finished.

    Raises
    ------
    ShiplogError
        Where `path` cannot be written to.
    """
    identity = (plan.name, plan.clock.start_ns, plan.clock.count, plan.system.name, plan.states)
    recording = rr.RecordingStream(
        re.sub(r"[^A-Za-z0-9_-]+", "-", f"shiplog estimate {plan.system.name}"),
        recording_id=sha256(repr(identity).encode()).hexdigest()[:32],
        send_properties=False,
    )
    with save_recording(recording, path):
        yield EstimateReview(plan, recording)


def _sampled(
    samples: MeasuredSamples, first: int, columns: tuple[FloatArray, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return the instants (k,) of measurements and the columns (c, k) there."""
    rows, values = samples.step(first, np.column_stack(columns))
    return np.asarray(rows, np.float64), values.T


def _entity(kind: str, name: str) -> str:
    """Return the path of an entity: names may have blanks, of which Rerun warns."""
    return re.sub(r"\W+", "_", f"{kind}_{name}")


def _panel(name: str, title: str, *series: Series) -> Panel:
    """Return a panel whose axis fits the values, a band of typical width, and the guides.

    The band of a filter is wide at first: all of it would squeeze the rest.
    """
    lines, *guides = (each.lines for each in series)
    shown = [line for line in lines if line.name != "±2σ"]
    last = shown[-1].values
    bands = [_typical_band(last, line.values) for line in lines if line.name == "±2σ"]
    levels = [np.full(len(last), line.values[0]) for each in guides for line in each]
    axis = limits(*(line.values for line in shown), *bands, *levels)
    return Panel(name, title, series, axis, len(shown) > 1)


def _typical_band(values: FloatArray, band: FloatArray) -> FloatArray:
    """Return the values (n,) shifted by the median distance of a line (n,) from them."""
    distances = band - values
    known = distances[np.isfinite(distances)]
    return values + (np.median(known) if len(known) else 0.0)
