"""An index of a manoeuvre as plain numbers in SI, for JSON."""

from dataclasses import asdict
from typing import Any

from analysis.manoeuvres.trial_index import TrialIndex


def index_json(index: TrialIndex) -> dict[str, Any]:
    """Convert an index with its interval, its sources, its limit and its verdict.

    Parameters
    ----------
    index
        Measured or predicted.

    Returns
    -------
    dict
        Numbers in the unit that it names; what is not known is NaN.
    """
    return {
        "name": index.name,
        "symbol": index.symbol,
        "value": index.value,
        "unit": index.unit,
        "std": index.std,
        "interval_95": [index.low, index.high],
        "in_lengths": index.in_lengths,
        "sources": dict(index.sources),
        "start_rules": dict(index.start_rules),
        "criterion": asdict(index.criterion) if index.criterion else None,
        "verdict": str(index.verdict) if index.verdict else None,
        "probability": index.probability,
        "note": index.note,
    }
