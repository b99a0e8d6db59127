"""The compiled Kalman filter against a numpy loop and against filterpy."""

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec

import numpy as np

from analysis.filters.factory import filter_states

from .bench import NOISE, VESSEL, Bench, share_note
from .measure import Comparison, Limit, SkippedError, timed
from .textbook import FilterResult, filter_in_numpy

RELATIVE_TOLERANCE = 1e-9  # of each column's largest value


def filter_lines(bench: Bench) -> list[Comparison]:
    """Return the comparisons of the filter, one for each peer."""
    return [
        _line(bench, "the same in a numpy loop", filter_in_numpy, 15),
        _line(bench, "the same in filterpy", _filterpy, 30),
    ]


def require_filterpy() -> None:
    """Raise `SkippedError` if filterpy is not installed."""
    if find_spec("filterpy") is None:
        raise SkippedError("filterpy is not installed: pip install filterpy")


def verify_filter(bench: Bench, peer: Callable[..., FilterResult]) -> None:
    """Raise `AssertionError` if the peer's states or standard deviations differ from ours."""
    ours = filter_states(bench.peer_signals, VESSEL.paper_coefficients, NOISE)
    theirs = peer(bench.peer_signals, VESSEL.paper_coefficients, NOISE)
    for one, other in ((ours.states, theirs.states), (ours.stds, theirs.stds)):
        size = np.max(np.abs(one), axis=0)
        np.testing.assert_allclose(other / size, one / size, rtol=0, atol=RELATIVE_TOLERANCE)


def _line(
    bench: Bench, against: str, peer: Callable[..., FilterResult], at_least: float
) -> Comparison:
    model = VESSEL.paper_coefficients
    return Comparison(
        "Kalman filter, five states",
        against,
        timed(partial(filter_states, bench.signals, model, NOISE)),
        timed(partial(peer, bench.peer_signals, model, NOISE), 1 / bench.share),
        Limit(at_least=at_least),
        note=share_note(bench.share),
        verify=partial(verify_filter, bench, peer),
    )


def _filterpy(*arguments: object) -> FilterResult:
    require_filterpy()
    from .with_filterpy import filter_in_filterpy  # noqa: PLC0415 - it may not be installed

    return filter_in_filterpy(*arguments)  # type: ignore[arg-type]
