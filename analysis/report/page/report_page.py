"""The report of a trial as one HTML page without any reference to a network."""

from math import isfinite, nan

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from analysis.report.identification_tables import parameter_tables, proof_tables
from analysis.report.replay_tables import finding_tables, log_table
from shiplog.checks.event_table import event_table
from shiplog.printable import printable
from shiplog.progress import ProgressCallback, no_progress

from .assumptions import assumptions
from .comparisons import comparisons_of
from .condition_rows import condition_groups
from .manoeuvre_sections import ManoeuvreSection, manoeuvre_section, reasons_in_short, time_text
from .numbering import manoeuvre_places
from .predicted_section import predicted_section
from .trial_report import ReportedLog, TrialReport
from .verdict_rows import verdict_rows

SIGNATURES = ("For the shipyard", "For the ship", "For the Administration or class society")


def report_page(report: TrialReport, on_progress: ProgressCallback = no_progress) -> str:
    """Return the report as the text of an HTML page.

    The page is complete in itself: styles and figures are in it, and it has no script. The same
    report gives the same page, to the last character.

    Parameters
    ----------
    report
        The result of `report_trials`.
    on_progress
        Called with each step and its share done.
    """
    places = manoeuvre_places(report)
    numbered = [place for of_log in places for place in of_log]
    sections: list[ManoeuvreSection] = []
    for place in numbered:
        on_progress(
            f"draw manoeuvre {place.position} of {len(numbered)}", len(sections) / len(numbered)
        )
        sections.append(manoeuvre_section(place, report.logs[place.log_number - 1].trial))
    on_progress("write the page")
    conditions = [log.trial.conditions for log in report.logs]
    lengths = [each.length for each in conditions if isfinite(each.length)]
    identified = report.identified
    content = {
        "report": report,
        "ship": next((each.ship for each in conditions if each.ship), ""),
        "logs": [_log_section(log, number) for number, log in enumerate(report.logs, start=1)],
        "verdicts": verdict_rows(report, places),
        "conditions": condition_groups(conditions),
        "sections": sections,
        "comparisons": comparisons_of(numbered, lengths[0] if lengths else nan),
        "identified": (*parameter_tables(identified), *proof_tables(identified))
        if identified
        else (),
        "predicted": predicted_section(identified, numbered) if identified else None,
        "identification_warnings": identified.warnings if identified else (),
        "assumed": tuple(assumptions(report.options)),
        "signatures": SIGNATURES,
    }
    return _environment().get_template("report.html.jinja").render(content)


def _environment() -> Environment:
    """Return the templates' environment: all texts are escaped, as files may hold anything."""
    environment = Environment(
        loader=PackageLoader("analysis.report.page", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_shown,
    )
    environment.filters["time_text"] = time_text
    return environment


def _shown(value: object) -> object:
    """Escape the characters of a text that do not print; the page's own markup is left as it is."""
    return printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _log_section(log: ReportedLog, number: int) -> dict[str, object]:
    """Return what the page shows of a log beside its manoeuvres."""
    start_ns, _ = log.stats.span_ns
    events = [event_table(log.events, start_ns)] if log.events else []
    return {
        "number": number,
        "log": log,
        "not_computed": reasons_in_short(log.trial.not_computed),
        "start": time_text(log.trial.start_ns, 0.0),
        "quality": (log_table(log.stats), *events),
        "estimates": finding_tables(log.replay) if log.replay else (),
    }
