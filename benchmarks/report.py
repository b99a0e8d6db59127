"""The results of the benchmarks as tables on a terminal, as JSON, and as Markdown."""

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table

from .distortion_matrix import OUTCOMES, SILENT, MatrixResults
from .measure import ComparisonResult
from .prediction_results import PredictionStudy, study_as_plain
from .prediction_tables import setting_table, summary_table
from .reference_trials import SETTINGS
from .replays import MAX_GROWTH_EXPONENT, MAX_MEMORY_BYTES, Growth, ReplayCost

FILE_WIDTH = 140  # characters, where the output is not a terminal


@dataclass
class BenchmarkReport:
    """All results of a run, filled as they are measured.

    Attributes
    ----------
    machine
        The machine and the versions of the libraries.
    hours
        The length of the log.
    rounds
        How often each comparison is timed.
    results
        The comparisons.
    our_stages, peer_stages
        Seconds that a replay spends in each stage.
    growth
        How the cost of a replay grows; None if not measured.
    distortions
        Replays of distorted logs; None if not measured.
    prediction
        Predictions of the reference ships; None if not measured.
    """

    machine: dict[str, str]
    hours: float
    rounds: int
    results: list[ComparisonResult]
    our_stages: dict[str, float] = field(default_factory=dict)
    peer_stages: dict[str, float] = field(default_factory=dict)
    growth: Growth | None = None
    distortions: MatrixResults | None = None
    prediction: PredictionStudy | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the report as plain values for JSON."""
        prediction = study_as_plain(self.prediction) if self.prediction else None
        return {**asdict(self), "prediction": prediction}


@dataclass(frozen=True)
class _Grid:
    """A table with a title, and remarks below it."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    remarks: tuple[str, ...] = ()


def print_report(report: BenchmarkReport) -> None:
    """Print the tables of a report on the terminal."""
    width = None if sys.stdout.isatty() else FILE_WIDTH
    console = Console(highlight=False, markup=False, width=width)
    for grid in _grids(report):
        table = Table(title=grid.title, title_justify="left")
        for i, column in enumerate(grid.columns):
            table.add_column(column, justify="left" if i == 0 else "right", overflow="fold")
        for row in grid.rows:
            table.add_row(*row)
        console.print(table)
        for remark in grid.remarks:
            console.print(remark)
        console.print()


def report_as_markdown(report: BenchmarkReport) -> str:
    """Return the tables of a report as Markdown."""
    return "\n".join(_grid_as_markdown(grid) for grid in _grids(report))


def _grid_as_markdown(grid: _Grid) -> str:
    def row(cells: tuple[str, ...]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    under = ("---", *("---:" for _ in grid.columns[1:]))
    rows = "\n".join(row(cells) for cells in (grid.columns, under, *grid.rows))
    remarks = "".join(f"\n{remark}\n" for remark in grid.remarks)
    return f"## {grid.title}\n\n{rows}\n{remarks}"


def _grids(report: BenchmarkReport) -> list[_Grid]:
    grids = [_ratio_grid(report)] if report.results else []
    if report.our_stages or report.peer_stages:
        grids.append(_stage_grid(report))
    if report.growth is not None:
        grids.append(_growth_grid(report.growth))
    if report.distortions is not None:
        grids.append(_distortion_grid(report.distortions))
    if report.prediction is not None:
        grids += _prediction_grids(report.prediction)
    grids.append(_Grid("Measured on", ("item", "value"), list(report.machine.items())))
    return grids


def _ratio_grid(report: BenchmarkReport) -> _Grid:
    title = (
        f"{report.hours:g} h of four channels at 10 Hz: medians of {report.rounds} "
        f"{'round' if report.rounds == 1 else 'rounds'}"
    )
    columns = ("work", "against", "ours [s]", "peer [s]", "ratio", "limit", "", "note")
    rows = []
    for r in report.results:
        if r.ratio is None:
            cells = ("", "", "", str(r.limit), "skipped", r.skipped)
        else:
            cells = (
                _figure(r.ours_secs), _figure(r.peer_secs), f"{_figure(r.ratio)} x", str(r.limit),
                _met(r.met), r.note,
            )  # fmt: skip
        rows.append((r.work, r.against, *cells))
    remark = (
        "The ratio is the peer's time over ours; with a limit `at most`, it is ours over the "
        "peer's. A limit in s is one on our own time."
    )
    return _Grid(title, columns, rows, (remark,))


def _stage_grid(report: BenchmarkReport) -> _Grid:
    both = (report.our_stages, report.peer_stages)
    names = dict.fromkeys(name for stages in both for name in stages)
    rows = [(name, *(_figure(stages.get(name)) for stages in both)) for name in names]
    rows.append(("total", *(_figure(sum(stages.values()) or None) for stages in both)))
    remark = (
        "Our times do not include the start of Python and the loading of compiled loops; those of "
        "the straightforward way are scaled to the whole log."
    )
    title = f"The stages of a replay of {report.hours:g} h"
    return _Grid(title, ("stage", "ours [s]", "straightforward [s]"), rows, (remark,))


def _growth_grid(growth: Growth) -> _Grid:
    columns = ("hours", "messages", "log [MB]", "time [s]", "peak memory [MiB]", "review [MB]")
    remarks = []
    if growth.exponent is not None:
        fitted = ", ".join(f"{hours:g}" for hours in growth.fitted_hours)
        remarks.append(
            f"Time grows with length to the power {growth.exponent:.3f} (fitted to {fitted} h); "
            f"limit from a day on: at most {MAX_GROWTH_EXPONENT:g}, "
            f"{_met(growth.exponent_met) or 'not measured'}."
        )
    remarks.append(
        f"Memory, limit {MAX_MEMORY_BYTES / 2**30:g} GiB: "
        f"{_met(growth.memory_met) or 'not measured'}."
    )
    rows = list(map(_cost_row, growth.costs))
    return _Grid("How the cost of a replay grows", columns, rows, tuple(remarks))


def _cost_row(cost: ReplayCost) -> tuple[str, ...]:
    head = (f"{cost.hours:g}", f"{cost.messages:,}")
    if cost.secs is None:
        return (*head, "", f"skipped: {cost.skipped}", "", "")
    peak = "not reported" if cost.peak_bytes is None else f"{cost.peak_bytes / 2**20:.0f}"
    return (
        *head,
        f"{cost.log_bytes / 1e6:.1f}",
        _figure(cost.secs),
        peak,
        f"{cost.review_bytes / 1e6:.1f}",
    )


def _met(met: bool | None) -> str:
    return "" if met is None else "met" if met else "missed"


def _figure(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def _distortion_grid(results: MatrixResults) -> _Grid:
    rows = [(family, *map(str, counts)) for family, counts in results.counts.items()]
    silent, alarms = results.counts["total"][OUTCOMES.index(SILENT)], results.false_alarms
    summary = (
        f"{silent} silent wrong results; {len(alarms)} warnings of {results.trials} undistorted "
        "trials."
    )
    remarks = (summary, *results.failures, *alarms)
    title = f"{sum(results.counts['total'])} replays and identifications of a distorted trial"
    return _Grid(title, ("distortion", *OUTCOMES), rows, remarks)


def _prediction_grids(study: PredictionStudy) -> list[_Grid]:
    head, *rows = (_without_bold(row) for row in summary_table(study.trials))
    grids = [_Grid("Predictions of ships nobody tuned to", head, rows)]
    for name, setting in SETTINGS.items():
        chosen = [each for each in study.trials if each.setting == name]
        if chosen:
            head, *rows = (_without_bold(row) for row in setting_table(chosen))
            remark = "mean error over both sides, in brackets the largest; † beyond the target"
            grids.append(_Grid(f"Predictions, {setting.title}", head, rows, (remark,)))
    return grids


def _without_bold(row: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{cell.strip('*')} †" if cell.startswith("**") else cell for cell in row)
