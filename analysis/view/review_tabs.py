"""Tabs and columns that several reviews in Rerun have."""

from collections.abc import Sequence

import rerun.blueprint as rrb

from shiplog.printable import printable
from shiplog.ships.paper import PAPER_INPUTS

from .manoeuvre_sheets import ManoeuvreSheet
from .panels import Panel
from .rerun_io import axis_between, chart_view, events_view, plot_view
from .track_chart import TrackChart

SUMMARY, TRACK = "summary", "track"  # entities: of the page of text, and the end of a track's
FIRST_SHARE, INPUT_SHARE = 1.3, 0.7  # heights of the first panel and of inputs, over others
COLUMN_SHARES = [3, 2]  # widths: panels over time, and track
CHART_SHARES = [3, 2]  # heights: track, and text
MAX_TABS = 5  # of a kind among the other tabs; more are in a tab of their own


def overview_tab(
    name: str,
    panels: Sequence[Panel],
    axis: rrb.TimeAxis,
    chart: TrackChart | None,
    *,
    has_events: bool,
    has_manoeuvres: bool,
) -> rrb.Container:
    """Return panels beside the track, and below this one the summary and the events.

    Parameters
    ----------
    name
        Of the tab.
    panels, axis
        The panels, and their time axis.
    chart
        The track; None where no position is known.
    has_events, has_manoeuvres
        Whether there are events, and whether manoeuvres are among them: then they are shown first.
    """
    texts: list[rrb.View] = [rrb.TextDocumentView(origin=SUMMARY, name="summary")]
    if has_events:
        texts.append(events_view())
    right: rrb.View | rrb.Container = texts[0]
    if len(texts) > 1:
        right = rrb.Tabs(*texts, active_tab=int(has_manoeuvres))
    if chart is not None:
        right = rrb.Vertical(chart_view(TRACK, chart), right, row_shares=CHART_SHARES)
    return rrb.Horizontal(panel_column(panels, axis), right, column_shares=COLUMN_SHARES, name=name)


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
