"""Screening: a log as its users take it, with one source of each quantity and no unusable value.

`screen_log` decides from statistics of the whole log what is used; a `ScreenedLog` applies the
decisions chunk by chunk. Replay and identification read every log through it. Imports nothing of
`shiplog.tables`, `shiplog.resampling` or `shiplog.vessel`.
"""

from .screen import screen_log, screen_values
from .screened_log import ScreenedLog, Screening

__all__ = ["ScreenedLog", "Screening", "screen_log", "screen_values"]
