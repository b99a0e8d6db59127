"""Series and panels of sensor errors, heading, position, current and wind, as far as states."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from analysis.filters.noise_model import FURTHER_OUTPUTS
from analysis.replay.replay_results import Findings, ReplayChunk
from analysis.replay.sensor_errors import SlowState, further_display
from analysis.report.display import BAND_STDS
from shiplog.checks.channel_stats import gap_threshold_secs
from shiplog.resampling import Clock

from .panels import Panel, limits, rounded, title_of, with_bounds
from .series import BLUE, CYAN, GREY, ORANGE, RED, Colour, Line, MeasuredSamples, Series, banded

SETTLED_SHARE = 0.25  # of a trial: the band before it is that of the prior, and sets no axis
INNOVATIONS = {"compass": "heading", "north": "position north", "east": "position east"}
HISTORIES: dict[str, tuple[str, Colour]] = {
    "gyro": ("gyro bias", BLUE),
    "compass": ("compass bias", BLUE),
    "rudder": ("rudder zero", BLUE),
    "log": ("speed log bias", ORANGE),
    "log_scale": ("speed log scale", ORANGE),
    "current_north": ("current to north", RED),
    "current_east": ("current to east", RED),
    "drift_length": ("drift length", BLUE),
    "wind_oblique": ("oblique wind, 10 m/s", CYAN),
    "wind_beam": ("beam wind, 10 m/s", CYAN),
    "wind_head": ("head wind, 10 m/s", CYAN),
}


class SensorSeries:
    """The series of the sensors tab, built chunk by chunk in the units people use.

    Parameters
    ----------
    clock
        The clock of the replay.
    """

    def __init__(self, clock: Clock) -> None:
        self._samples = {
            name: MeasuredSamples(
                gap_threshold_secs(clock.channels[name].interval_secs) / clock.dt_secs
            )
            for name in FURTHER_OUTPUTS
            if name in clock.channels
        }

    def step(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Return the series of the next chunk, by entity; none where the filter has no such."""
        further, at = chunk.estimates.further, chunk.signals.time_secs
        if further is None:
            return {}
        drawn = self._innovations(chunk)
        colours = {name: colour for name, (_, colour) in HISTORIES.items()} | {"heading": BLUE}
        for name, unit in zip(further.names, further.units, strict=True):
            if name in colours:
                factor = further_display(name, unit)[1]
                i = further.names.index(name)
                value, std = further.values[:, i] * factor, further.stds[:, i] * factor
                band = banded("estimate", value, BAND_STDS * std, colours[name])
                drawn[f"sensor_{name}/state"] = Series("state", at, band)
        return drawn

    def _innovations(self, chunk: ReplayChunk) -> dict[str, Series]:
        """Return the innovations of heading and position over their σ, and the heading."""
        drawn, estimates, signals = {}, chunk.estimates, chunk.signals
        first = estimates.innovations.shape[1] - len(_outputs(chunk))
        for i, name in enumerate(_outputs(chunk), first):
            normalised = estimates.innovations[:, i] / estimates.innovation_stds[:, i]
            measured = np.where(np.isfinite(normalised), signals[name], np.nan)
            rows, columns = self._samples[name].step(
                signals.first, np.column_stack((measured, normalised))
            )
            times = rows * signals.dt_secs
            line = Line("innovation", columns[:, 1], BLUE)
            entity = f"innovation_{name}/normalised"
            drawn[entity] = Series("normalised", times, (line,), spiky=True)
            if name == "compass":
                line = Line("measured", np.degrees(columns[:, 0]), GREY, 2.5)
                series = Series("measured", times, (line,), spiky=True)
                drawn["sensor_heading/measured"] = series
        return drawn


def _outputs(chunk: ReplayChunk) -> tuple[str, ...]:
    """Return the further outputs of the filter: none, the compass, or all."""
    return FURTHER_OUTPUTS[: chunk.estimates.innovations.shape[1] - 2]


def sensor_panels(
    findings: Findings, drawn: Mapping[str, Series]
) -> tuple[list[Panel], list[Panel]]:
    """Return the panels of the histories, and those of heading and innovations.

    Parameters
    ----------
    findings
        The findings of the replay.
    drawn
        The series by entity, as `SensorSeries` returns them.
    """
    errors = {error.name: error for error in (*findings.sensor_errors, *findings.wind)}
    histories = [
        _history(name, label, drawn[f"sensor_{name}/state"], errors.get(name))
        for name, (label, _) in HISTORIES.items()
        if f"sensor_{name}/state" in drawn
    ]
    innovations = [
        _innovation(name, drawn[f"innovation_{name}/normalised"])
        for name in INNOVATIONS
        if f"innovation_{name}/normalised" in drawn
    ]
    # the first legend of a kind serves all
    histories = [replace(panel, legend=panel is histories[0]) for panel in histories]
    innovations = [replace(panel, legend=panel is innovations[0]) for panel in innovations]
    if "sensor_heading/state" not in drawn:
        return histories, innovations
    measured, state = drawn["sensor_heading/measured"], drawn["sensor_heading/state"]
    axis = limits(measured.lines[0].values, state.lines[-1].values)
    heading = Panel("sensor_heading", "heading [deg]", (measured, state), axis, legend=True)
    return histories, [heading, *innovations]


def _history(name: str, label: str, series: Series, error: SlowState | None) -> Panel:
    """Draw a further estimate with its band; the title states an error or coefficient found."""
    si_unit = error.unit if error else "m" if name == "drift_length" else "m/s"
    unit, factor = further_display(name, si_unit)
    title = title_of(label, unit)
    if error is not None:
        found = rounded(error.value * factor, BAND_STDS * error.std * factor)
        title = f"{label} = {found if error.determined else 'not determined'} [{unit}]"
    at = series.time_secs
    settled = at >= at[0] + SETTLED_SHARE * (at[-1] - at[0])
    return Panel(
        f"sensor_{name}", title, (series,), limits(*(line.values[settled] for line in series.lines))
    )


def _innovation(name: str, series: Series) -> Panel:
    span = series.time_secs[[0, -1]]
    guides = (Line("±2σ", np.full(2, sign * BAND_STDS), GREY) for sign in (1, -1))
    return Panel(
        f"innovation_{name}",
        f"{INNOVATIONS[name]} innovation / expected σ",
        (series, Series("sigma_limits", span, tuple(guides))),
        with_bounds(limits(series.lines[0].values), BAND_STDS),
        legend=True,
    )
