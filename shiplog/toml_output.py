"""Texts as strings and keys of TOML files, whatever characters they have."""

import re


def toml_string(text: str) -> str:
    r"""Return a text as a string of TOML; characters that do not print are escaped.

    A surrogate, which TOML does not have, becomes a question mark.

    Examples
    --------
    >>> print(toml_string('the "gyro"\n'))
    "the \"gyro\"\U0000000a"
    """
    encodable = text.encode(errors="replace").decode()
    escaped = encodable.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def toml_key(*parts: str) -> str:
    """Return a key of TOML, quoted where its characters need it.

    Examples
    --------
    >>> print(toml_key("rudder", "port"), toml_key("heading", "kompaß"))
    rudder.port heading."kompaß"
    """
    return ".".join(p if re.fullmatch(r"[A-Za-z0-9_-]+", p) else toml_string(p) for p in parts)
