"""The ranking of ship models by cross-validation, on two threads against one."""

from collections.abc import Sequence
from functools import partial

from analysis.identification.fit.segment import Segment
from analysis.identification.model_selection import Candidate, rank_models
from analysis.identification.parallel import usable_cores
from analysis.identification.runs import run_from_log
from shiplog import read
from shiplog.ships import Model, loadable_models, ship_model

from .bench import Bench
from .measure import Comparison, SkippedError, timed
from .start_up import SAMPLE

LOGS = (SAMPLE, SAMPLE.with_name("turning_circle_35.mcap"))
SHORT_MODELS = ("burylin-tied", "nomoto")
SHORT_SECS = 60.0  # of each log in a short run


def ranking_lines(bench: Bench) -> list[Comparison]:
    """Return the comparison of the ranking that ``identify --model auto`` makes of two logs.

    In a short run, two models on the first minute of the logs, without verification.
    """
    segments, models = ranking_input(short=bench.short)
    rank = partial(rank_models, segments, models)
    return [
        Comparison(
            f"rank {len(models)} ship models on two logs, two threads",
            "one thread",
            timed(partial(rank, threads=2)),
            timed(partial(rank, threads=1)),
            note="most of `shiplog identify --model auto`; at most 2 x",
            verify=require_two_cores if bench.short else verify_ranking,
        )
    ]


def ranking_input(*, short: bool) -> tuple[list[Segment], list[Model]]:
    """Return the segments and the models to rank."""
    segments = [segment for path in LOGS for segment in run_from_log(read(path)).segments]
    if not short:
        return segments, list(loadable_models()[0])
    cut = [segment.part(0, round(SHORT_SECS / segment.dt_secs)) for segment in segments]
    return cut, [ship_model(name) for name in SHORT_MODELS]


def require_two_cores() -> None:
    """Raise `SkippedError` if this process may use only one core."""
    if usable_cores() < 2:
        raise SkippedError("two threads need two cores, this process may use one")


def verify_ranking() -> None:
    """Raise `AssertionError` if the scores of a short ranking depend on the number of threads."""
    require_two_cores()
    segments, models = ranking_input(short=True)
    one, two = (rank_models(segments, models, threads=threads) for threads in (1, 2))
    assert scores(one) == scores(two)  # noqa: S101 - this is what is verified


def scores(candidates: Sequence[Candidate]) -> list[tuple[str, float]]:
    """Return the name and the score of each candidate, the best first."""
    return [(candidate.model.name, candidate.score) for candidate in candidates]
