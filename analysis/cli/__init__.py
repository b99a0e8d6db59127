"""The verbs of the analysis: replay, identify, estimate, check, report, view.

A module for each; what a verb computes is imported when it runs. Nothing imports this folder but
the entry points of `shiplog.verbs`.
"""

from .check_verb import CHECK
from .estimate_verb import ESTIMATE
from .identify_verb import IDENTIFY
from .replay_verb import REPLAY
from .report_verb import REPORT
from .view_verb import VIEW

__all__ = ["CHECK", "ESTIMATE", "IDENTIFY", "REPLAY", "REPORT", "VIEW"]
