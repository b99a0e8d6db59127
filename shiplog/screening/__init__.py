"""Screening: a log as its users take it, with one source of each quantity and no unusable value.

`screen_log` decides from statistics of the whole log what is used; a `ScreenedLog` applies the
decisions chunk by chunk. On demand a quantity that a log lacks is derived from another, and the
times of a late sensor are corrected. Replay and identification read every log through it. Imports
nothing of `shiplog.tables`, `shiplog.resampling` or `shiplog.vessel`.
"""

from .delayed_log import DelayedLog, SensorDelay
from .derivation_plan import DERIVED_FROM, plan_derivations
from .derived_log import Derivation, DerivedLog
from .screen import screen_log
from .screened_log import ScreenedLog, Screening
from .sensor_delays import StatedDelays, screen_without_delays
from .value_screen import screen_values

__all__ = [
    "DERIVED_FROM",
    "DelayedLog",
    "Derivation",
    "DerivedLog",
    "ScreenedLog",
    "Screening",
    "SensorDelay",
    "StatedDelays",
    "plan_derivations",
    "screen_log",
    "screen_values",
    "screen_without_delays",
]
