"""An identified ship as tables for people, and as plain numbers for JSON."""

from collections.abc import Iterator
from math import isfinite

import numpy as np

from analysis.identification.comparison.history import OFF
from analysis.identification.identify import IdentifiedShip
from analysis.identification.model_selection import JUDGED_COLUMNS, Candidate
from analysis.identification.validation import Validation
from analysis.manoeuvres.indices import ManoeuvreIndex
from shiplog.ships.motion import MODEL_OUTPUTS
from shiplog.text_table import TextTable
from shiplog.units import CATALOGUE, conversion_factor

FITTED = "output error"
PEOPLES = {"rad": "deg", "rad/s": "deg/s", "m/s": "kn"}
ALIKE, MOST_PAIRS = 0.97, 3  # of correlations that are told
UNIT = {name: CATALOGUE[name].unit for name in MODEL_OUTPUTS} | {"track": "m"}


def identification_tables(found: IdentifiedShip) -> tuple[TextTable, ...]:
    """Tables in the units people use, and what is to be said of them."""
    made = [_coefficients(found), _prior_shares(found), _runs(found)]
    if found.validations:
        made += [_held_out(found), *(_figures(v) for v in found.validations if v.figures)]
    if found.candidates:
        made.insert(0, _comparison(found))
    return tuple(made)


def _comparison(found: IdentifiedShip) -> TextTable:
    rows = []
    for candidate in found.candidates:
        told = candidate.fit is not None
        off = mean_misfits(candidate)
        rows.append(
            (
                candidate.model.name,
                str(len(candidate.fit.problem.free)) if candidate.fit else "",
                f"{100 * candidate.score:.3g}" if told else "runs away",
                *(f"{100 * value:.3g}" if told and isfinite(value) else "" for value in off),
            )
        )
    columns = ("model", "sought", "score [%]", *(f"{MODEL_OUTPUTS[i]} [%]" for i in JUDGED_COLUMNS))
    remark = (
        "Each run in turn is predicted by a fit to the others, which know nothing of it but where "
        "it began, its rudder's zero and its gyro's bias: the rms of what is off over the standard "
        "deviation of what was measured. The least is taken."
    )
    title = f"Models by cross-validation: {found.model.name}"
    return TextTable(title, columns, tuple(rows), (remark,))


def mean_misfits(candidate: Candidate) -> list[float]:
    """Return the mean relative misfit of each judged output; NaN where none was measured."""
    columns = [column[np.isfinite(column)] for column in candidate.misfits[:, JUDGED_COLUMNS].T]
    return [float(np.mean(column)) if len(column) else np.nan for column in columns]


def _coefficients(found: IdentifiedShip) -> TextTable:
    told, rows = found.uncertainty, []
    for i, name in enumerate(told.names):
        value, half, bound = told.values[i], 1.96 * told.std[i], 1.96 * told.bound[i]
        share = _percent(told.prior_share[i])
        unit = found.model.parameter(name).unit
        if name in told.unidentifiable:
            rows.append((name, "not identifiable", "", "", share, unit))
        else:
            rows.append((name, f"{value:.5g}", f"± {half:.2g}", f"± {bound:.2g}", share, unit))
    for name, value in found.fixed.items():
        rows.append((name, f"{value:.5g}", "stated", "", "", found.model.parameter(name).unit))
    columns = ("coefficient", "value", "95 %", "bound", "echo", "unit")
    title = f"Coefficients: {found.model.title}"
    return TextTable(title, columns, tuple(rows), tuple(_remarks(found)))


def _remarks(found: IdentifiedShip) -> Iterator[str]:
    for text, names in _by_advice(found).items():
        yield f"{', '.join(names)}: not identifiable from these logs; what would tell: {text}."
    yield (
        "95 %: half the interval; bound: Cramér and Rao's, if each sample were off by itself. "
        "PriorSensitivity: how much of the value was believed before any data. "
        f"Condition {found.uncertainty.condition:.0f}."
    )
    alike = _alike(found)
    if alike:
        yield f"Hardly to be told apart (correlation): {alike}."
    scale = found.fit.problem.scale
    if found.model.dimensionless:
        yield (
            f"Without dimensions: time in {scale.secs:.4g} s (L/U0), speed in {scale.speed:.4g} "
            f"m/s, revolutions in {scale.rpm:.4g} rpm."
        )
    if found.uncertainty.enlargement > 1:
        yield (
            f"{'The halves' if len(found.fit.problem.runs) == 1 else 'The runs'} differ more than "
            "their noise explains: intervals are enlarged "
            f"{found.uncertainty.enlargement:.1f} times."
        )
    if found.ties is not None:
        yield found.ties.advice(tied=found.model.name == "burylin-tied")


def _alike(found: IdentifiedShip) -> str:
    """The coefficients that the data know a sum of rather than each, the worst pairs first."""
    told, names = found.uncertainty.correlation, found.uncertainty.names
    pairs = [(i, j) for i in range(len(names)) for j in range(i) if abs(told[i, j]) > ALIKE]
    pairs.sort(key=lambda pair: -abs(told[pair]))
    return ", ".join(f"{names[j]} and {names[i]} {told[i, j]:+.3f}" for i, j in pairs[:MOST_PAIRS])


def _by_advice(found: IdentifiedShip) -> dict[str, list[str]]:
    grouped: dict[str, list[str]] = {}
    for name, text in found.advice.items():
        grouped.setdefault(text, []).append(name)
    return grouped


def _prior_shares(found: IdentifiedShip) -> TextTable:
    """How much of each coefficient is prior, by each method that begins with one."""
    by_method = prior_shares_by_method(found)
    rows = tuple(
        (name, *(_percent(shares.get(name, np.nan)) for shares in by_method.values()))
        for name in found.uncertainty.names
    )
    remark = (
        "How much of a value is what was believed before, by a second run from other beliefs: the "
        "fit from priors a standard deviation off and a start elsewhere, the other methods from "
        f"priors to either side, {100 * OFF:.0f} % off or more, over the latter half of the runs. "
        "100 % is a copy of the prior; beyond it errors grow."
    )
    return TextTable(
        "PriorSensitivity of what was believed before", ("coefficient", *by_method), rows, (remark,)
    )


def prior_shares_by_method(found: IdentifiedShip) -> dict[str, dict[str, float]]:
    """Return the share of prior of each parameter, by method."""
    told = {FITTED: dict(zip(found.uncertainty.names, found.uncertainty.prior_share, strict=True))}
    for histories in found.histories:
        if len(histories.priors) > 1:
            told[histories.method] = dict(
                zip(histories.names, histories.median_prior_share, strict=True)
            )
    return told


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if isfinite(share) else ""


def _runs(found: IdentifiedShip) -> TextTable:
    outputs, rows = found.fit.problem.outputs, []
    for run in found.runs:
        biases = [_shown(value, UNIT[name]) for name, value in run.biases.items()]
        waves = ", ".join(f"{secs:.3g} s" for secs in run.wave_secs)
        rows.append(
            (
                run.name, f"{run.duration_secs:.0f}",
                *(_shown(run.rms[name], UNIT[name]) for name in outputs),
                _shown(run.rudder_offset, "rad"), *biases, waves,
            )
        )  # fmt: skip
    columns = (
        "fitted to", "length\n[s]", *map(_headed, outputs), "rudder's\nzero [deg]",
        *(_headed(name, " bias") for name in found.runs[0].biases), "swell",
    )  # fmt: skip
    remark = "Residuals' rms, and what each run has of its own, fitted with it."
    return TextTable("Fit", columns, tuple(rows), (remark,))


def _held_out(found: IdentifiedShip) -> TextTable:
    names = [n for n in (*MODEL_OUTPUTS, "track") if any(n in v.rms for v in found.validations)]
    rows = []
    for each in found.validations:
        cells = [_shown(each.rms[n], UNIT[n]) if n in each.rms else "" for n in names]
        seconds = f"{(len(each.segment) - 1) * each.segment.dt_secs:.0f}"
        end = np.hypot(*(each.track[-1] - each.measured_track[-1]))
        last = f"{end:.3g}" if isfinite(end) else ""
        rows.append((each.segment.name, seconds, *cells, last))
    columns = ("held out", "length\n[s]", *map(_headed, names), "at the end\n[m]")
    remark = (
        "Simulated open loop from how each run began, under its rudder and revolutions: the rms of "
        "what is off."
    )
    return TextTable("Validation", columns, tuple(rows), (remark,))


def _figures(validation: Validation) -> TextTable:
    rows = tuple(_figure(figure) for figure in validation.figures)
    columns = ("figure", "measured", "simulated", "off", "off [%]")
    remark = "Counted from where the rudder leaves its rest by 0.5°."
    return TextTable(f"Figures of {validation.segment.name}", columns, rows, (remark,))


def _figure(figure: ManoeuvreIndex) -> tuple[str, ...]:
    """A row; of an angle no per cent are told."""
    unit = figure.unit
    cells = [_shown(v, unit, 4) for v in (figure.measured, figure.simulated)]
    cells.append(_shown(figure.error, unit))
    share = "" if unit == "rad" else f"{100 * figure.error / figure.measured:+.1f}"
    return (f"{figure.name} [{_unit(unit)}]", *cells, share if isfinite(figure.error) else "")


def _headed(name: str, what: str = "") -> str:
    return f"{name.replace('_', ' ')}{what}\n[{_unit(UNIT[name])}]"


def _unit(unit: str) -> str:
    return PEOPLES.get(unit, unit)


def _shown(value: float, unit: str, digits: int = 3) -> str:
    """A number in the unit people use."""
    return f"{value * conversion_factor(unit, _unit(unit)):.{digits}g}" if isfinite(value) else ""
