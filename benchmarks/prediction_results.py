"""Results of the study of prediction: indices of manoeuvres, true and predicted, and their file."""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.files import atomic_write

DIGITS = 7  # of a saved number


@dataclass(frozen=True)
class PredictedIndex:
    """An index of a manoeuvre, SI.

    Attributes
    ----------
    manoeuvre, index
        The manoeuvre and the index.
    true, predicted
        The value of the exact motion and of the identified ship; NaN where it was not reached.
    low, high
        The identifier's 95 % interval; NaN where it returns none.
    """

    manoeuvre: str
    index: str
    true: float
    predicted: float
    low: float = np.nan
    high: float = np.nan

    @property
    def error(self) -> float:
        """The error in % of the true value, of an overshoot in degrees."""
        if self.index.startswith("overshoot"):
            return float(np.degrees(self.predicted - self.true))
        return 100.0 * (self.predicted / self.true - 1.0)


@dataclass(frozen=True)
class IdentifiedTrials:
    """A ship identified from one set of logs, and its predictions.

    Attributes
    ----------
    ship, setting, seed
        The reference ship, the key of `SETTINGS` and the seed of the logs.
    model
        The model selected; empty where the identification was refused.
    secs
        Processor time of the identification.
    refusal
        The reason of a refusal; empty where there was none.
    predictions
        The indices of all manoeuvres; NaN after a refusal.
    """

    ship: str
    setting: str
    seed: int
    model: str
    secs: float
    refusal: str
    predictions: tuple[PredictedIndex, ...]


@dataclass(frozen=True)
class PredictionStudy:
    """The results of a study.

    Attributes
    ----------
    measured_at
        Date and time, UTC, of the last result.
    trials
        The ships identified, in the order measured.
    """

    measured_at: str
    trials: tuple[IdentifiedTrials, ...]


def study_now(trials: Iterable[IdentifiedTrials]) -> PredictionStudy:
    """Return a study whose last result is measured now."""
    return PredictionStudy(datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"), tuple(trials))


def study_as_plain(study: PredictionStudy) -> dict[str, Any]:
    """Return a study as plain values for JSON: null instead of NaN, `DIGITS` significant digits."""
    plain = asdict(study)
    for trials in plain["trials"]:
        trials["secs"] = _rounded(trials["secs"])
        for prediction in trials["predictions"]:
            for name, value in prediction.items():
                if isinstance(value, float):
                    prediction[name] = _rounded(value)
    return plain


def _rounded(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None


def save_study(path: Path, study: PredictionStudy) -> None:
    """Write a study as JSON."""
    text = json.dumps(study_as_plain(study), ensure_ascii=False) + "\n"
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def load_study(path: Path) -> PredictionStudy:
    """Read a study that `save_study` wrote."""
    plain = json.loads(path.read_text(encoding="utf-8"))
    trials = []
    for row in plain["trials"]:
        predictions = tuple(map(_predicted_index, row["predictions"]))
        trials.append(IdentifiedTrials(**{**row, "predictions": predictions}))
    return PredictionStudy(plain["measured_at"], tuple(trials))


def _predicted_index(plain: dict[str, Any]) -> PredictedIndex:
    values: dict[str, Any] = {k: np.nan if v is None else v for k, v in plain.items()}
    return PredictedIndex(**values)


def joined(studies: Iterable[PredictionStudy]) -> PredictionStudy:
    """Return several studies as one, of the time of the latest."""
    listed = list(studies)
    latest = max(study.measured_at for study in listed)
    return PredictionStudy(latest, tuple(each for study in listed for each in study.trials))
