"""The verdict at a glance: each criterion of the norm with what each log shows of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.manoeuvres.trial_index import TrialIndex, Verdict
from analysis.trial.trial_analysis import CriterionFinding

from .numbering import ManoeuvrePlace
from .trial_report import TrialReport
from .value_text import interval_text, length_text, percent_text, value_text

NORM = "IMO MSC.137(76)"
VERDICT_CLASSES = {
    Verdict.MEETS: "meets",
    Verdict.FAILS: "fails",
    Verdict.UNDECIDED: "undecided",
    None: "untested",
}


@dataclass(frozen=True)
class VerdictRow:
    """A row of the table of criteria, or of a manoeuvre's table of indices; all are texts.

    Attributes
    ----------
    name, symbol
        Of the criterion or of the index.
    place
        The manoeuvre that the value is from; None where not tested.
    value, lengths, interval
        The value in its unit and in ship lengths, and its 95 % interval.
    limit, paragraph
        The limit, and the paragraph of the norm; empty without one.
    verdict, css_class
        In words, and the class of its mark in the page; empty without a limit.
    probability
        That the limit is met.
    note
        A definition or a reason.
    """

    name: str
    symbol: str = ""
    place: ManoeuvrePlace | None = None
    value: str = ""
    lengths: str = ""
    interval: str = ""
    limit: str = ""
    paragraph: str = ""
    verdict: str = ""
    css_class: str = ""
    probability: str = ""
    note: str = ""


def verdict_rows(
    report: TrialReport, places: Sequence[Sequence[ManoeuvrePlace]]
) -> tuple[VerdictRow, ...]:
    """Return a row for each criterion and each log that tests it, or one row with the reason.

    Parameters
    ----------
    report
        The report.
    places
        Of each log's manoeuvres, in their order.
    """
    rows = []
    names = dict.fromkeys(each.name for log in report.logs for each in log.trial.criteria)
    for name in names:
        found = [
            (finding, log_places)
            for log, log_places in zip(report.logs, places, strict=True)
            for finding in log.trial.criteria
            if finding.name == name
        ]
        tested = [_tested_row(finding, *each) for finding, *each in found if finding.index]
        rows += tested or [_untested_row(found[0][0])]
    return tuple(rows)


def index_row(index: TrialIndex) -> VerdictRow:
    """Return the row of an index in its manoeuvre's table."""
    criterion, verdict = index.criterion, index.verdict
    return VerdictRow(
        index.name,
        index.symbol,
        value=value_text(index),
        lengths=length_text(index),
        interval=interval_text(index),
        limit=criterion.text if criterion else "",
        paragraph=_paragraph(criterion.paragraph) if criterion else "",
        verdict=str(verdict) if verdict else "",
        css_class=VERDICT_CLASSES[verdict] if verdict else "",
        probability=percent_text(index.probability) if criterion else "",
        note=index.note,
    )


def _tested_row(finding: CriterionFinding, places: Sequence[ManoeuvrePlace]) -> VerdictRow:
    assert finding.index is not None  # noqa: S101 - the caller selects
    row = index_row(finding.index)
    return replace(
        row,
        name=finding.name,
        symbol="",
        place=next((each for each in places if each.number == finding.manoeuvre), None),
        limit=finding.text,
        paragraph=_paragraph(finding.paragraph),
        verdict=row.verdict or finding.reason or "no limit can be computed",
        css_class=row.css_class or VERDICT_CLASSES[None],
    )


def _untested_row(finding: CriterionFinding) -> VerdictRow:
    return VerdictRow(
        finding.name,
        limit=finding.text,
        paragraph=_paragraph(finding.paragraph),
        verdict="no verdict",
        css_class=VERDICT_CLASSES[None],
        note=finding.reason,
    )


def _paragraph(text: str) -> str:
    """Return the paragraph of the norm that the table's caption names; another one with its norm.

    Examples
    --------
    >>> _paragraph("IMO MSC.137(76), 5.3.1")
    '5.3.1'
    """
    return text.removeprefix(f"{NORM}, ")
