"""Channels made of values and times in seconds."""

import numpy as np

from shiplog.types import Channel
from shiplog.units import CATALOGUE

START = 1_700_000_000 * 10**9

Values = np.ndarray[tuple[int], np.dtype[np.float64]]


def channel(
    values: Values, times: Values | None = None, name: str = "yaw_rate", lag: float = 0.0
) -> Channel:
    """Return a channel of 10 Hz, or of the given times (n,), s, received `lag` s later."""
    at = 0.1 * np.arange(len(values)) if times is None else times
    stamps = START + np.round(at * 1e9).astype(np.int64)
    unit = CATALOGUE[name].unit if name in CATALOGUE else "1"
    return Channel(name, "a", unit, stamps, stamps + int(lag * 1e9), values)
