"""The tables of the study of prediction, as Markdown: errors beside their targets, and coverage."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from textwrap import fill

import numpy as np

from .prediction_results import IdentifiedTrials, PredictedIndex, PredictionStudy
from .reference_trials import (
    CIRCLE_INDICES,
    LOG_SECS,
    OVERSHOOTS,
    SETTINGS,
    SHIP_NAMES,
    ZIGZAGS_DEG,
)

TARGETS = {
    "advance": 3.0, "transfer": 6.0, "tactical diameter": 3.0, "time to 90°": 3.0,
    "time to 180°": 3.0, "steady yaw rate": 6.0, "steady speed": 6.0,
}  # %  # fmt: skip
OVERSHOOT_TARGET = 1.5  # degrees
PAGE_WIDTH = 100  # characters of a line of text
COVERAGE_TARGET = (90.0, 98.0)  # %, of the 95 % intervals
ORDINALS = ("first", "second")
OVERSHOOT_ROWS = {
    f"{angle:.0f}/{angle:.0f}, {ORDINALS[k]} overshoot": (f"{angle:.0f}/", f"overshoot {k + 1}")
    for angle in ZIGZAGS_DEG
    for k in range(OVERSHOOTS)
}
ROWS = (*CIRCLE_INDICES, *OVERSHOOT_ROWS)
SHIP_TITLES = {
    "mariner": "Mariner", "kvlcc2": "KVLCC2", "seiun-maru": "Seiun Maru",
    "container": "container ship", "tanker": "tanker",
}  # fmt: skip
INTRODUCTION = """
## Ships nobody tuned to

Five ships by their published equations (`examples/ships`), written apart from the models of
shiplog: the Mariner (Chislett and Strøm-Tejsen 1965), the KVLCC2 (Yasukawa and Yoshimura 2015) and
the Seiun Maru (Yoshimura and Masumoto 2012) by the MMG method, the container ship of Son and Nomoto
(1982) with roll, and the tanker of van Berlekom and Goddard (1972), which is unstable on a straight
course.

Each ship sails zig-zags 10/10 and 20/20, begun to starboard and to port: four logs of {minutes:.0f}
minutes at 2 Hz (poor sensors: 1 Hz) with speed through the water, yaw rate, heading, rudder,
revolutions and positions, random courses, and helm of 0.5° in the approach. Good sensors have white
noise of 0.05 m/s, 0.02 °/s, 0.1°, 0.1° and 1 m; poor ones of 0.15 m/s, 0.05 °/s, 0.3°, 0.3° and
3 m, and constant errors of the log, the gyro and the compass (standard deviations of 1 %, 0.01 °/s
and 0.5°). `identify` is given these logs and the ship's length, and selects the model (`--model
auto`). Compared are the standard manoeuvres that it predicts, with their intervals: the 35° circle
and the zig-zags 10/10 and 20/20, to both sides. The truth is the same manoeuvre of the reference
ship without sensors; its indices are computed from the exact motion and the known execute, apart
from the analysis.

**Protocol.** The model, its parameters and its intervals come from the zig-zags' logs alone. The
exact manoeuvres are sailed by the reference ship and used after the identification, to compute the
errors. The targets were set after errors of an earlier version on four such ships were known. Then
ships, settings, seeds and sensors were fixed before any error of this study was seen, but for a
short run of the Seiun Maru that tried the code. The KVLCC2 was known before: the model with three
degrees of freedom was developed on its model tests (above). The model `mmg` has the form of the
equations of the KVLCC2 and the Seiun Maru, and rests on publications that treat these ships; the
Mariner, the container ship and the tanker have equations of other forms. The errors before the
arrow were printed here while the models were being rebuilt, those after it have been since: later
changes of the models are not blind to these ships."""
READING = """
An error is the mean over both sides and all seeds, in % of the true value, of an overshoot in
degrees; in brackets the largest. It is in bold where the largest misses the target. `none`: the
predicted ship does not reach the index, which then has no interval either."""


def targets_text() -> str:
    """Describe the targets in one sentence."""
    by_limit: dict[float, list[str]] = {}
    for name, limit in TARGETS.items():
        by_limit.setdefault(limit, []).append(name)
    parts = [f"{', '.join(names)} within {limit:g} %" for limit, names in by_limit.items()]
    low, high = COVERAGE_TARGET
    return (
        f"Targets: {'; '.join(parts)}; overshoots within {OVERSHOOT_TARGET:g}°; the 95 % intervals "
        f"contain {low:g} to {high:g} % of the true values."
    )


def row_of(each: PredictedIndex) -> str:
    """Return the row of `ROWS` that an index belongs to."""
    for row, (angles, index) in OVERSHOOT_ROWS.items():
        if each.manoeuvre.startswith(angles) and each.index == index:
            return row
    return each.index


def limit_of(row: str) -> float:
    """Return the target of a row, % or degrees."""
    return TARGETS.get(row, OVERSHOOT_TARGET)


def errors_by_row(results: Sequence[IdentifiedTrials]) -> dict[str, list[float]]:
    """Collect the errors of all predictions; inf where the index was not reached."""
    errors: dict[str, list[float]] = {row: [] for row in ROWS}
    for each in chain.from_iterable(result.predictions for result in results):
        if np.isfinite(each.true):
            errors[row_of(each)].append(each.error if np.isfinite(each.error) else np.inf)
    return errors


def coverage(results: Sequence[IdentifiedTrials]) -> tuple[float, int]:
    """Return the share of intervals that contain the true value, %, and how many there are."""
    predictions = chain.from_iterable(result.predictions for result in results)
    inside = [
        each.low <= each.true <= each.high
        for each in predictions
        if np.isfinite([each.true, each.low, each.high]).all()
    ]
    return (100.0 * float(np.mean(inside)) if inside else np.nan), len(inside)


def within_targets(results: Sequence[IdentifiedTrials]) -> tuple[int, int]:
    """Count the predictions within their targets, and all predictions."""
    errors = errors_by_row(results)
    met = sum(abs(e) <= limit_of(row) for row, each in errors.items() for e in each)
    return met, sum(map(len, errors.values()))


def error_cell(errors: Sequence[float], limit: float) -> str:
    """Return the mean error and the largest; in bold if the largest exceeds the limit."""
    if not errors:
        return ""
    reached = [error for error in errors if np.isfinite(error)]
    missing = len(errors) - len(reached)
    text = f"{np.mean(reached):+.1f} ({np.abs(reached).max():.1f})" if reached else "none"
    if missing and reached:
        text += f", {missing} of {len(errors)} not reached"
    missed = missing or np.abs(reached).max() > limit
    return f"**{text}**" if missed else text


def _share_cell(results: Sequence[IdentifiedTrials]) -> str:
    met, total = within_targets(results)
    return f"{met} of {total}"


def _coverage_cell(results: Sequence[IdentifiedTrials]) -> str:
    share, count = coverage(results)
    if not count:
        return "no intervals"
    low, high = COVERAGE_TARGET
    text = f"{share:.0f} % of {count}"
    return text if low <= share <= high else f"**{text}**"


def _coverage_of_ship_cell(results: Sequence[IdentifiedTrials]) -> str:
    """Return the share, in bold where it is low: few errors of one ship may all be in it."""
    cell = _coverage_cell(results)
    return cell.strip("*") if coverage(results)[0] > COVERAGE_TARGET[0] else cell


def _models_cell(results: Sequence[IdentifiedTrials]) -> str:
    counts = Counter(result.model or "refused" for result in results)
    return ", ".join(f"{name} {n}" if len(counts) > 1 else name for name, n in counts.items())


def setting_table(results: Sequence[IdentifiedTrials]) -> list[tuple[str, ...]]:
    """Return the rows of a table with a column for each ship; the first row is the heading."""
    ships = [name for name in SHIP_NAMES if any(each.ship == name for each in results)]
    by_ship = [[each for each in results if each.ship == name] for name in ships]
    errors = [errors_by_row(each) for each in by_ship]
    rows = [("error", "target", *(SHIP_TITLES[name] for name in ships))]
    for row in ROWS:
        limit = limit_of(row)
        unit = "%" if row in TARGETS else "°"
        cells = (error_cell(each[row], limit) for each in errors)
        rows.append((row, f"{limit:g} {unit}".replace(" °", "°"), *cells))
    low, high = COVERAGE_TARGET
    rows.append(("within the target", "all", *map(_share_cell, by_ship)))
    rows.append(("95 % intervals", f"{low:g} to {high:g} %", *map(_coverage_of_ship_cell, by_ship)))
    rows.append(("model of the largest weight", "", *map(_models_cell, by_ship)))
    return rows


def _of_setting(results: Sequence[IdentifiedTrials], setting: str) -> list[IdentifiedTrials]:
    return [each for each in results if each.setting == setting]


def summary_table(
    results: Sequence[IdentifiedTrials], before: Sequence[IdentifiedTrials] = ()
) -> list[tuple[str, ...]]:
    """Return the median absolute error by setting, of earlier results before the arrow.

    Of the earlier results those count whose ship and setting are among the results.
    """
    settings = [name for name in SETTINGS if _of_setting(results, name)]
    measured = {(each.ship, each.setting) for each in results}
    before = [each for each in before if (each.ship, each.setting) in measured]

    def cells(of: Callable[[list[IdentifiedTrials]], str]) -> Iterator[str]:
        for setting in settings:
            now, then = (_of_setting(each, setting) for each in (results, before))
            yield f"{of(then).strip('*')} → {of(now)}" if then else of(now)

    rows = [("median absolute error", "target", *(SETTINGS[name].title for name in settings))]
    for row in ROWS:
        limit = limit_of(row)

        def median(of: list[IdentifiedTrials], row: str = row, limit: float = limit) -> str:
            errors = np.abs(errors_by_row(of)[row])
            value = float(np.median(errors)) if len(errors) else np.nan
            if np.isinf(value):
                return "**not reached**"
            return f"**{value:.1f}**" if value > limit else f"{value:.1f}"

        unit = " %" if row in TARGETS else "°"
        rows.append((row, f"{limit:g}{unit}", *cells(median)))
    rows.append(("within the target", "all", *cells(_share_cell)))
    low, high = COVERAGE_TARGET
    rows.append(("95 % intervals", f"{low:g} to {high:g} %", *cells(_coverage_cell)))
    ships = (len({each.ship for each in _of_setting(results, name)}) for name in settings)
    rows.append(("ships measured", str(len(SHIP_NAMES)), *map(str, ships)))
    return rows


def _markdown(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    for number, row in enumerate(rows):
        yield f"| {' | '.join(row)} |"
        if number == 0:
            yield "|---" * len(row) + "|"


def section_lines(study: PredictionStudy, before: PredictionStudy | None = None) -> Iterator[str]:
    """Yield the lines of the section of docs/accuracy.md.

    Parameters
    ----------
    study
        The results.
    before
        Those of an earlier version, to be printed beside them.
    """
    trials = study.trials
    yield INTRODUCTION.format(minutes=LOG_SECS / 60)
    yield f"\n{fill(targets_text(), PAGE_WIDTH)}\n"
    measured = f"Measured {study.measured_at} with {_seeds_text(trials)}"
    if before:
        measured += (
            f"; before the arrow an earlier version, measured {before.measured_at} with "
            f"{_seeds_text(before.trials)}"
        )
    yield fill(f"{measured}. The median over ships, sides and seeds:", PAGE_WIDTH) + "\n"
    yield from _markdown(summary_table(trials, before.trials if before else ()))
    yield READING
    for name, setting in SETTINGS.items():
        chosen = _of_setting(trials, name)
        if chosen:
            yield f"\n**{setting.title[0].upper()}{setting.title[1:]}**\n"
            yield from _markdown(setting_table(chosen))
    refused = [each for each in trials if each.refusal]
    if refused:
        yield "\nRefused:\n"
        for each in refused:
            case = f"{SHIP_TITLES[each.ship]}, {SETTINGS[each.setting].title}, seed {each.seed}"
            yield f"- {case}: {each.refusal}"


def _seeds_text(trials: Sequence[IdentifiedTrials]) -> str:
    seeds = sorted({each.seed for each in trials})
    return f"{'seed' if len(seeds) == 1 else 'seeds'} {', '.join(map(str, seeds))}"
