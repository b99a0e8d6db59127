"""Logs whose local positions are written as latitude and longitude."""

from dataclasses import replace

import numpy as np

from shiplog import TrialLog
from shiplog.geodesy import LocalFrame, LocalPositions
from shiplog.units import GEOGRAPHIC


def geographic_log(log: TrialLog, datum: tuple[float, float] = (60.0, 20.0)) -> TrialLog:
    """Return the log with its fixes as latitude and longitude, without altitude."""
    position = log["position"]
    north, east = position.values.T
    globe = LocalFrame(datum, geographic=True).to_geographic(LocalPositions(north, east))
    values = np.column_stack((globe.latitude, globe.longitude, np.full(len(position), np.nan)))
    fixes = replace(position, unit="deg", fields=GEOGRAPHIC, values=values)
    return replace(log, channels=tuple(fixes if c is position else c for c in log))


def with_fixes(log: TrialLog, rows: slice, values: object) -> TrialLog:
    """Return the log with other values of the first two components of some fixes."""
    position = log["position"]
    changed = position.values.copy()
    changed[rows, :2] = values
    fixes = replace(position, values=changed)
    return replace(log, channels=tuple(fixes if c is position else c for c in log))
