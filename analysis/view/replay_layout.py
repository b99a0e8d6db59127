"""The tabs of a replay's review in Rerun: trial, manoeuvres, filter, coefficients, and others."""

from collections.abc import Iterator
from dataclasses import dataclass

import rerun.blueprint as rrb

from .manoeuvre_sheets import ManoeuvreSheet
from .panels import Panel
from .rerun_io import axis_between, make_blueprint, plot_view
from .review_tabs import gathered_tabs, manoeuvre_tab, overview_tab
from .track_chart import TrackChart


@dataclass(frozen=True, eq=False)
class ReplayPage:
    """What the review of a replay shows.

    Attributes
    ----------
    motion
        Panels of the whole trial: heading with rudder, yaw rate, speed.
    chart
        The track; None where no position is known.
    has_events
        Whether there is any event.
    manoeuvres
        The sheet of each manoeuvre.
    equations
        Disturbances and innovations of yaw, and those of surge.
    coefficients
        The history of each coefficient.
    sensors
        Histories of sensor errors, and innovations of heading and position.
    further
        Panels of channels that the replay does not use.
    duration_secs
        Of the trial.
    """

    motion: list[Panel]
    chart: TrackChart | None
    has_events: bool
    manoeuvres: list[ManoeuvreSheet]
    equations: tuple[list[Panel], list[Panel]]
    coefficients: list[Panel]
    sensors: tuple[list[Panel], list[Panel]]
    further: list[Panel]
    duration_secs: float

    def panels(self) -> Iterator[Panel]:
        """Yield every panel."""
        yield from self.motion
        for sheet in self.manoeuvres:
            yield from sheet.panels
        for columns in (self.equations, self.sensors):
            for column in columns:
                yield from column
        yield from self.coefficients
        yield from self.further


def replay_blueprint(page: ReplayPage) -> rrb.Blueprint:
    """Return the blueprint of a page; what has no content has no tab."""
    axis = axis_between(0.0, page.duration_secs)

    def column(panels: list[Panel]) -> rrb.Vertical:
        return rrb.Vertical(*(plot_view(panel, axis) for panel in panels))

    trial = overview_tab(
        "trial", page.motion, axis, page.chart,
        has_events=page.has_events, has_manoeuvres=bool(page.manoeuvres),
    )  # fmt: skip
    tabs: list[rrb.View | rrb.Container] = [trial]
    manoeuvres = [manoeuvre_tab(sheet) for sheet in page.manoeuvres]
    tabs += gathered_tabs(manoeuvres, "manoeuvres")
    tabs.append(rrb.Horizontal(*map(column, page.equations), name="filter"))
    if page.coefficients:
        views = (plot_view(panel, axis) for panel in page.coefficients)
        tabs.append(rrb.Grid(*views, grid_columns=3, name="coefficients"))
    if any(page.sensors):
        columns = (column(panels) for panels in page.sensors if panels)
        tabs.append(rrb.Horizontal(*columns, name="sensors"))
    if page.further:
        count = 1 + (len(page.further) > 3) + (len(page.further) > 8)
        views = (plot_view(panel, axis) for panel in page.further)
        tabs.append(rrb.Grid(*views, grid_columns=count, name="further channels"))
    return make_blueprint(rrb.Tabs(*tabs, active_tab=0))
