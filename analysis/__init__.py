"""Replay and identification of sea trials.

analyse
    Replay a log: states, disturbances, coefficients, residuals, as one `Analysis`.
plan_replay, Replay
    The same in chunks, for logs longer than memory: the plan first, then the replay.
estimate
    Estimate the states of any linear system, given by a system file, from a log.
identify
    Fit a ship model to one or several logs, with intervals and validation.
analyse_trial
    Find the manoeuvres in a log: indices with intervals, and verdicts of the norm.
ReadingOptions
    The vessel, the sources and the strictness with which these read a log.
report_trials, report_page
    Compare the manoeuvres of trials with IMO's standards, on a page to sign.
compare
    Compare a replay with its reference.

The names are imported when they are first used, so that ``import analysis`` costs nothing.

Examples
--------
>>> from analysis import analyse
>>> analysis = analyse("sample_data/zigzag_20_20.mcap")
>>> analysis.estimates.states.shape  # yaw rate, its two derivatives, speed, its derivative
(6001, 5)
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.check.compare import Comparison, compare
    from analysis.identification.identified_ship import IdentifiedShip
    from analysis.identification.identify import identify
    from analysis.linear.estimate import SystemEstimate, estimate
    from analysis.replay.plan import Plan, plan_replay
    from analysis.replay.reading_options import ReadingOptions
    from analysis.replay.replay import Replay, analyse
    from analysis.replay.replay_results import Analysis, Findings, ReplayChunk
    from analysis.report.page.report_page import report_page
    from analysis.report.page.report_trials import report_trials
    from analysis.report.page.trial_report import TrialReport
    from analysis.trial.analyse_trial import analyse_trial
    from analysis.trial.trial_analysis import TrialAnalysis
    from analysis.trial.trial_options import TrialOptions

_MODULES = {
    "Analysis": "replay.replay_results",
    "Comparison": "check.compare",
    "Findings": "replay.replay_results",
    "IdentifiedShip": "identification.identified_ship",
    "Plan": "replay.plan",
    "ReadingOptions": "replay.reading_options",
    "Replay": "replay.replay",
    "ReplayChunk": "replay.replay_results",
    "SystemEstimate": "linear.estimate",
    "TrialAnalysis": "trial.trial_analysis",
    "TrialOptions": "trial.trial_options",
    "TrialReport": "report.page.trial_report",
    "analyse": "replay.replay",
    "analyse_trial": "trial.analyse_trial",
    "compare": "check.compare",
    "estimate": "linear.estimate",
    "identify": "identification.identify",
    "plan_replay": "replay.plan",
    "report_page": "report.page.report_page",
    "report_trials": "report.page.report_trials",
}

__all__ = [
    "Analysis",
    "Comparison",
    "Findings",
    "IdentifiedShip",
    "Plan",
    "ReadingOptions",
    "Replay",
    "ReplayChunk",
    "SystemEstimate",
    "TrialAnalysis",
    "TrialOptions",
    "TrialReport",
    "analyse",
    "analyse_trial",
    "compare",
    "estimate",
    "identify",
    "plan_replay",
    "report_page",
    "report_trials",
]


def __getattr__(name: str) -> object:
    """Import a public name on its first use."""
    if name not in _MODULES:
        raise AttributeError(f"module 'analysis' has no attribute {name!r}")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)
