"""Tables of an identified ship for people, in the units they use."""

from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np

from analysis.identification.comparison.history import PRIOR_OFFSET
from analysis.identification.fit.drift import DRIFT_INDICES, DRIFT_UNKNOWN, drift_is_unknown
from analysis.identification.fit.fix_blocks import GROUND_VELOCITY
from analysis.identification.held_out import JUDGED_COLUMNS, PREDICTED
from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.model_selection import Candidate
from analysis.identification.validation import Validation
from analysis.manoeuvres.manoeuvre import ManoeuvreIndex
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.text_table import TextTable
from shiplog.units import CATALOGUE, conversion_factor

from .predicted_tables import prediction_tables

FIT_METHOD = "output error"
DISPLAY_UNITS = {"rad": "deg", "rad/s": "deg/s", "m/s": "kn"}
OUTPUT_UNITS = (
    {name: CATALOGUE[name].unit for name in MODEL_OUTPUTS}
    | dict.fromkeys(GROUND_VELOCITY, "m/s")
    | {"track": "m"}
)
SENSORS = {
    "yaw_rate": "gyro",
    "speed": "speed log",
    "heading": "compass",
}  # whose bias is estimated
FAULT_MARKS = {"not converged": "*", "at its limit": "limit", "no 35° turn": "turn"}
NOT_CONVERGED_MARK = " (*)"  # after each value of a fit that has not converged
MIN_CORRELATION, MAX_PAIRS = 0.97, 3  # of the correlated pairs that are reported


def identification_tables(ship: IdentifiedShip) -> tuple[TextTable, ...]:
    """Summarise an identification as tables with remarks.

    Parameters
    ----------
    ship
        The result of `analysis.identify`.

    Returns
    -------
    tables
        Where models were compared, their scores; then the parameters, the share of prior by
        method, and the fitted runs; where runs were predicted, the validation and the indices of
        each manoeuvre; the predicted standard manoeuvres.
    """
    return (*parameter_tables(ship), *proof_tables(ship), *prediction_tables(ship))


def parameter_tables(ship: IdentifiedShip) -> tuple[TextTable, ...]:
    """Return the tables of the models compared, of the parameters, and of the share of prior."""
    models = (_model_table(ship),) if len(ship.candidates) > 1 else ()
    return (*models, _parameter_table(ship), _prior_table(ship))


def proof_tables(ship: IdentifiedShip) -> tuple[TextTable, ...]:
    """Return the tables of the fitted runs, and of the runs that were predicted if there are any.

    Each manoeuvre among the latter has a table of its indices.
    """
    if not ship.validations:
        return (_fit_table(ship),)
    indices = (_index_table(each) for each in ship.validations if each.indices)
    return (_fit_table(ship), _validation_table(ship), *indices)


def fitted_run_tables(ship: IdentifiedShip, number: int) -> tuple[TextTable, ...]:
    """Return what `identification_tables` has of one of the fitted segments, a row a quantity."""
    return (_transposed(_fit_table(ship), number, f"fit: {ship.runs[number].name}"),)


def validation_tables(ship: IdentifiedShip, number: int) -> tuple[TextTable, ...]:
    """Return what `identification_tables` has of one of the predicted segments.

    The errors have a row for each quantity.
    """
    validation = ship.validations[number]
    title = f"prediction: {validation.segment.name}"
    indices = (_index_table(validation),) if validation.indices else ()
    return (*indices, _transposed(_validation_table(ship), number, title))


def _transposed(table: TextTable, number: int, title: str) -> TextTable:
    """Return one row of a table as a table of its own, with a row for each of its columns."""
    cells = zip(table.columns, table.rows[number], strict=True)
    rows = tuple((column.replace("\n", " "), cell) for column, cell in cells if cell)
    return TextTable(title, ("quantity", "value"), rows[1:], table.remarks)


# ---- models


def _model_table(ship: IdentifiedShip) -> TextTable:
    names = [PREDICTED[i].replace("_", " ") for i in JUDGED_COLUMNS]
    columns = (
        "model", "n", "score\n[%]", *(f"{name}\n[%]" for name in names), "weight\n[%]", "fault",
    )  # fmt: skip
    remark = (
        "Each run in turn, and all runs with the largest rudder angles together, are predicted by "
        "the model fitted to the other runs; only initial state, rudder zero, sensor errors and "
        "current are estimated from the run itself. The error is the rms of predicted minus "
        "measured over the standard deviation of the measured, the score its mean. The model with "
        "the lowest score and without a fault is taken; the weight is its share in predictions. "
        "n: number of free parameters."
    )
    title = f"Models by cross-validation: {ship.model.name}"
    remarks = (remark, *_fault_remarks(ship.candidates))
    return TextTable(title, columns, tuple(map(_model_row, ship.candidates)), remarks)


def _fault_remarks(candidates: Sequence[Candidate]) -> Iterator[str]:
    faults = [f"{each.model.name}: {each.fault}" for each in candidates if each.fault]
    if faults:
        yield f"Faults: {'; '.join(faults)}."


def _fault_mark(candidate: Candidate) -> str:
    """Return the fault of a model in a word; the remarks have it in full."""
    marks = (mark for fault, mark in FAULT_MARKS.items() if candidate.fault.startswith(fault))
    return next(marks, candidate.fault)


def _model_row(candidate: Candidate) -> tuple[str, ...]:
    if candidate.fit is None:
        return (candidate.model.name, "", "diverges", *("" for _ in JUDGED_COLUMNS), "", "")
    errors = [f"{100 * error:.3g}" if isfinite(error) else "" for error in mean_misfits(candidate)]
    free = str(len(candidate.fit.problem.free))
    score, weight = f"{100 * candidate.score:.3g}", f"{100 * candidate.weight:.0f}"
    return (candidate.model.name, free, score, *errors, weight, _fault_mark(candidate))


def mean_misfits(candidate: Candidate) -> list[float]:
    """Average a model's relative errors over the runs held out.

    Returns
    -------
    errors
        Of yaw rate, speed, heading and track; NaN where no run has a finite one.
    """
    columns = [column[np.isfinite(column)] for column in candidate.misfits[:, JUDGED_COLUMNS].T]
    return [float(np.mean(column)) if len(column) else np.nan for column in columns]


# ---- parameters


def _parameter_table(ship: IdentifiedShip) -> TextTable:
    estimates, rows = ship.uncertainty, []
    mark = "" if ship.fit.minimum.converged else NOT_CONVERGED_MARK
    for i, name in enumerate(estimates.names):
        share, unit = _percent(estimates.prior_share[i]), ship.model.parameter(name).unit
        if name in estimates.unidentifiable:
            rows.append((name, f"not identifiable{mark}", "", "", share, unit))
            continue
        half, bound = 1.96 * estimates.std[i], 1.96 * estimates.bound[i]
        value = f"{estimates.values[i]:.5g}{mark}"
        rows.append((name, value, f"± {half:.2g}", f"± {bound:.2g}", share, unit))
    for name, fixed in ship.fixed.items():
        rows.append((name, f"{fixed:.5g}", "fixed", "", "", ship.model.parameter(name).unit))
    columns = (
        "parameter", "value", "95 %\ninterval", "Cramér-Rao\nbound", "share of\nprior", "unit",
    )  # fmt: skip
    title = f"Parameters: {ship.model.title}"
    return TextTable(title, columns, tuple(rows), tuple(_parameter_remarks(ship)))


def _parameter_remarks(ship: IdentifiedShip) -> Iterator[str]:
    if not ship.fit.minimum.converged:
        yield (
            f"{NOT_CONVERGED_MARK.strip()}: the fit has not converged; the value is that of the "
            "last iteration, and its interval is not valid."
        )
    for manoeuvre, names in _names_by_manoeuvre(ship).items():
        yield (
            f"{', '.join(names)}: not identifiable from these logs; "
            f"recommended manoeuvre: {manoeuvre}."
        )
    yield (
        "95 % interval: allows for coloured residuals and for differences between runs. "
        "Cramér-Rao bound: the 95 % interval if the residuals were white. Share of prior: how much "
        "of the value comes from its prior and not from the data. Condition number "
        f"{ship.uncertainty.condition:.0f}."
    )
    pairs = _correlated_pairs(ship)
    if pairs:
        yield f"Hardly separable, with correlation: {pairs}."
    scale = ship.fit.problem.scale
    if ship.model.dimensionless:
        yield (
            f"Dimensionless model: the unit of time is L/U0 = {scale.secs:.4g} s, of speed "
            f"U0 = {scale.speed:.4g} m/s, of revolutions {scale.rpm:.4g} rpm."
        )
    if ship.uncertainty.enlargement > 1:
        parts = "The halves of the log" if len(ship.fit.problem.runs) == 1 else "The runs"
        yield (
            f"{parts} differ by more than their noise explains; the intervals are enlarged by a "
            f"factor of {ship.uncertainty.enlargement:.1f}."
        )
    if ship.ties is not None:
        yield ship.ties.advice(tied=ship.model.name == "burylin-tied")


def _names_by_manoeuvre(ship: IdentifiedShip) -> dict[str, list[str]]:
    """Group the parameters that are not identifiable by the recommended manoeuvre."""
    grouped: dict[str, list[str]] = {}
    for name, manoeuvre in ship.advice.items():
        grouped.setdefault(manoeuvre, []).append(name)
    return grouped


def _correlated_pairs(ship: IdentifiedShip) -> str:
    """List the most correlated pairs, of which the data determine a combination only."""
    correlation, names = ship.uncertainty.correlation, ship.uncertainty.names
    pairs = [
        (i, j) for i in range(len(names)) for j in range(i)
        if abs(correlation[i, j]) > MIN_CORRELATION
    ]  # fmt: skip
    pairs.sort(key=lambda pair: -abs(correlation[pair]))
    return ", ".join(
        f"{names[j]} and {names[i]} {correlation[i, j]:+.3f}" for i, j in pairs[:MAX_PAIRS]
    )


# ---- share of prior


def _prior_table(ship: IdentifiedShip) -> TextTable:
    by_method = prior_shares_by_method(ship)
    rows = tuple(
        (name, *(_percent(shares.get(name, np.nan)) for shares in by_method.values()))
        for name in ship.uncertainty.names
    )
    remark = (
        "How much of a value comes from its prior, by a second estimate from another prior. Output "
        "error: priors shifted by a standard deviation, and another start. Other methods: two "
        f"priors, at least {100 * PRIOR_OFFSET:.0f} % above and below the value; the median over "
        "the latter half of the runs. 0 %: from data alone; 100 %: a copy of the prior; above: "
        "the method amplifies errors of the prior."
    )
    return TextTable("Share of prior by method", ("parameter", *by_method), rows, (remark,))


def prior_shares_by_method(ship: IdentifiedShip) -> dict[str, dict[str, float]]:
    """Collect the share of prior in each parameter, by each method that has priors.

    Returns
    -------
    shares
        By method, then by parameter: 0 for none, 1 for a copy of the prior, NaN where the method
        has no estimate.
    """
    estimates = ship.uncertainty
    shares = {FIT_METHOD: dict(zip(estimates.names, estimates.prior_share, strict=True))}
    for history in ship.histories:
        if len(history.priors) > 1:
            medians = history.median_prior_share
            shares[history.method] = dict(zip(history.names, medians, strict=True))
    return shares


# ---- runs


def _fit_table(ship: IdentifiedShip) -> TextTable:
    outputs, rows = ship.fit.problem.outputs, []
    for run in ship.runs:
        rms = [_in_display_unit(run.rms[name], OUTPUT_UNITS[name]) for name in outputs]
        zero = _in_display_unit(run.rudder_offset, "rad")
        biases = [_in_display_unit(bias, OUTPUT_UNITS[name]) for name, bias in run.biases.items()]
        swells = ", ".join(f"{secs:.3g}" for secs in run.wave_secs)
        rows.append((run.name, f"{run.duration_secs:.0f}", *rms, zero, *biases, swells))
    columns = (
        "log", "duration\n[s]", *(_heading(name, name) for name in outputs), "rudder zero\n[deg]",
        *(_heading(f"{SENSORS.get(name, name)} bias", name) for name in ship.runs[0].biases),
        "swell\nperiod [s]",
    )  # fmt: skip
    remark = (
        "Of each output the residual rms, measured minus fitted; then what is estimated for each "
        "run by itself."
    )
    return TextTable("Fit: residual rms", columns, tuple(rows), (remark,))


def _validation_table(ship: IdentifiedShip) -> TextTable:
    each_name = (*MODEL_OUTPUTS, "track")
    names = [name for name in each_name if any(name in v.rms for v in ship.validations)]
    rows = []
    for each in ship.validations:
        cells = [
            _in_display_unit(each.rms[name], OUTPUT_UNITS[name]) if name in each.rms else ""
            for name in names
        ]
        duration = f"{(len(each.segment) - 1) * each.segment.dt_secs:.0f}"
        distance = np.hypot(*(each.track[-1] - each.measured_track[-1]))
        last = f"{distance:.3g}" if isfinite(distance) else ""
        rows.append((each.segment.name, duration, *cells, last))
    columns = (
        "log", "duration\n[s]", *(_heading(name, name) for name in names), "final\nposition [m]",
    )  # fmt: skip
    remark = (
        "Runs that were not fitted, simulated open loop from their initial state with the recorded "
        "rudder and revolutions: the rms of simulated minus measured, and the distance between "
        "the final positions."
    )
    reasons = [
        f"{each.segment.name}: no manoeuvring indices; {each.no_indices}."
        for each in ship.validations
        if each.no_indices
    ]
    if drift_is_unknown(ship.fit.problem):
        reasons.append(
            f"The drift is {DRIFT_UNKNOWN} in the fitted logs: the simulated tracks are without "
            f"drift, and {', '.join(DRIFT_INDICES)} are not compared."
        )
    title = "Validation: rms of simulated minus measured"
    return TextTable(title, columns, tuple(rows), (remark, *reasons))


def _index_table(validation: Validation) -> TextTable:
    rows = tuple(map(_index_row, validation.indices))
    columns = ("index", "measured", "simulated", "error", "error [%]")
    remark = "Counted from the rudder order that leads to the manoeuvre's angle."
    return TextTable(f"Manoeuvring indices: {validation.segment.name}", columns, rows, (remark,))


def _index_row(index: ManoeuvreIndex) -> tuple[str, ...]:
    """Format an index; an angle has no relative error."""
    unit = index.unit
    cells = [_in_display_unit(v, unit, 4) for v in (index.measured, index.simulated)]
    cells.append(_in_display_unit(index.error, unit))
    relative = "" if unit == "rad" else f"{100 * index.error / index.measured:+z.1f}"
    name = f"{index.name} [{_display_unit(unit)}]"
    return (name, *cells, relative if isfinite(index.error) else "")


# ---- cells


def _heading(text: str, output: str) -> str:
    return f"{text.replace('_', ' ')}\n[{_display_unit(OUTPUT_UNITS[output])}]"


def _display_unit(unit: str) -> str:
    return DISPLAY_UNITS.get(unit, unit)


def _in_display_unit(value: float, unit: str, digits: int = 3) -> str:
    if not isfinite(value):
        return ""
    return f"{value * conversion_factor(unit, _display_unit(unit)):.{digits}g}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if isfinite(share) else ""
