"""The tabs of an identification's review in Rerun: runs, residuals, parameters, and summary."""

from collections.abc import Sequence
from dataclasses import replace

import rerun.blueprint as rrb

from analysis.identification.comparison.history import total_duration_secs
from analysis.identification.identified_ship import IdentifiedShip
from shiplog.printable import printable

from .panels import Panel
from .rerun_io import axis_between, chart_view, make_blueprint, plot_view
from .review_tabs import (
    CHART_SHARES,
    COLUMN_SHARES,
    SUMMARY,
    gathered_tabs,
    manoeuvre_tab,
    panel_column,
    track_origin,
)
from .run_sheets import RunSheet

MAX_LARGE_PANELS = 12  # parameters; with more, the panels are in more columns
MAX_ROWS = 4  # of runs in a tab of residuals
PARAMETERS = "parameters (faint: mostly prior)"
VALIDATION, FITTED = "validation", "fitted"


def identification_blueprint(
    ship: IdentifiedShip, sheets: Sequence[RunSheet], parameters: Sequence[Panel]
) -> rrb.Blueprint:
    """Return the blueprint of a review, which shows the proof before the parameters.

    Parameters
    ----------
    ship
        The result of `analysis.identify`.
    sheets
        Of the runs: those that were predicted first.
    parameters
        A panel for each parameter.
    """
    tabs: list[rrb.View | rrb.Container] = []
    for kind in (VALIDATION, FITTED):
        runs = [_run_tab(sheet) for sheet in sheets if sheet.title.startswith(kind)]
        tabs += gathered_tabs(runs, kind)
    pages = [sheets[i : i + MAX_ROWS] for i in range(0, len(sheets), MAX_ROWS)]
    residuals = [_residual_page(page) for page in pages]
    tabs += residuals if len(pages) == 1 else [rrb.Tabs(*residuals, name="residuals")]
    axis = axis_between(0.0, total_duration_secs(ship.fit.problem.segments))
    columns = 3 if len(parameters) <= MAX_LARGE_PANELS else 4
    views = (plot_view(panel, axis) for panel in parameters)
    tabs.append(rrb.Grid(*views, grid_columns=columns, name=PARAMETERS))
    tabs.append(rrb.TextDocumentView(origin=SUMMARY, name="summary"))
    return make_blueprint(rrb.Tabs(*tabs, active_tab=0))


def text_origin(sheet: RunSheet) -> str:
    """Return the entity of the text of a run."""
    return f"{sheet.origin}/errors"


def _run_tab(sheet: RunSheet) -> rrb.Container:
    """Return the panels of a run beside its track and its errors; tabs where it has manoeuvres."""
    errors = rrb.TextDocumentView(origin=text_origin(sheet), name="errors")
    right: rrb.View | rrb.Container = errors
    if sheet.chart is not None:
        chart = chart_view(track_origin(sheet.origin), sheet.chart)
        right = rrb.Vertical(chart, errors, row_shares=CHART_SHARES)
    left = panel_column(sheet.motion, axis_between(sheet.start_secs, sheet.end_secs))
    name = printable(sheet.title)
    if not sheet.manoeuvres:
        return rrb.Horizontal(left, right, column_shares=COLUMN_SHARES, name=name)
    run = rrb.Horizontal(left, right, column_shares=COLUMN_SHARES, name="run")
    return rrb.Tabs(run, *map(manoeuvre_tab, sheet.manoeuvres), name=name, active_tab=0)


def _residual_page(sheets: Sequence[RunSheet]) -> rrb.Container:
    """Return the residuals and their autocorrelation, a row for each run."""
    rows = []
    for sheet in sheets:
        axis = axis_between(sheet.start_secs, sheet.end_secs)
        # the first legends serve all
        panels = [replace(each, legend=sheet is sheets[0]) for each in sheet.residuals]
        *residuals, correlation = panels
        views = [plot_view(panel, axis) for panel in residuals]
        rows.append(
            rrb.Horizontal(*views, plot_view(correlation, axis_between(0.0, sheet.lag_secs)))
        )
    return rrb.Vertical(*rows, name="residuals")
