"""The Kalman filter: compiled, against a numpy loop and against filterpy."""

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec

import numpy as np

from analysis.filters.factory import filter_states

from .bench import NOISE, VESSEL, Bench, said_share
from .measure import Line, SkippedError, timed
from .textbook import Filtered, filter_in_numpy

CLOSE = 1e-9  # of each column's largest value


def lines(bench: Bench) -> list[Line]:
    """The filter's two peers."""
    return [
        _line(bench, "the same in a numpy loop", filter_in_numpy, 15),
        _line(bench, "the same in filterpy", _filterpy, 30),
    ]


def require_filterpy() -> None:
    """Skip what needs filterpy where it is not installed."""
    if find_spec("filterpy") is None:
        raise SkippedError("filterpy is not installed: pip install filterpy")


def require_same(bench: Bench, peer: Callable[..., Filtered]) -> None:
    """Refuse a peer that is another filter."""
    ours = filter_states(bench.peer_signals, VESSEL.paper_coefficients, NOISE)
    theirs = peer(bench.peer_signals, VESSEL.paper_coefficients, NOISE)
    for one, other in ((ours.states, theirs.states), (ours.stds, theirs.stds)):
        size = np.max(np.abs(one), axis=0)
        np.testing.assert_allclose(other / size, one / size, rtol=0, atol=CLOSE)


def _line(bench: Bench, against: str, peer: Callable[..., Filtered], at_least: float) -> Line:
    model = VESSEL.paper_coefficients
    return Line(
        "Kalman filter, five states",
        against,
        timed(partial(filter_states, bench.signals, model, NOISE)),
        timed(partial(peer, bench.peer_signals, model, NOISE), 1 / bench.share),
        at_least=at_least,
        note=said_share(bench.share),
        same=partial(require_same, bench, peer),
    )


def _filterpy(*given: object) -> Filtered:
    require_filterpy()
    from .with_filterpy import filter_in_filterpy  # noqa: PLC0415 - it may not be installed

    return filter_in_filterpy(*given)  # type: ignore[arg-type]
