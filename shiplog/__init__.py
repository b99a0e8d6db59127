"""Logs of sea trials: reading, writing, resampling, and vessel files.

A trial is one MCAP file, and in memory a `TrialLog`: one `Channel` per quantity and sensor, each
with its own times. `read` reads a log and `write` writes one; `LogWriter` writes samples as they
come; `open_log` also opens logs longer than memory, as a `LogFile` that yields chunks. `resample`
puts the channels on one uniform clock, as `Signals`. `load_vessel` reads a vessel file: the ship's
coefficients and the settings of a replay. All values are in SI units and radians, times are ns.

The package `analysis` builds on this one: state estimation, disturbances, identification, review.
The package `recorders` writes logs from sensors and simulations. ``shiplog --help`` lists the
verbs.

The names are imported when they are first used, so that ``import shiplog`` costs nothing.

>>> import shiplog
>>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
>>> log["yaw_rate"]
Channel(/yaw_rate/simulated [rad/s], 6001 samples)
>>> signals = shiplog.resample(log, dt_secs=0.5, channels=("yaw_rate", "rudder"))
>>> signals["rudder"].shape
(1201,)
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .version import __version__

if TYPE_CHECKING:
    from shiplog.mcap.reader import read
    from shiplog.mcap.stream import LogFile, open_log
    from shiplog.mcap.writer import LogWriter, write
    from shiplog.vessel.vessel import Vessel
    from shiplog.vessel.vessel_parser import load_vessel

    from .errors import LayoutError, LogError, ShiplogError, UsageError, VesselError
    from .progress import ProgressCallback
    from .resampling import Clock, resample
    from .types import Channel, Log, Signals, TrialLog

_MODULES = {
    "Channel": "types",
    "Clock": "resampling",
    "LayoutError": "errors",
    "Log": "types",
    "LogError": "errors",
    "LogFile": "mcap.stream",
    "LogWriter": "mcap.writer",
    "ProgressCallback": "progress",
    "ShiplogError": "errors",
    "Signals": "types",
    "TrialLog": "types",
    "UsageError": "errors",
    "Vessel": "vessel.vessel",
    "VesselError": "errors",
    "load_vessel": "vessel.vessel_parser",
    "open_log": "mcap.stream",
    "read": "mcap.reader",
    "resample": "resampling",
    "write": "mcap.writer",
}

__all__ = [
    "Channel",
    "Clock",
    "LayoutError",
    "Log",
    "LogError",
    "LogFile",
    "LogWriter",
    "ProgressCallback",
    "ShiplogError",
    "Signals",
    "TrialLog",
    "UsageError",
    "Vessel",
    "VesselError",
    "__version__",
    "load_vessel",
    "open_log",
    "read",
    "resample",
    "write",
]


def __getattr__(name: str) -> object:
    """Import a public name on its first use."""
    if name not in _MODULES:
        raise AttributeError(f"module 'shiplog' has no attribute {name!r}")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)
