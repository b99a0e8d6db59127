"""Least squares in a window that slides by one sample, against `np.linalg.pinv` in each window."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from analysis.regression.window_qr import sliding_least_squares
from shiplog.types import FloatArray

from .bench import Bench
from .measure import NO_LIMIT, Comparison, ComparisonResult, Limit, timed

WINDOW_LENGTHS = (100, 500, 2000, 8000)  # samples
LIMITED_LENGTH = 500  # the one length whose ratio is held to a limit
MAX_LENGTH_RATIO = 1.5  # our time at any length over that at the shortest
COLUMNS = 6
MAX_PEER_ROWS = 2_000_000  # rows that the peer solves at each length
MAX_SHORT_PEER_ROWS = 200_000
VERIFIED_WINDOWS = 200


def window_lines(bench: Bench) -> list[Comparison]:
    """Return a comparison for each window length, of as many rows as the log has samples.

    A log shorter than two of the longest windows counts as that long.
    """
    X, y = random_regression(max(len(bench.signals), 2 * WINDOW_LENGTHS[-1]))
    peer_rows = MAX_SHORT_PEER_ROWS if bench.short else MAX_PEER_ROWS
    return [_line(X, y, length, peer_rows) for length in WINDOW_LENGTHS]


def length_dependence(
    results: Sequence[ComparisonResult], *, judged: bool
) -> ComparisonResult | None:
    """Return our time at the slowest length over that at the shortest; None without two lengths.

    The time must not depend on the window's length.
    """
    secs = [r.ours_secs for r in results if r.work.startswith("sliding window, N = ")]
    measured = [s for s in secs if s is not None]
    if len(measured) < 2:
        return None
    slowest, limit = max(measured[1:]), Limit(at_most=MAX_LENGTH_RATIO)
    ratio = slowest / measured[0]
    return ComparisonResult(
        "sliding window, the slowest N",
        f"our own time at N = {WINDOW_LENGTHS[0]}",
        limit,
        ours_secs=slowest,
        peer_secs=measured[0],
        ratio=ratio,
        met=limit.met(ratio, slowest) if judged else None,
        note="independent of N",
    )


def random_regression(count: int) -> tuple[FloatArray, FloatArray]:
    """Return random regressors (n, 6) and left side (n,), so that no window is rank deficient.

    A rank-deficient window would take less time; that of the others does not depend on the data.
    """
    random = np.random.default_rng(0)
    X = random.normal(size=(count, COLUMNS))
    return X, X @ np.arange(1.0, 1.0 + COLUMNS) + random.normal(size=count)


def slide_pinv(X: FloatArray, y: FloatArray, length: int) -> FloatArray:
    """Return the coefficients of every window, (n - length + 1, p), each window solved by itself.

    Parameters
    ----------
    X
        (n, p) regressors.
    y
        (n,) left side.
    length
        Samples in a window.
    """
    values = np.empty((len(y) - length + 1, X.shape[1]))
    for k in range(len(values)):
        values[k] = np.linalg.pinv(X[k : k + length]) @ y[k : k + length]
    return values


def verify_windows(X: FloatArray, y: FloatArray, length: int) -> None:
    """Raise `AssertionError` if the coefficients of any window differ from the peer's."""
    ours, theirs = sliding_least_squares(X, y, length).values, slide_pinv(X, y, length)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def _line(X: FloatArray, y: FloatArray, length: int, peer_rows: int) -> Comparison:
    windows = len(y) - length + 1
    solved = min(windows, max(50, peer_rows // length))
    rows, verified_rows = solved + length - 1, min(windows, VERIFIED_WINDOWS) + length - 1
    return Comparison(
        f"sliding window, N = {length}, p = {COLUMNS}",
        "np.linalg.pinv a window",
        timed(partial(sliding_least_squares, X, y, length)),
        timed(partial(slide_pinv, X[:rows], y[:rows], length), windows / solved),
        Limit(at_least=60) if length == LIMITED_LENGTH else NO_LIMIT,
        note=f"every sample; peer timed on {solved} of {windows} windows",
        verify=partial(verify_windows, X[:verified_rows], y[:verified_rows], length),
    )
