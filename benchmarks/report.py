"""What was measured, as tables on a terminal, as JSON, and as Markdown."""

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table

from .measure import Result
from .replays import MOST_MEMORY, STEEPEST, Growth, Length


@dataclass
class Report:
    """All that a run tells, as it comes."""

    machine: dict[str, str]
    hours: float
    rounds: int
    results: list[Result]
    our_stages: dict[str, float] = field(default_factory=dict)  # seconds
    peer_stages: dict[str, float] = field(default_factory=dict)
    growth: Growth | None = None

    def as_json(self) -> dict[str, Any]:
        """The same as plain values."""
        return asdict(self)


@dataclass(frozen=True)
class _Grid:
    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    remarks: tuple[str, ...] = ()


def show(report: Report) -> None:
    """On the terminal."""
    wide = None if sys.stdout.isatty() else 140  # a file has no width of its own
    console = Console(highlight=False, markup=False, width=wide)
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


def markdown(report: Report) -> str:
    """The same for a page."""
    return "\n".join(_markdown(grid) for grid in _grids(report))


def _markdown(grid: _Grid) -> str:
    def row(cells: tuple[str, ...]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    under = ("---", *("---:" for _ in grid.columns[1:]))
    rows = "\n".join(row(cells) for cells in (grid.columns, under, *grid.rows))
    remarks = "".join(f"\n{remark}\n" for remark in grid.remarks)
    return f"## {grid.title}\n\n{rows}\n{remarks}"


def _grids(report: Report) -> list[_Grid]:
    grids = [_ratios(report)] if report.results else []
    if report.our_stages or report.peer_stages:
        grids.append(_stages(report))
    if report.growth is not None:
        grids.append(_growth(report.growth))
    grids.append(_Grid("Measured on", ("what", "is"), list(report.machine.items())))
    return grids


def _ratios(report: Report) -> _Grid:
    title = (
        f"{report.hours:g} h of four channels at 10 Hz: medians of {report.rounds} "
        f"{'round' if report.rounds == 1 else 'rounds'}"
    )
    columns = ("work", "against", "ours [s]", "peer [s]", "ratio", "held to", "", "note")
    rows = []
    for r in report.results:
        if r.ratio is None:
            figures = ("", "", "", _held_to(r), "skipped", r.skipped)
        else:
            figures = (
                _figure(r.ours_secs), _figure(r.peer_secs), f"{_figure(r.ratio)} x", _held_to(r),
                _met(r.met), r.note,
            )  # fmt: skip
        rows.append((r.work, r.against, *figures))
    remark = (
        "The ratio is the peer's time over ours; held to `at most`, it is ours over the peer's."
    )
    return _Grid(title, columns, rows, (remark,))


def _stages(report: Report) -> _Grid:
    both = (report.our_stages, report.peer_stages)
    names = dict.fromkeys(name for stages in both for name in stages)
    rows = [(name, *(_figure(stages.get(name)) for stages in both)) for name in names]
    rows.append(("in all", *(_figure(sum(stages.values()) or None) for stages in both)))
    return _Grid(
        f"The stages of a replay of {report.hours:g} h",
        ("stage", "ours [s]", "the obvious way [s]"),
        rows,
        ("Ours with Python started and loops loaded; the obvious way's scaled to the whole log.",),
    )


def _growth(growth: Growth) -> _Grid:
    columns = ("hours", "messages", "log [MB]", "time [s]", "peak memory [MiB]", "review [MB]")
    remarks = []
    if growth.exponent is not None:
        fitted = ", ".join(f"{hours:g}" for hours in growth.fitted_hours)
        remarks.append(
            f"Time grows with length to the power {growth.exponent:.3f} (of {fitted} h); "
            f"held to at most {STEEPEST:g} from a day on: "
            f"{_met(growth.exponent_met) or 'not measured'}."
        )
    remarks.append(
        f"Memory under {MOST_MEMORY / 2**30:g} GiB: {_met(growth.memory_met) or 'not measured'}."
    )
    return _Grid("How a replay grows", columns, list(map(_grown, growth.lengths)), tuple(remarks))


def _grown(length: Length) -> tuple[str, ...]:
    head = (f"{length.hours:g}", f"{length.messages:,}")
    if length.secs is None:
        return (*head, "", f"skipped: {length.skipped}", "", "")
    peak = "not told" if length.peak_bytes is None else f"{length.peak_bytes / 2**20:.0f}"
    return (
        *head,
        f"{length.log_bytes / 1e6:.1f}",
        _figure(length.secs),
        peak,
        f"{length.review_bytes / 1e6:.1f}",
    )


def _held_to(result: Result) -> str:
    if result.at_least is not None:
        return f"at least {result.at_least:g}"
    return "" if result.at_most is None else f"at most {result.at_most:g}"


def _met(met: bool | None) -> str:
    return "" if met is None else "met" if met else "missed"


def _figure(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"
