"""The section of each manoeuvre: facts, figures, indices against limits, and what they rest on."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from math import degrees, isfinite, nan, pi

from analysis.manoeuvres.sailed_manoeuvre import ManoeuvreKind, NotComputed, SailedManoeuvre
from analysis.trial.trial_analysis import TrialAnalysis
from shiplog.text_table import TextTable
from shiplog.units import UNITS

from .manoeuvre_histories import history_figure, spiral_figure
from .manoeuvre_track import track_figure
from .numbering import ManoeuvrePlace
from .svg_figure import PageFigure
from .value_text import index_text, std_text, value_text
from .verdict_rows import VerdictRow, index_row

KNOT = UNITS["kn"][1]  # m/s


@dataclass(frozen=True, eq=False)
class ManoeuvreSection:
    """A section of the page.

    Attributes
    ----------
    place
        The manoeuvre with its number and anchor.
    facts
        Labels and texts.
    figures
        Time histories, track, spiral curve: those for which there are data. A straight run, of
        which a day at sea has many, has none.
    rows
        The indices.
    sensitivity, uncertainty
        The indices by other start rules, and the standard uncertainty by source; None without any.
    not_computed
        Names of what could not be computed, and the reason that they share.
    notes
        What was assumed.
    """

    place: ManoeuvrePlace
    facts: tuple[tuple[str, str], ...]
    figures: tuple[PageFigure, ...]
    rows: tuple[VerdictRow, ...]
    sensitivity: TextTable | None
    uncertainty: TextTable | None
    not_computed: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def manoeuvre_section(place: ManoeuvrePlace, trial: TrialAnalysis) -> ManoeuvreSection:
    """Return the section of one manoeuvre of a log."""
    manoeuvre, length = place.manoeuvre, trial.conditions.length
    figures = (
        ()
        if manoeuvre.kind is ManoeuvreKind.STRAIGHT
        else (
            history_figure(manoeuvre, f"{place.anchor}-histories"),
            track_figure(manoeuvre, length, f"{place.anchor}-track"),
            spiral_figure(manoeuvre, f"{place.anchor}-spiral"),
        )
    )
    return ManoeuvreSection(
        place,
        _facts(manoeuvre, trial),
        tuple(figure for figure in figures if figure is not None),
        tuple(index_row(index) for index in manoeuvre.indices),
        _sensitivity_table(manoeuvre),
        _uncertainty_table(manoeuvre),
        reasons_in_short(manoeuvre.not_computed),
        manoeuvre.notes,
    )


def reasons_in_short(items: Iterable[NotComputed]) -> tuple[tuple[str, str], ...]:
    """Join what could not be computed for the same reason.

    Examples
    --------
    >>> reasons_in_short([NotComputed("advance", "no fix"), NotComputed("reach", "no fix")])
    (('advance, reach', 'no fix'),)
    """
    subjects: dict[str, list[str]] = {}
    for item in items:
        subjects.setdefault(item.reason, []).append(item.subject)
    return tuple((", ".join(names), reason) for reason, names in subjects.items())


def time_text(start_ns: int, secs: float) -> str:
    """Write the time of day, UTC, of an instant of a log; the seconds alone before 1980.

    Examples
    --------
    >>> time_text(1_700_000_000_000_000_000, 61.0)
    '2023-11-14 22:14:21 UTC'
    """
    if start_ns < YEAR_1980_NS or not isfinite(secs):
        return f"{secs:.1f} s from the log's start" if isfinite(secs) else ""
    return f"{datetime.fromtimestamp(start_ns * 1e-9 + secs, UTC):%Y-%m-%d %H:%M:%S} UTC"


YEAR_1980_NS = 315_532_800_000_000_000  # a log that begins before has no time of day


def _facts(manoeuvre: SailedManoeuvre, trial: TrialAnalysis) -> tuple[tuple[str, str], ...]:
    """Return the approach and the execute in words, those that are known."""
    facts = (
        ("Log", trial.name),
        ("Execute", time_text(trial.start_ns, manoeuvre.execute_secs)),
        ("Start rule", manoeuvre.start_rule),
        (
            "Duration",
            _text(manoeuvre.end_secs - manoeuvre.execute_secs, "{:.0f} s from the execute"),
        ),
        ("Rudder ordered", _side_text(manoeuvre.rudder, 1)),
        ("Neutral rudder", _side_text(manoeuvre.neutral_rudder, 2)),
        ("Approach heading", _text(degrees(manoeuvre.approach_heading % (2 * pi)), "{:.1f}°")),
        ("Approach speed", _text(manoeuvre.approach_speed / KNOT, "{:.2f} kn")),
        ("Approach yaw rate", _text(degrees(manoeuvre.approach_yaw_rate), "{:.3f} °/s")),
        ("Approach revolutions", _text(manoeuvre.approach_rpm, "{:.1f} rpm")),
    )
    return tuple((label, text) for label, text in facts if text)


def _side_text(angle: float, digits: int) -> str:
    """Write a rudder angle with its side."""
    text = _text(abs(degrees(angle)), f"{{:.{digits}f}}°")
    return f"{text} to {'port' if angle < 0 else 'starboard'}" if text else ""


def _text(value: float, template: str) -> str:
    return template.format(value) if isfinite(value) else ""


def _sensitivity_table(manoeuvre: SailedManoeuvre) -> TextTable | None:
    """Return the indices by each start rule; None where no other rule applies."""
    rules = list(dict.fromkeys(rule for each in manoeuvre.indices for rule in each.start_rules))
    if not rules:
        return None
    rows = []
    for index in manoeuvre.indices:
        if not index.start_rules:
            continue
        values = [index_text(index, index.start_rules.get(rule, nan)) for rule in rules]
        rows.append((index.name, value_text(index), *values))
    columns = ("index", f"as reported:\n{manoeuvre.start_rule}", *rules)
    return TextTable("Sensitivity to the start rule", columns, tuple(rows))


def _uncertainty_table(manoeuvre: SailedManoeuvre) -> TextTable | None:
    """Return the standard uncertainty of each index by its source; None without any."""
    sources = list(dict.fromkeys(name for each in manoeuvre.indices for name in each.sources))
    if not sources:
        return None
    rows = []
    for index in manoeuvre.indices:
        stds = [index.std, *(index.sources.get(name, nan) for name in sources)]
        cells = [std_text(index, std) for std in stds]
        rows.append((index.name, *cells))
    return TextTable(
        "Standard uncertainty by source", ("index", "all sources", *sources), tuple(rows)
    )
