"""What a sea trial is, and how it is kept.

>>> import shiplog
>>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
>>> log["yaw_rate"].values.shape
(6001,)
"""

from shiplog.mcap.reader import read
from shiplog.mcap.stream import LogFile, open_log
from shiplog.mcap.writer import LogWriter, write
from shiplog.vessel.vessel import Vessel
from shiplog.vessel.vessel_parser import load_vessel

from .errors import LayoutError, LogError, ShiplogError, UsageError, VesselError
from .resampling import resample
from .types import Channel, Signals, TrialLog
from .version import __version__

__all__ = [
    "Channel",
    "LayoutError",
    "LogError",
    "LogFile",
    "LogWriter",
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
