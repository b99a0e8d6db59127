"""Logs of sea trials: reading, writing, resampling, and vessel files.

A trial is one MCAP file, and in memory a `TrialLog`: one `Channel` per quantity and sensor, each
with its own times. `read` reads a log and `write` writes one; `LogWriter` writes samples as they
come; `open_log` also opens logs longer than memory, as a `LogFile` that yields chunks. `resample`
puts the channels on one uniform clock, as `Signals`. `load_vessel` reads a vessel file: the ship's
coefficients and the settings of a replay. All values are in SI units and radians, times are ns.

The package `analysis` builds on this one: state estimation, disturbances, identification, review.
The package `recorders` writes logs from sensors and simulations. ``shiplog --help`` lists the
verbs.

>>> import shiplog
>>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
>>> log["yaw_rate"]
Channel(/yaw_rate/simulated [rad/s], 6001 samples)
>>> signals = shiplog.resample(log, dt_secs=0.5, channels=("yaw_rate", "rudder"))
>>> signals["rudder"].shape
(1201,)
"""

from shiplog.mcap.reader import read
from shiplog.mcap.stream import LogFile, open_log
from shiplog.mcap.writer import LogWriter, write
from shiplog.vessel.vessel import Vessel
from shiplog.vessel.vessel_parser import load_vessel

from .errors import LayoutError, LogError, ShiplogError, UsageError, VesselError
from .progress import ProgressCallback
from .resampling import Clock, resample
from .types import Channel, Log, Signals, TrialLog
from .version import __version__

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
