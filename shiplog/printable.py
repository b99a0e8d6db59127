r"""Texts from files and sensors made safe to show: control and format characters are escaped.

Such a text may hold sequences that control a terminal, line ends that make one line look like
several, and characters that change the direction of the text around them.
"""

import json


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


def shortened(text: str, size: int) -> str:
    """Shorten a text in the middle to a number of characters.

    Examples
    --------
    >>> shortened("trials/2026/zigzag_20_20.mcap", 18)
    'trials/2…0_20.mcap'
    """
    if len(text) <= size:
        return text
    head = (size - 1) // 2
    return f"{text[:head]}…{text[len(text) - (size - 1 - head) :]}"


def counted(number: int, thing: str) -> str:
    """Return a number of things in words, with the plural of a regular noun where it needs one.

    Examples
    --------
    >>> counted(1, "metadata record"), counted(0, "attachment")
    ('1 metadata record', '0 attachments')
    """
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


def escape_json(line: str) -> str:
    r"""Escape the characters of a line of JSON that do not print; its value stays the same.

    Examples
    --------
    >>> escape_json('{"source": "gyro \x9b2J, 20°"}')
    '{"source": "gyro \\u009b2J, 20°"}'
    """
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else json.dumps(c)[1:-1] for c in line)
