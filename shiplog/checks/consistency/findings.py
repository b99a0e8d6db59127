"""What a check of consistency reports: a typed finding with its text."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from shiplog.errors import LogError, ShiplogError

CONTRADICTIONS = ("unit", "sign")  # kinds that `--strict` refuses


@dataclass(frozen=True)
class Finding:
    """One contradiction between channels.

    Attributes
    ----------
    kind
        "unit", "sign", "column", "zero", "bias" or "lag".
    channel
        The name of the channel that is likely wrong; "time" for the times of all.
    text
        One line with topic, figures, likely cause and remedy.
    """

    kind: str
    channel: str
    text: str


def refuse_contradictions(findings: Iterable[Finding]) -> None:
    """Raise `LogError` for the first finding of a wrong unit or sign.

    Raises
    ------
    LogError
        Its message is that of the finding.
    """
    for finding in findings:
        if finding.kind in CONTRADICTIONS:
            raise LogError(f"{finding.text} (refused because of --strict)")


@contextmanager
def naming_contradictions(texts: Sequence[str]) -> Iterator[None]:
    """Add to an error of a computation the wrong unit or sign that is its likely cause.

    Parameters
    ----------
    texts
        The contradictions of the log, the likeliest first.

    Raises
    ------
    ShiplogError
        The error of the computation, of the same class; its message begins with the first text.

    Examples
    --------
    >>> with naming_contradictions(["/rudder/a: up to 900 deg; likely deg read as rad"]):
    ...     raise LogError("the filter diverges")
    Traceback (most recent call last):
    ...
    shiplog.errors.LogError: /rudder/a: up to 900 deg; likely deg read as rad; the filter diverges
    """
    try:
        yield
    except ShiplogError as error:
        if not texts:
            raise
        raise type(error)(f"{texts[0]}; {error}") from error
