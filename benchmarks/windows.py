"""Least squares over a window that slides a sample at a time, against `np.linalg.pinv` in each."""

from functools import partial

import numpy as np

from analysis.regression.window_qr import slide
from shiplog.types import FloatArray

from .bench import Bench
from .measure import Line, Result, holds, timed

LENGTHS = (100, 500, 2000, 8000)
HELD = 500  # of these the one that is held to a ratio
EVENNESS = 1.5  # times the shortest window's time, at the most, for any other
COLUMNS = 6
PEER_ROWS = 2_000_000  # are given to the peer: so many over N windows
COMPARED = 200  # windows, before anything is timed


def lines(bench: Bench) -> list[Line]:
    """One a window length, as far as the log is long enough."""
    X, y = regression(len(bench.signals))
    return [_line(X, y, length) for length in LENGTHS if 2 * length <= len(y)]


def evenness(results: list[Result], *, judged: bool) -> Result | None:
    """That the time does not depend on the window's length: longest against shortest."""
    secs = [r.ours_secs for r in results if r.work.startswith("sliding window, N = ")]
    known = [s for s in secs if s is not None]
    if len(known) < 2:
        return None
    ratio = max(known[1:]) / known[0]
    met = holds(ratio, None, EVENNESS) if judged else None
    return Result(
        "sliding window, the slowest N", f"our own time at N = {LENGTHS[0]}", max(known[1:]),
        known[0], ratio, None, EVENNESS, met, "independent of N",
    )  # fmt: skip


def regression(count: int) -> tuple[FloatArray, FloatArray]:
    """Regressors (n, 6) and left side (n,): noise, so that no window is left blank.

    A blank one would cost little; what the others cost does not depend on what is in them.
    """
    random = np.random.default_rng(0)
    X = random.normal(size=(count, COLUMNS))
    return X, X @ np.arange(1.0, 1.0 + COLUMNS) + random.normal(size=count)


def slide_pinv(X: FloatArray, y: FloatArray, length: int) -> FloatArray:
    """The coefficients of every window, (n - length + 1, p), each window for itself."""
    found = np.empty((len(y) - length + 1, X.shape[1]))
    for k in range(len(found)):
        found[k] = np.linalg.pinv(X[k : k + length]) @ y[k : k + length]
    return found


def _line(X: FloatArray, y: FloatArray, length: int) -> Line:
    whole = len(y) - length + 1
    given = min(whole, max(50, PEER_ROWS // length))
    return Line(
        f"sliding window, N = {length}, p = {COLUMNS}",
        "np.linalg.pinv a window",
        timed(partial(slide, X, y, length)),
        timed(partial(slide_pinv, *_first(X, y, given + length - 1), length), whole / given),
        at_least=60 if length == HELD else None,
        note=f"every sample; peer timed on {given} of {whole} windows",
        same=partial(require_same, *_first(X, y, min(whole, COMPARED) + length - 1), length),
    )


def _first(X: FloatArray, y: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    return X[:count], y[:count]


def require_same(X: FloatArray, y: FloatArray, length: int) -> None:
    """Refuse windows that are solved otherwise."""
    ours, theirs = slide(X, y, length).values, slide_pinv(X, y, length)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
