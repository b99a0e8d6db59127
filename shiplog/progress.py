"""Progress of long work: the callback that reports it."""

from typing import Protocol


class ProgressCallback(Protocol):
    """A callable that is given each step of long work as it begins and goes on.

    Parameters
    ----------
    step
        What is being done, in a few words, with counts: ``"model 3 of 7, run 2 of 6"``.
    share
        How much of the whole work is done, 0 to 1; None where it is unknown.
    """

    def __call__(self, step: str, share: float | None = None, /) -> None: ...  # noqa: D102


def no_progress(_step: str, _share: float | None = None, /) -> None:
    """Report nothing."""
