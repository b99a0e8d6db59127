"""Tabs and columns that several reviews in Rerun have."""

from collections.abc import Sequence

import rerun.blueprint as rrb

from shiplog.printable import printable
from shiplog.ships.paper import PAPER_INPUTS

from .manoeuvre_sheets import ManoeuvreSheet
from .panels import Panel
from .rerun_io import axis_between, chart_view, plot_view

TRACK = "track"  # the last part of the entity of a track
FIRST_SHARE, INPUT_SHARE = 1.3, 0.7  # heights of the first panel and of inputs, over others
COLUMN_SHARES = [3, 2]  # widths: panels over time, and track
MAX_TABS = 5  # of a kind among the other tabs; more are in a tab of their own


def manoeuvre_tab(sheet: ManoeuvreSheet) -> rrb.Container:
    """Return the panels of a manoeuvre beside its track."""
    left = panel_column(sheet.panels, axis_between(sheet.start_secs, sheet.end_secs))
    name = printable(sheet.name)
    if sheet.chart is None:
        return rrb.Vertical(*left.contents, row_shares=left.row_shares, name=name)
    chart = chart_view(track_origin(sheet.origin), sheet.chart)
    return rrb.Horizontal(left, chart, column_shares=COLUMN_SHARES, name=name)


def gathered_tabs(tabs: Sequence[rrb.Container], name: str) -> Sequence[rrb.Container]:
    """Return tabs of a kind as they are, or in one tab of this name where they are many."""
    return tabs if len(tabs) <= MAX_TABS else [rrb.Tabs(*tabs, name=name, active_tab=0)]


def track_origin(origin: str) -> str:
    """Return the entity of the track of a sheet whose entities begin with `origin`."""
    return f"{origin}/{TRACK}"


def panel_column(panels: Sequence[Panel], axis: rrb.TimeAxis) -> rrb.Vertical:
    """Return panels one above the other over the same time axis, the first one higher."""
    shares = [FIRST_SHARE, *[_share(panel) for panel in panels[1:]]]
    return rrb.Vertical(*(plot_view(panel, axis) for panel in panels), row_shares=shares)


def _share(panel: Panel) -> float:
    """Return the height of a panel below the first one; inputs need less."""
    return INPUT_SHARE if panel.name.rpartition("/")[2] in PAPER_INPUTS else 1.0
