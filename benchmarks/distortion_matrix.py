"""Replays of a simulated trial distorted in 200 ways, whose results must be right or reported.

Every case is replayed, and its figures are compared with the simulator's: the coefficients within
their intervals, the mean speed, the yaw rate, the heading and the track. Some of the cases are
identified, too, and the parameters of the ship compared. A case with a wrong figure must be
refused, or have a warning that names the cause; without any warning it is a silent wrong result.
"""

import warnings as python_warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from recorders.simulated.simulate import START_NS
from shiplog import Channel, LogWriter, ShiplogError, TrialLog, open_log
from shiplog.types import Log

from .distorted_figures import Judged, judge_identification, judge_replay
from .distortion import Clock
from .distortions import CASES, Case, cases, identified_cases
from .undistorted import DURATION_SECS, as_log, conditions, false_alarms, undistorted_trial

PORTION_SECS = 10  # of a file; within one, samples are written in the order of their stamps
IDENTIFIED = "identified"  # the family of the cases that are identified
RIGHT, RIGHT_WITH_WARNINGS = "right", "right, with warnings"
NAMED, REFUSED = "wrong, cause named", "refused, cause named"
OTHER_WARNING, OTHER_REFUSAL = "wrong, other warnings", "refused, other reason"
SILENT, TRACEBACK = "silent wrong", "traceback"
OUTCOMES = (
    RIGHT, RIGHT_WITH_WARNINGS, NAMED, REFUSED, OTHER_WARNING, OTHER_REFUSAL, SILENT, TRACEBACK,
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """The result of a case.

    Attributes
    ----------
    case
        The case.
    family
        That of the case, or `IDENTIFIED`.
    kind
        One of `OUTCOMES`.
    wrong
        The figures that are wrong, with their values and the truth.
    messages
        The warnings, or the error.
    """

    case: Case
    family: str
    kind: str
    wrong: tuple[str, ...]
    messages: tuple[str, ...]

    @property
    def is_acceptable(self) -> bool:
        """Whether the figures are right or the cause is named."""
        return self.kind in {RIGHT, RIGHT_WITH_WARNINGS, NAMED, REFUSED}


def run_matrix(
    chosen: Iterable[Case] | None = None, judge: Callable[[Log], Judged] = judge_replay
) -> Iterator[Outcome]:
    """Replay or identify every case and classify its result.

    Parameters
    ----------
    chosen
        The cases; by default all of `benchmarks.distortions.cases`.
    judge
        What is done with each log: `judge_replay` or `judge_identification`.
    """
    harmful: dict[str, bool] = {}
    for case in cases() if chosen is None else chosen:
        outcome = run_case(case, harmful, judge)
        if len(case.distortions) == 1:
            harmful[str(case)] = bool(outcome.wrong) or outcome.kind == REFUSED
        yield outcome


def run_case(
    case: Case,
    harmful: dict[str, bool] | None = None,
    judge: Callable[[Log], Judged] = judge_replay,
) -> Outcome:
    """Replay or identify a case and classify its result.

    Parameters
    ----------
    case
        The case.
    harmful
        Whether a distortion alone makes a figure wrong or is refused, by its name: in a pair, a
        warning must name a distortion that does.
    judge
        As in `run_matrix`.
    """
    family = case.family if judge is judge_replay else IDENTIFIED
    culprits = [d for d in case.distortions if (harmful or {}).get(str(d), True)]
    culprits = culprits or list(case.distortions)
    try:
        with python_warnings.catch_warnings(), TemporaryDirectory() as folder:
            python_warnings.simplefilter("ignore")
            log = as_log(undistorted_trial())
            for distortion in case.distortions:
                log = distortion.apply(log)
            clocks = [d.clock for d in case.distortions if d.clock is not None]
            read = _written(log, clocks, Path(folder) / "trial.mcap") if clocks else log
            wrong, warnings = judge(read)
    except ShiplogError as error:
        named = any(d.is_named_in(str(error)) for d in culprits)
        return Outcome(case, family, REFUSED if named else OTHER_REFUSAL, (), (str(error),))
    except Exception as error:  # noqa: BLE001 - a traceback is one of the outcomes
        return Outcome(case, family, TRACEBACK, (), (f"{type(error).__name__}: {error}",))
    messages = tuple(dict.fromkeys((*read.warnings, *warnings)))
    named = any(d.is_named_in(message) for d in culprits for message in messages)
    if wrong:
        kind = NAMED if named else OTHER_WARNING if messages else SILENT
    else:
        kind = RIGHT_WITH_WARNINGS if messages else RIGHT
    return Outcome(case, family, kind, tuple(wrong), messages)


def _written(log: TrialLog, clocks: Sequence[Clock], path: Path) -> Log:
    """Write a log in the order of its true times, with the times of distorted clocks."""
    ends = START_NS + np.arange(PORTION_SECS, 2 * DURATION_SECS, PORTION_SECS) * 10**9
    cuts = {
        c.topic: [0, *np.searchsorted(c.received_ns, ends).tolist(), len(c)] for c in log.channels
    }
    with LogWriter(path, metadata=log.metadata) as writer:
        for i in range(len(ends) + 1):
            parts = [c.part(cuts[c.topic][i], cuts[c.topic][i + 1]) for c in log.channels]
            writer.write(*(_with_clocks(part, clocks) for part in parts if len(part)))
            writer.flush()
    return open_log(path)


def _with_clocks(channel: Channel, clocks: Sequence[Clock]) -> Channel:
    measured, received = channel.measured_ns, channel.received_ns
    for clock in clocks:
        measured, received = clock(channel, measured), clock(channel, received)
    return replace(channel, measured_ns=measured, received_ns=received)


@dataclass(frozen=True)
class MatrixResults:
    """The results of the whole matrix, as texts and counts.

    Attributes
    ----------
    counts
        The number of cases by family, and in total, of each of `OUTCOMES`.
    failures
        The cases whose result is wrong while no warning names the cause, with that result.
    false_alarms
        The warnings of undistorted trials.
    trials
        The number of undistorted trials.
    """

    counts: dict[str, tuple[int, ...]]
    failures: tuple[str, ...]
    false_alarms: tuple[str, ...]
    trials: int


def measure_distortions(cases_count: int = CASES, seeds: int = 50) -> MatrixResults:
    """Run the matrix, and the undistorted trials with some seeds in each condition."""
    to_identify = identified_cases()[:cases_count]
    outcomes = [
        *run_matrix(cases(cases_count)),
        *run_matrix(to_identify, judge_identification),
    ]
    failures = [
        f"{each.kind}: {each.case} ({each.family}): {'; '.join(each.wrong or each.messages)}"
        for each in outcomes
        if not each.is_acceptable
    ]
    alarms = tuple(false_alarms(range(seeds)))
    trials = seeds * len(conditions())
    return MatrixResults(counts_by_family(outcomes), tuple(failures), alarms, trials)


def counts_by_family(outcomes: Sequence[Outcome]) -> dict[str, tuple[int, ...]]:
    """Count the cases of each of `OUTCOMES`, by family and in total."""
    counts = Counter((each.family, each.kind) for each in outcomes)
    families = dict.fromkeys(each.family for each in outcomes)
    rows = {f: tuple(counts[f, kind] for kind in OUTCOMES) for f in families}
    return rows | {"total": tuple(map(sum, zip(*rows.values(), strict=True)))}
