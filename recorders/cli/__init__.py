"""The verbs of the recorders, and what they show of a live recording.

Imports everything else of `recorders`; nothing imports it.
"""

from .decode_verb import DECODE
from .mark_verb import MARK
from .record_verb import RECORD

__all__ = ["DECODE", "MARK", "RECORD"]
