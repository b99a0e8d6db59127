"""The verbs: record, info, replay, identify, check, convert.

Results go to stdout, everything else to stderr. Exit codes: 0 fine, 1 failure, 2 usage,
3 finished, but data were lost. Whatever is heavy is imported by the verb that needs it.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.errors import ShiplogError, UsageError
from shiplog.files import atomic_write, is_device

from .arguments import gust, known, parser, random_forcing, replay_settings, settings, sources, wave

if TYPE_CHECKING:
    from collections.abc import Callable

    from analysis.report.section import Section
FINE, FAILURE, USAGE, DATA_LOST = 0, 1, 2, 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; the exit code says how it went."""
    grammar = parser()
    parsed = grammar.parse_args(arguments)
    if "verb" not in parsed:
        grammar.print_help(sys.stderr)
        return USAGE
    try:
        code = _VERBS[parsed.verb](parsed)
        sys.stdout.flush()
    except UsageError as error:
        code = _fail(error, USAGE)
    except ShiplogError as error:
        code = _fail(error, FAILURE)
    except BrokenPipeError:  # the reader of our output has gone: no matter
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = FINE
    except OSError as error:
        code = _fail(f"cannot write the output: {error.strerror or error}", FAILURE)
    except KeyboardInterrupt:
        code = _fail("interrupted; no output is half-written", FAILURE)
    return code


def _fail(error: object, code: int) -> int:
    print(f"shiplog: {' '.join(str(error).split())}", file=sys.stderr)
    return code


def _run_simulate(arguments: argparse.Namespace) -> int:
    _require_ours("recorders")
    from recorders.record import record
    from recorders.simulated.sensors import suite
    from recorders.simulated.simulate import simulate
    from recorders.simulated.trajectory import Gust, RandomForcing, WaveMoment
    from shiplog.mcap.writer import write
    from shiplog.vessel.vessel_parser import load_vessel

    _require_distinct([arguments.output, arguments.truth], [arguments.vessel])
    _require_suffix(".mcap", arguments.output, arguments.truth)
    vessel, text = load_vessel(arguments.vessel)
    with _progress("recorders") as tell:
        tell("sail and measure")
        trial = simulate(
            vessel,
            arguments.manoeuvre,
            duration_secs=arguments.duration,
            seed=arguments.seed,
            sensors=suite(
                arguments.noise, settings(arguments.sensor), angle_unit=vessel.angle_unit
            ),
            gusts=tuple(Gust(*gust(said)) for said in arguments.gust),
            wave=WaveMoment(*wave(arguments.wave)) if arguments.wave else None,
            random_forcing=None
            if arguments.random_forcing is None
            else RandomForcing(*random_forcing(arguments.random_forcing)),
            vessel_toml=text,
        )
        tell("write")
        recorded = record(trial, arguments.output, on_chunk=lambda n: tell(f"write: {n} samples"))
        if arguments.truth and not recorded.interrupted:
            write(trial.truth(), arguments.truth)
    said = f"{arguments.output}: {recorded.samples} samples of {len(trial.channels)} channels"
    print(said, file=sys.stderr if is_device(Path(arguments.output)) else sys.stdout)
    if recorded.interrupted:
        print("interrupted: the log ends there", file=sys.stderr)
    return FINE


def _run_info(arguments: argparse.Namespace) -> int:
    from shiplog.mcap.info import read_log_info

    _require_distinct([arguments.json], [arguments.log])
    found = read_log_info(arguments.log)
    if arguments.json:
        _write_json(found.to_dict(), arguments.json)
        return DATA_LOST if found.data_lost else FINE
    print(f"{found.name}: {(found.end_ns - found.start_ns) * 1e-9:.1f} s")
    rows = [("topic", "samples", "unit", "positive")]
    rows += [(c.topic, str(c.samples), c.unit, c.positive) for c in found.channels]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    for topic, samples, unit, positive in rows:
        line = f"  {topic:<{widths[0]}}  {samples:>{widths[1]}}  {unit:<{widths[2]}}  {positive}"
        print(line.rstrip())
    for key, value in found.metadata.items():
        print(f"  {key}: {value}")
    print(f"  vessel.toml: {'attached' if found.has_vessel else 'none'}")
    _warn(found.warnings)
    return DATA_LOST if found.data_lost else FINE


def _run_replay(arguments: argparse.Namespace) -> int:
    _require_ours("analysis")
    from analysis.replay.plan import plan_replay
    from analysis.replay.replay import Replay
    from analysis.report.replay_json import replay_json
    from analysis.report.replay_tables import replay_markdown, replay_tables
    from shiplog.mcap.stream import open_log
    from shiplog.vessel.vessel_parser import load_vessel

    vessel = load_vessel(arguments.vessel)[0] if arguments.vessel else None
    if Path(arguments.log).suffix == ".rrd":
        raise UsageError(f"a review, not a log; open it with: rerun {arguments.log}")
    output = Path(arguments.output or f"{Path(arguments.log).stem}.rrd")
    _require_distinct([output, arguments.json], [arguments.log, arguments.vessel])
    _require_suffix(".rrd", output)
    chosen, preferred = replay_settings(arguments), sources(arguments.source)
    with _progress("analysis") as tell:
        tell("read")
        log = open_log(arguments.log).select_sources(preferred)
        try:
            plan = plan_replay(log, vessel, settings=chosen, on_progress=tell)
        except ShiplogError:
            _warn(log.warnings)  # they may explain it
            raise
        from analysis.view.replay_review import open_replay_review

        replay = Replay(log, plan, on_progress=tell)
        with open_replay_review(plan, output, full=arguments.full) as review:
            for chunk in replay.chunks():
                review.add(chunk)
            findings = replay.findings
            tell("review")
            review.finish(findings, replay_markdown(findings))
    if arguments.json:
        _write_json(replay_json(findings), arguments.json)
    _print_tables(replay_tables(findings), to_stderr=arguments.json == "-")
    _warn(findings.warnings)
    _show_review(output, view=arguments.view)
    return DATA_LOST if log.data_lost else FINE


def _show_review(path: str | Path, *, view: bool) -> None:
    print(f"review: {path} (open it with: rerun {path})", file=sys.stderr)
    if view:
        from analysis.view.viewer import view_review

        view_review(path)


def _run_identify(arguments: argparse.Namespace) -> int:
    _require_ours("analysis")
    from analysis.identification.identify import identify
    from analysis.identification.runs import require_distinct
    from analysis.identification.vessel_file import vessel_toml
    from analysis.report.identification_json import identification_json
    from analysis.report.identification_tables import identification_tables
    from shiplog.mcap.stream import open_log
    from shiplog.vessel.vessel_parser import load_vessel

    fitted, held_out = (
        [str(Path(path).resolve()) for path in paths]
        for paths in (arguments.log, arguments.validate)
    )
    require_distinct(fitted, held_out)
    review = arguments.review or ("identified.rrd" if arguments.view else None)
    outputs = [arguments.output, arguments.json, review]
    _require_distinct(outputs, [*fitted, *held_out, arguments.vessel])
    _require_suffix(".rrd", review)
    if arguments.output:
        _require_suffix(".toml", arguments.output)
    vessel = load_vessel(arguments.vessel)[0] if arguments.vessel else None
    with _progress("analysis") as tell:
        logs, validation_logs = (
            [open_log(path) for path in paths] for paths in (arguments.log, arguments.validate)
        )
        found = identify(
            logs,
            arguments.model,
            validation_logs=validation_logs,
            fixed=known(arguments.known),
            vessel=vessel,
            on_progress=tell,
        )
        text = vessel_toml(found, tell) if arguments.output else ""
    if arguments.output:
        with atomic_write(arguments.output) as part:
            part.write_text(text, encoding="utf-8")
    if arguments.json:
        _write_json(identification_json(found), arguments.json)
    if review:
        from analysis.view.identification_review import write_review

        write_review(found, review)
    _print_tables(identification_tables(found), to_stderr=arguments.json == "-")
    _warn(found.warnings)
    if review:
        _show_review(review, view=arguments.view)
    if arguments.output:
        unidentifiable = ", ".join(found.uncertainty.unidentifiable)
        said = (
            f"; not identifiable, and no more than what fits these logs: {unidentifiable}"
            if unidentifiable
            else ""
        )
        print(f"vessel file: {arguments.output}{said}", file=sys.stderr)
    return DATA_LOST if found.data_lost else FINE


def _run_check(arguments: argparse.Namespace) -> int:
    _require_ours("analysis")
    from analysis.check.compare import compare, comparison_json, logs_in, reference_path, update

    if arguments.update and os.environ.get("CI"):
        raise UsageError("references are not updated in CI; run it where somebody looks")
    comparisons = []
    logs = logs_in(arguments.path)
    _require_distinct([arguments.json], [*logs, *map(reference_path, logs)])
    with _progress("analysis") as tell:
        for log in logs:
            tell(log.name)
            comparisons.append(compare(log))
    for comparison in comparisons:
        print(comparison, file=sys.stderr if arguments.json == "-" else sys.stdout)
    if arguments.json:
        _write_json([comparison_json(comparison) for comparison in comparisons], arguments.json)
    if arguments.update:
        unusable = [c.name for c in comparisons if c.replay is None]
        if unusable:
            raise ShiplogError(
                f"no reference was updated: {', '.join(unusable)} cannot be replayed"
            )
        for log, comparison in zip(logs, comparisons, strict=True):
            update(log, comparison)
            print(f"updated: {reference_path(log)}", file=sys.stderr)
        return FINE
    for comparison in comparisons:
        if comparison.changed:
            from analysis.check.overlay import write_overlay

            overlay = Path(f"{Path(comparison.name).stem}.check.rrd")
            write_overlay(comparison, overlay)
            print(f"both, overlaid: {overlay}", file=sys.stderr)
    return FINE if all(comparison.ok for comparison in comparisons) else FAILURE


def _run_convert(arguments: argparse.Namespace) -> int:
    from shiplog.tables.convert import convert

    with _progress() as tell:
        tell(f"{arguments.source.name} to {arguments.target.name}")
        log, warnings = convert(arguments.source, arguments.target, arguments.layout)
    _warn(warnings)
    print(f"{arguments.target}: {sum(map(len, log))} samples of {len(log.channels)} channels")
    return DATA_LOST if log.data_lost else FINE


def _require_distinct(
    outputs: Sequence[str | Path | None], inputs: Sequence[str | Path | None]
) -> None:
    """Refuse to write over what is read, or over another output; devices may be shared."""
    written = [Path(path).resolve() for path in outputs if path and str(path) != "-"]
    written = [path for path in written if not is_device(path)]
    for path in written:
        if written.count(path) > 1 or path in [Path(p).resolve() for p in inputs if p]:
            raise UsageError(f"the same file is named twice; name another for the output: {path}")


def _require_suffix(suffix: str, *outputs: str | Path | None) -> None:
    """Refuse a name by which nobody would know what is in the file."""
    for path in (Path(output) for output in outputs if output):
        if path.suffix.lower() != suffix and not (is_device(path) or path.is_dir()):
            raise UsageError(f"what is written is a {suffix} file; call it so: {path}")


def _require_ours(package: str) -> None:
    """Refuse a folder called `recorders` or `analysis` that hides shiplog's own."""
    home = Path(__file__).resolve().parents[2]
    found = import_module(package)
    where = Path(found.__file__ or next(iter(found.__path__))).resolve()
    if home not in where.parents:
        raise ShiplogError(
            f"another package called {package!r} hides shiplog's own; "
            f"run from another folder or rename it: {where}"
        )


@contextmanager
def _progress(package: str | None = None) -> Iterator["Callable[..., None]"]:
    """Show on a terminal what is being done; the callable is told the step, and the share done.

    Where the loops of `package` were never compiled on this computer, it says so.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console, note = Console(stderr=True), ""
    if package:
        from shiplog.compiled import is_compiled

        note = "" if is_compiled(package) else " (first run: compiling the loops, once)"
    bar = BarColumn(bar_width=24)
    columns = (SpinnerColumn(), bar, TimeElapsedColumn(), TextColumn("{task.description}"))
    shown = console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=not shown) as progress:
        task = progress.add_task("", total=None)

        def tell(step: str, share: float | None = None) -> None:
            total = None if share is None else 1.0
            progress.update(task, description=f"{step}{note}", total=total, completed=share or 0.0)

        yield tell


def _print_tables(sections: Sequence["Section"], *, to_stderr: bool) -> None:
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    console = Console(stderr=to_stderr, highlight=False, markup=False)  # [deg] is a unit
    for section in sections:
        table = Table(title=section.title, title_justify="left", title_style="bold", box=SIMPLE)
        for i, column in enumerate(section.columns):
            table.add_column(column, justify="left" if i == 0 else "right", overflow="fold")
        for row in section.rows:
            table.add_row(*row)
        console.print(table)
        for remark in section.remarks:
            console.print(remark)
        console.print()


def _warn(warnings: Sequence[str]) -> None:
    for warning in warnings:
        print(f"warning: {warning}", file=sys.stderr)


def _write_json(value: object, where: str) -> None:
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if where == "-":
        sys.stdout.write(text)
        return
    with atomic_write(where) as part:
        part.write_text(text, encoding="utf-8")


_VERBS = {
    "simulate": _run_simulate,
    "info": _run_info,
    "replay": _run_replay,
    "identify": _run_identify,
    "check": _run_check,
    "convert": _run_convert,
}
