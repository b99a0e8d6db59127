"""Texts made safe for a terminal: what came from the wire may hold control sequences."""


def printable(text: str) -> str:
    r"""Return a text with all characters escaped that do not print, such as control characters.

    Examples
    --------
    >>> printable("gyro \x1b[2J ok")
    'gyro \\x1b[2J ok'
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text
    )
