"""The predicted manoeuvres of a report: each index beside the limit and the measured value."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import isfinite, radians

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.predicted_indices import PredictedManoeuvre, StandardManoeuvre
from analysis.manoeuvres.imo_criteria import LIKE_ANGLE
from analysis.manoeuvres.trial_index import TrialIndex, Verdict
from analysis.report.predicted_tables import (
    basis_of_predictions,
    largest_source,
    missing_length_note,
)

from .numbering import ManoeuvrePlace
from .value_text import half_width_text, std_text
from .verdict_rows import VerdictRow, index_row

LIKE_SWITCH = radians(0.5)  # of the switch headings of a sailed and a predicted zig-zag


@dataclass(frozen=True)
class PredictedRow:
    """A predicted index in the page's table; all are texts.

    Attributes
    ----------
    index
        Value, interval, limit and verdict; its place is that of the measured manoeuvre.
    measured
        The value that was sailed; empty where the manoeuvre was not.
    source, source_std
        The largest source of the uncertainty, and its standard uncertainty; empty without a value.
    """

    index: VerdictRow
    measured: str
    source: str
    source_std: str


@dataclass(frozen=True)
class PredictedTable:
    """The table of a predicted manoeuvre.

    Attributes
    ----------
    title
        Of the manoeuvre.
    rows
        Of its indices.
    note
        Why the prediction reaches beyond the logs; empty where it does not.
    """

    title: str
    rows: tuple[PredictedRow, ...]
    note: str


@dataclass(frozen=True)
class PredictedSection:
    """The predicted indices of a report.

    Attributes
    ----------
    tables
        Of the manoeuvres; empty where there are none.
    basis
        What the manoeuvres are predicted from.
    notes
        What restricts them, or the reason why there are none.
    """

    tables: tuple[PredictedTable, ...]
    basis: str
    notes: tuple[str, ...]

    @property
    def has_measured(self) -> bool:
        """Whether any index was measured."""
        return any(row.measured for table in self.tables for row in table.rows)


def predicted_section(ship: IdentifiedShip, places: Iterable[ManoeuvrePlace]) -> PredictedSection:
    """Compose the section of predicted indices.

    Parameters
    ----------
    ship
        The identified ship.
    places
        The manoeuvres of all logs, whose measured indices stand beside the predicted ones.
    """
    if not ship.predictions:
        return PredictedSection((), "", (f"Not predicted: {ship.no_predictions}.",))
    sailed = tuple(places)
    tables = tuple(_table(each, sailed) for each in ship.predictions)
    note = missing_length_note(ship)
    return PredictedSection(tables, basis_of_predictions(ship), (note,) if note else ())


def _table(predicted: PredictedManoeuvre, sailed: Sequence[ManoeuvrePlace]) -> PredictedTable:
    like = [each for each in sailed if _is_like(each, predicted.manoeuvre)]
    rows = tuple(_row(index, like) for index in predicted.indices)
    name = predicted.manoeuvre.name
    return PredictedTable(f"{name[:1].upper()}{name[1:]}", rows, predicted.note)


def _is_like(place: ManoeuvrePlace, manoeuvre: StandardManoeuvre) -> bool:
    """Return whether a sailed manoeuvre is a predicted one, as the norm's criteria take it."""
    sailed, switch = place.manoeuvre, manoeuvre.switch
    return (
        sailed.kind is manoeuvre.kind
        and abs(sailed.rudder - manoeuvre.rudder) <= LIKE_ANGLE
        and (switch is None or abs(abs(sailed.switch_heading) - switch) <= LIKE_SWITCH)
    )


def _row(index: TrialIndex, like: Sequence[ManoeuvrePlace]) -> PredictedRow:
    """Return the row of an index beside the first manoeuvre in which it was measured."""
    row = index_row(index)
    row = replace(row, limit=row.limit.rpartition("here ")[2])  # the formula is in the norm
    if index.verdict is Verdict.UNDECIDED:
        row = replace(row, verdict="not decided")
    source = largest_source(index)
    of_source = (source, std_text(index, index.sources[source]) if source else "")
    for place in like:
        measured = place.manoeuvre.index(index.name)
        if measured is not None and isfinite(measured.value):
            return PredictedRow(replace(row, place=place), half_width_text(measured), *of_source)
    return PredictedRow(row, "", *of_source)
