"""The estimation of a linear system as tables and sentences, for the terminal and for Rerun."""

from collections.abc import Iterable, Iterator
from math import pi

import numpy as np

from analysis.design.discrete_correction import sampled_poles
from analysis.design.observability import ComplexArray
from analysis.linear.estimate import EstimateFindings
from shiplog.text_table import TextTable
from shiplog.types import FloatArray

from .display import BAND_STDS
from .markdown import markdown_page
from .replay_tables import residual_remark, whiteness_cells

INNOVATION_REMARK = (
    "Innovation: measured minus predicted. NIS: its square over the variance that the estimator "
    "expects. ρ: the largest correlation of the innovations with those before."
)
FEEDBACK_REMARK = (
    "The feedback is computed beside the recorded motion and did not act on it; the predicted "
    "cost is that of the loop it would close, from the stated noise alone."
)
ROUNDING = 1e-6  # relative: rounding moves a double pole by as much as 1e-8


def estimate_tables(findings: EstimateFindings) -> tuple[TextTable, ...]:
    """Return the results of an estimation as tables, in the units of the system file.

    Returns
    -------
    tuple of TextTable
        Poles and gain of the estimator, regulator and costs, the residuals of the outputs, the
        estimated quantities.
    """
    return (
        *_design_tables(findings),
        *_spectrum_tables(findings),
        *_feedback_tables(findings),
        _residual_table(findings),
        _quantity_table(findings),
    )


def estimate_markdown(findings: EstimateFindings) -> str:
    """Return the results of an estimation as a page in Markdown."""
    title = f"{findings.plan.system.name}: {findings.plan.name}"
    return markdown_page(title, estimate_tables(findings), findings.warnings)


def _design_tables(findings: EstimateFindings) -> Iterator[TextTable]:
    plan = findings.plan
    design, system = plan.design, plan.system
    remarks = (*_method_remarks(findings), *design.remarks)
    if design.poles is None or design.gain is None:
        row = (system.method.name, str(len(plan.states)), f"{plan.clock.dt_secs:g}")
        columns: tuple[str, ...] = ("method", "number of states", "step [s]")
        yield TextTable(f"Estimator of {system.name!r}", columns, (row,), remarks)
        return
    poles = np.sort_complex(design.poles)
    rows = [(_complex(pole), *_time_cells(pole)) for pole in poles]
    columns = ("pole of A - L C\n[1/s]", "time constant\n[s]", "period\n[s]", "damping\nratio")
    yield TextTable(f"Estimator of {system.name!r}", columns, tuple(rows), remarks)
    yield _gain_table("Gain L", plan.states, system.plant.sensors, design.gain)
    if design.correction is None:
        return
    C, F = plan.model.C, plan.model.step.F
    sampled = np.sort_complex(sampled_poles(F, C, design.correction, plan.clock.dt_secs))
    finite = sampled[np.isfinite(sampled)]
    remark = f"Poles of the sampled estimator: {', '.join(map(_complex, finite))} 1/s"
    if len(finite) < len(sampled):
        remark += (
            f"; {len(sampled) - len(finite)} more at z = 0, whose errors vanish at each sample"
        )
    table = _gain_table(
        "Correction M at each sample", plan.states, system.plant.sensors, design.correction
    )
    yield TextTable(table.title, table.columns, table.rows, (f"{remark}.",))


def _spectrum_tables(findings: EstimateFindings) -> Iterator[TextTable]:
    if not findings.plan.fitted:
        return
    rows = [
        (each.noise, each.name, f"{each.value:.4g}", f"± {BAND_STDS * each.std:.2g}")
        for each in findings.plan.fitted
    ]
    remark = "Maximum likelihood of the innovations of the Kalman filter."
    yield TextTable(
        "Fitted spectra", ("coloured noise", "parameter", "value", "2σ"), tuple(rows), (remark,)
    )


def _feedback_tables(findings: EstimateFindings) -> Iterator[TextTable]:
    feedback, costs, system = findings.plan.feedback, findings.costs, findings.plan.system
    if feedback is None or costs is None:
        return
    poles = ", ".join(map(_complex, np.sort_complex(feedback.regulator.poles)))
    inputs = [binding.name for binding in system.inputs]
    gain = _gain_table("Regulator u = L x̂", inputs, system.plant.states, feedback.regulator.gain)
    remark = f"Poles of A + B L: {poles} 1/s."
    yield TextTable(gain.title, ("input", *gain.columns[1:]), gain.rows, (remark,))
    rows = [
        (name, *(f"{value:.4g}" for value in (cost.state, cost.input, cost.total)), *rms)
        for name, cost, rms in (
            ("recorded inputs", costs.recorded, _cells(costs.recorded_rms)),
            ("feedback on the estimate", costs.feedback, _cells(costs.feedback_rms)),
            ("closed loop, predicted", costs.predicted, [""] * len(inputs)),
        )
    ]
    units = (f"rms of {s.binding.name}\n[{s.unit}]" for s in findings.plan.inputs)
    columns = ("mean cost of", "states", "inputs", "both", *units)
    remarks = (
        "States: mean of x'P x of the estimate; inputs: of u'R u; in the units of the weights.",
        FEEDBACK_REMARK,
    )
    yield TextTable("Costs", columns, tuple(rows), remarks)


def _cells(values: Iterable[float]) -> list[str]:
    return [f"{value:.4g}" for value in values]


def _method_remarks(findings: EstimateFindings) -> Iterator[str]:
    plan = findings.plan
    smoothed = ", smoothed backwards from the end" if plan.smooth else ""
    kind = plan.system.method.name
    if plan.design.correction is None:
        kind += " with the optimal gain of each instant"
    size, dt = len(plan.states), plan.clock.dt_secs
    yield f"Method: {kind}{smoothed}, of order {size}; a step of {dt:g} s."
    if plan.system.linearise is not None:
        along = ", ".join(signal.binding.channel for signal in plan.schedule) or "the estimate"
        yield f"The plant is linearised along {along}; poles and gain are those at its rms values."


def _gain_table(
    title: str, states: Iterable[str], outputs: Iterable[str], gain: FloatArray
) -> TextTable:
    rows = [
        (name, *(f"{value:.8g}" for value in row)) for name, row in zip(states, gain, strict=True)
    ]
    return TextTable(title, ("state", *outputs), tuple(rows))


def _residual_table(findings: EstimateFindings) -> TextTable:
    plan, rows = findings.plan, []
    for residuals, std in zip(findings.residuals, plan.stds, strict=True):
        low, high = residuals.nis_band
        cells = (
            f"{residuals.name} [{residuals.unit}]",
            f"{std:.2g}",
            f"{residuals.rms:.2g}",
            f"{residuals.mean_nis:.3f}" if residuals.judged else "not judged",
            f"{max(low, 0.0):.2f}–{high:.2f}" if residuals.judged else "",
            *whiteness_cells(residuals)[:2],
        )
        rows.append(cells)
    columns = (
        "output", "noise\nstd", "rms", "mean\nNIS", "expected\n(99 %)", "white\np", "ρ",
    )  # fmt: skip
    origins = (
        f"{residuals.name} {'from the log' if measured else 'stated'}"
        for residuals, measured in zip(findings.residuals, plan.measured, strict=True)
    )
    remarks = (
        f"Noise of one measurement: {', '.join(origins)}.",
        INNOVATION_REMARK,
        *map(residual_remark, findings.residuals),
    )
    return TextTable("Innovations", columns, tuple(rows), remarks)


def _quantity_table(findings: EstimateFindings) -> TextTable:
    rows = [
        (
            each.name,
            each.unit,
            *(f"{value:.4g}" for value in (each.mean, each.rms, each.at_end)),
            f"± {BAND_STDS * each.std_at_end:.2g}",
        )
        for each in findings.summaries
    ]
    columns = ("quantity", "unit", "mean", "rms", "at the end", "2σ there")
    return TextTable("Estimates", columns, tuple(rows))


def _complex(pole: complex) -> str:
    if abs(pole.imag) <= ROUNDING * abs(pole):
        return f"{pole.real:.8g}"
    return f"{pole.real:.8g}{pole.imag:+.8g}j"


def _time_cells(pole: complex) -> tuple[str, str, str]:
    """Return time constant, period and damping ratio of a pole; empty where it has none."""
    time = f"{-1 / pole.real:.3g}" if pole.real else "∞"
    if abs(pole.imag) <= ROUNDING * abs(pole):
        return time, "", ""
    return time, f"{2 * pi / abs(pole.imag):.3g}", f"{-pole.real / abs(pole):.3g}"


def poles_as_pairs(poles: ComplexArray) -> list[list[float]]:
    """Return poles as pairs of real and imaginary part, sorted."""
    return [[float(pole.real), float(pole.imag)] for pole in np.sort_complex(poles)]
