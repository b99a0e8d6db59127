"""Prediction of ships nobody tuned to: identified from zig-zags, tried on circles and zig-zags.

    python -m benchmarks.prediction --seeds 3 --json results.json

Reference ships by their published equations (`benchmarks.reference_trials`) sail zig-zags with
sensors; `identify` selects and fits a model to the logs; the model predicts the exact manoeuvres.
Prints a section of docs/accuracy.md. A run of one seed takes twenty minutes on two cores: the
results are written to the JSON file as they are measured, and `--results` prints the section from
such files.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from analysis.identification.identified_ship import IdentifiedShip
from analysis.identification.identify import identify
from analysis.replay.reading_options import ReadingOptions
from shiplog import ShiplogError

from .prediction_results import (
    IdentifiedTrials,
    PredictedIndex,
    PredictionStudy,
    joined,
    load_study,
    save_study,
    study_now,
)
from .prediction_tables import section_lines
from .reference_trials import (
    LOG_SECS,
    SETTINGS,
    SHIP_NAMES,
    ExactManoeuvre,
    exact_manoeuvres,
    reference_ship,
    zigzag_logs,
)

SEEDS, FIRST_SEED = 3, 1
SHORT_SHIP = "seiun-maru"  # the fastest to turn


@dataclass(frozen=True)
class StudySize:
    """What a study covers: ships and settings by name, seeds, and the duration of the logs."""

    ships: Sequence[str] = SHIP_NAMES
    settings: Sequence[str] = tuple(SETTINGS)
    seeds: Sequence[int] = tuple(range(FIRST_SEED, FIRST_SEED + SEEDS))
    log_secs: float = LOG_SECS
    interval: float | None = None
    model: str = "auto"


ONE_SEED_STUDY = StudySize(seeds=(FIRST_SEED,))
SHORT_STUDY = StudySize((SHORT_SHIP,), ("no sway",), (FIRST_SEED,), 240.0, 2.0)


def measure_predictions(size: StudySize) -> Iterator[IdentifiedTrials]:
    """Yield the predictions of each ship, in each setting, of each seed."""
    manoeuvres = {name: tuple(exact_manoeuvres(reference_ship(name))) for name in size.ships}
    for seed in size.seeds:
        for setting in size.settings:
            for name in size.ships:
                yield _identified(name, setting, seed, size, manoeuvres[name])


def _identified(
    name: str, setting: str, seed: int, size: StudySize, manoeuvres: Sequence[ExactManoeuvre]
) -> IdentifiedTrials:
    reference = reference_ship(name)
    logs = zigzag_logs(reference, SETTINGS[setting], seed, size.log_secs, size.interval)
    ship, refusal, started = None, "", process_time()
    try:
        ship = identify(logs, size.model, options=ReadingOptions(length=reference.length))
    except ShiplogError as error:
        refusal = str(error)
    secs = process_time() - started
    predictions = [each for m in manoeuvres for each in _predictions(ship, m)]
    model = ship.model.name if ship else ""
    return IdentifiedTrials(name, setting, seed, model, secs, refusal, tuple(predictions))


def _predictions(
    ship: IdentifiedShip | None, manoeuvre: ExactManoeuvre
) -> Iterator[PredictedIndex]:
    values = predicted_values(ship, manoeuvre) if ship else {}
    for index, true in manoeuvre.indices.items():
        value, low, high = values.get(index, (np.nan, np.nan, np.nan))
        yield PredictedIndex(manoeuvre.name, index, true, value, low, high)


def predicted_values(
    ship: IdentifiedShip, manoeuvre: ExactManoeuvre
) -> dict[str, tuple[float, float, float]]:
    """Predict a manoeuvre: the one function through which the study uses an identified ship.

    Returns
    -------
    values
        By index, its value and the ends of its 95 % interval, SI; NaN for what is not known.
    """
    wanted = manoeuvre.steering.angle, manoeuvre.steering.switch or 0.0
    for each in ship.predictions:
        if np.allclose((each.manoeuvre.rudder, each.manoeuvre.switch or 0.0), wanted):
            return {index.name: (index.value, index.low, index.high) for index in each.indices}
    return {}


def measure_study(size: StudySize, path: Path | None = None) -> PredictionStudy:
    """Measure, report each identification on stderr, and write the results as they are made."""
    trials: list[IdentifiedTrials] = []
    for each in measure_predictions(size):
        trials.append(each)
        outcome = each.model or f"refused: {each.refusal}"
        line = f"seed {each.seed}, {each.setting}, {each.ship}: {outcome}, {each.secs:.0f} s"
        print(line, file=sys.stderr, flush=True)
        if path:
            save_study(path, study_now(trials))
    return study_now(trials)


def main() -> None:
    """Measure, or read results, and print the section."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.prediction", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"seeds (default: {SEEDS})")
    parser.add_argument(
        "--first-seed", type=int, default=FIRST_SEED, help=f"the first (default: {FIRST_SEED})"
    )
    parser.add_argument("--short", action="store_true", help="one ship, short logs: a minute")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results as JSON")
    parser.add_argument(
        "--results", type=Path, nargs="+", metavar="FILE", help="print these instead of measuring"
    )
    parser.add_argument("--before", type=Path, metavar="FILE", help="earlier results beside them")
    arguments = parser.parse_args()
    if arguments.results:
        study = joined(map(load_study, arguments.results))
    else:
        seeds = tuple(range(arguments.first_seed, arguments.first_seed + arguments.seeds))
        study = measure_study(
            SHORT_STUDY if arguments.short else StudySize(seeds=seeds), arguments.json
        )
    before = load_study(arguments.before) if arguments.before else None
    print("\n".join(section_lines(study, before)))


if __name__ == "__main__":
    main()
