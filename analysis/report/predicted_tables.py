"""Table of the standard manoeuvres that an identified ship is predicted to sail."""

from collections.abc import Iterator
from math import isfinite

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.predicted_indices import PredictedManoeuvre
from analysis.manoeuvres.trial_index import TrialIndex, Verdict
from shiplog.text_table import TextTable
from shiplog.units import conversion_factor

from .display import NOT_KNOWN, number_text

VERDICTS = {Verdict.MEETS: "meets", Verdict.FAILS: "fails", Verdict.UNDECIDED: "undecided"}
SHORT_SOURCES = {"choice of model": "models"}
SHORT_UNITS = {"°": "deg", "°/s": "deg/s"}  # as the other tables of an identification have them


def prediction_tables(ship: IdentifiedShip) -> tuple[TextTable, ...]:
    """Return the table of the predicted manoeuvres; none where there are none.

    Parameters
    ----------
    ship
        The result of `analysis.identify`; its `no_predictions` is the reason where there is no
        table.
    """
    if not ship.predictions:
        return ()
    rows = [row for each in ship.predictions for row in _manoeuvre_rows(each)]
    columns = ("index", "value", "95 % interval", "limit", "verdict", "largest\nsource")
    remarks = (f"{basis_of_predictions(ship)} {SOURCES_REMARK}", *prediction_notes(ship))
    return (TextTable("Predicted manoeuvres", columns, tuple(rows), remarks),)


SOURCES_REMARK = (
    "Limits and verdicts: IMO MSC.137(76); undecided: the limit lies within the interval. Largest "
    "source of the uncertainty: the parameters, the models that predict held-out runs about as "
    "well, the rudder zero, which differs from run to run, or the model error, which held-out runs "
    "show."
)


def basis_of_predictions(ship: IdentifiedShip) -> str:
    """Describe what the manoeuvres are predicted from: models, approach, loading, rudder.

    Parameters
    ----------
    ship
        An identified ship with predictions.
    """
    assert ship.approach is not None  # noqa: S101 - for the type checker
    used = [each for each in ship.candidates if each.weight > 0]
    models = ", ".join(f"{each.model.name} ({100 * each.weight:.0f} %)" for each in used)
    speed, rpm = ship.approach.speed, ship.approach.rpm
    rate = ship.approach.rudder_rate * conversion_factor("rad", "deg")
    return (
        f"Predicted by {models}, as fitted to the logs, at their loading and water depth, without "
        f"wind and current, from a straight run at their approach speed of {speed:.3g} m/s "
        f"({speed * conversion_factor('m/s', 'kn'):.3g} kn) and {rpm:.4g} rpm, with the rudder "
        f"moving at {rate:.2g} deg/s."
    )


def prediction_notes(ship: IdentifiedShip) -> Iterator[str]:
    """Yield what restricts predictions, each once, with the manoeuvres that it concerns.

    Parameters
    ----------
    ship
        An identified ship.
    """
    manoeuvres: dict[tuple[str, str], list[str]] = {}
    for each in ship.predictions:
        reasons = {"": each.note} if each.note else {}
        for note in dict.fromkeys(index.note for index in each.indices if index.note):
            names = ", ".join(index.name for index in each.indices if index.note == note)
            reasons[f": {names}"] = note
        for names, note in reasons.items():
            manoeuvres.setdefault((names, note), []).append(each.manoeuvre.name)
    for (names, note), of_note in manoeuvres.items():
        yield f"{', '.join(of_note)}{names}: {note}."
    if note := missing_length_note(ship):
        yield note


def missing_length_note(ship: IdentifiedShip) -> str:
    """Return what cannot be computed without the ship's length; empty where it is given.

    Parameters
    ----------
    ship
        An identified ship with predictions.
    """
    if ship.length_given:
        return ""
    return (
        "The ship's length is not given: no value is in ship lengths, and no limit that depends on "
        "the length is computed; give it with --length, or in a vessel file."
    )


def _manoeuvre_rows(predicted: PredictedManoeuvre) -> Iterator[tuple[str, ...]]:
    yield (predicted.manoeuvre.name, "", "", "", "", "")
    for index in predicted.indices:
        yield from _index_rows(index)


def _index_rows(index: TrialIndex) -> Iterator[tuple[str, ...]]:
    """Yield the row of an index and, of a distance whose limit is in ship lengths, one in these."""
    unit = SHORT_UNITS.get(index.display_unit, index.display_unit)
    cells = _cells(index, index.display_factor)
    source = largest_source(index)
    source = SHORT_SOURCES.get(source, source)
    verdict = VERDICTS[index.verdict] if index.verdict else ""
    limit = index.criterion.limit if index.criterion else float("nan")
    if not isfinite(index.in_lengths):
        shown = f"{limit * index.display_factor:.1f}" if isfinite(limit) else ""
        yield (f"{index.name} [{unit}]", *cells, shown, verdict, source)
        return
    per_length = index.in_lengths / index.value
    yield (f"{index.name} [{unit}]", *cells, "", "", source)
    shown = f"{limit * per_length:.3g}" if isfinite(limit) else ""
    yield ("  [L]", *_cells(index, per_length), shown, verdict, "")


def _cells(index: TrialIndex, factor: float) -> tuple[str, str]:
    """Return value and interval, with the digits that half the width of the interval allows."""
    if not isfinite(index.value):
        return NOT_KNOWN, ""
    half = (index.high - index.low) / 2 * factor
    value, low, high = (
        number_text(each * factor, half) for each in (index.value, index.low, index.high)
    )
    return value, f"{low} to {high}"


def largest_source(index: TrialIndex) -> str:
    """Return the source with the largest share of an index's uncertainty; empty without any."""
    return max(index.sources, key=lambda name: index.sources[name]) if index.sources else ""
