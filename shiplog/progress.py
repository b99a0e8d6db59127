"""Progress callback of long computations."""

from typing import Protocol


class ProgressCallback(Protocol):
    """A callable that receives each step of a long computation as it begins and advances.

    Parameters
    ----------
    step
        What is being done, in a few words, with counts: ``"model 3 of 7, run 2 of 6"``.
    share
        The share of the whole work that is done, 0 to 1; None if it is unknown.

    Examples
    --------
    >>> def print_progress(step, share=None, /):
    ...     print(step if share is None else f"{step}: {share:.0%}")
    >>> print_progress("replay", 0.5)
    replay: 50%
    """

    def __call__(self, step: str, share: float | None = None, /) -> None: ...  # noqa: D102


def no_progress(_step: str, _share: float | None = None, /) -> None:
    """Report nothing: the default callback."""
