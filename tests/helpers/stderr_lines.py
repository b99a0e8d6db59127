"""Lines on stderr, and which of them other programs wrote."""

import re

OURS = re.compile(
    "(shiplog|warning|review|report|vessel file|skipped[^:]*|updated|"
    "replay and reference, overlaid): "
)


def foreign_lines(stderr: str) -> list[str]:
    """Return the lines that shiplog did not write, such as warnings of Rerun."""
    return [line for line in stderr.splitlines() if not OURS.match(line)]
