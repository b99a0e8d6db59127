"""What a check of consistency reports: a typed finding with its text."""

from collections.abc import Iterable
from dataclasses import dataclass

from shiplog.errors import LogError

CONTRADICTIONS = ("unit", "sign")  # kinds that `--strict` refuses


@dataclass(frozen=True)
class Finding:
    """One contradiction between channels.

    Attributes
    ----------
    kind
        "unit", "sign", "zero", "bias" or "lag".
    text
        One line with topic, figures, likely cause and remedy.
    """

    kind: str
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
