"""The verdict of a report as tables for the terminal."""

from shiplog.text_table import TextTable

from .manoeuvre_sections import reasons_in_short
from .numbering import manoeuvre_places
from .trial_report import TrialReport
from .verdict_rows import VerdictRow, verdict_rows


def trial_tables(report: TrialReport) -> tuple[TextTable, ...]:
    """Return the verdict on each criterion, and the manoeuvres with what was not computed.

    Parameters
    ----------
    report
        The result of `report_trials`.
    """
    places = manoeuvre_places(report)
    rows = tuple(
        (
            row.name,
            f"{row.value} ({row.lengths})" if row.lengths else row.value,
            row.interval,
            _verdict_text(row),
        )
        for row in verdict_rows(report, places)
    )
    columns = ("criterion", "measured", "95 % interval", "verdict")
    verdicts = TextTable("Verdict, IMO MSC.137(76)", columns, rows, has_prose=True)
    return verdicts, *_not_computed_table(report)


def _verdict_text(row: VerdictRow) -> str:
    """Write the verdict with the limit and its probability, or the reason why there is none."""
    if row.place is None:
        return f"{row.verdict}: {row.note}"
    return f"{row.verdict} ({row.limit}, p {row.probability}), manoeuvre {row.place.position}"


def _not_computed_table(report: TrialReport) -> tuple[TextTable, ...]:
    """Return what could not be computed, with the reasons; no table where there is nothing."""
    rows = [
        (f"{log.trial.name}: {subjects}", reason)
        for log in report.logs
        for subjects, reason in reasons_in_short(log.trial.not_computed)
    ]
    rows += [
        (f"manoeuvre {place.position}: {subjects}", reason)
        for of_log in manoeuvre_places(report)
        for place in of_log
        for subjects, reason in reasons_in_short(place.manoeuvre.not_computed)
    ]
    if not rows:
        return ()
    return (TextTable("Not computed", ("subject", "reason"), tuple(rows), has_prose=True),)
