"""What a sea trial is, and how it is kept.

>>> import shiplog
>>> log = shiplog.read("sample_data/zigzag_20_20.mcap")
>>> log["yaw_rate"].values
"""

__version__ = "0.1.0"

from .clock import resample
from .errors import LayoutError, LogError, ShiplogError, UsageError, VesselError
from .log_file import LogFile, open_log
from .reader import read
from .types import Channel, Signals, TrialLog
from .vessel import Vessel, load_vessel
from .writer import LogWriter, write

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
    "load_vessel",
    "open_log",
    "read",
    "resample",
    "write",
]
