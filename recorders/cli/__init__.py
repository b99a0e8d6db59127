"""The verbs of the recorders, and what they show of a live recording.

Imports everything else of `recorders`; nothing imports it.
"""

from .mark_verb import MARK
from .record_verb import RECORD

__all__ = ["MARK", "RECORD"]
