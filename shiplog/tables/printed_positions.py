"""Printed latitudes and longitudes: decimal, or degrees and minutes, with hemispheres."""

import re

import numpy as np

from shiplog.types import FloatArray

LIMITS = {"latitude": 91.0, "longitude": 361.0}  # deg; 91 and 181 are printed without a fix
_COORDINATE = re.compile(
    r"(?P<before>[NSEW])?\s*(?P<sign>[+-])?\s*(?P<degrees>\d+(?:\.\d+)?(?:e[+-]\d+)?)"
    r"(?:\s*[°º:\s-]\s*(?P<minutes>\d+(?:\.\d+)?)"
    r"(?:\s*['′’:\s]\s*(?:(?P<seconds>\d+(?:\.\d+)?)\s*(?:\"|″|''|”)?)?)?"
    r"|\s*[°º])?\s*(?P<after>[NSEW])?",
    re.IGNORECASE,
)
_LETTERS = {"latitude": "NS", "longitude": "EW"}


class PositionTextError(Exception):
    """A row whose position cannot be read: its index, and the reason with the remedy."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row, self.reason = row, reason


def looks_packed(texts: list[str], component: str) -> bool:
    """Whether cells with a hemisphere are degrees and minutes in one number, such as 5412.345N."""
    for text in texts:
        match = _COORDINATE.fullmatch(text.strip())
        if match and not match["minutes"] and (match["before"] or match["after"]):
            whole = match["degrees"].partition(".")[0]
            if len(whole) >= 4 or float(match["degrees"]) > LIMITS[component]:
                return True
    return False


def parse_degrees(
    texts: list[str], component: str, hemispheres: list[str] | None, *, packed: bool
) -> FloatArray:
    """Convert printed latitudes or longitudes to degrees, positive to north and east.

    Parameters
    ----------
    texts
        (n,) cells; an empty one was not measured.
    component
        "latitude" or "longitude".
    hemispheres
        (n,) letters N, S or E, W of a column of their own, or None.
    packed
        Whether numbers are degrees and minutes in one, ddmm.mmmm.

    Returns
    -------
    numpy.ndarray
        (n,) deg; NaN where not measured.

    Raises
    ------
    PositionTextError
        A cell is not a position, or its hemisphere is missing or contradicts its sign.

    Examples
    --------
    >>> parse_degrees(["54 12.3 N", "54.205", "S54.5"], "latitude", None, packed=False)
    array([ 54.205,  54.205, -54.5  ])
    >>> parse_degrees(["5412.3N"], "latitude", None, packed=True)
    array([54.205])
    """
    letters = hemispheres or [""] * len(texts)
    values = np.full(len(texts), np.nan)
    for row, (text, letter) in enumerate(zip(texts, letters, strict=True)):
        if text:
            values[row] = _degrees(row, text, component, letter.strip().upper(), packed)
    typical = float(np.nanmedian(np.abs(values))) if np.any(np.isfinite(values)) else 0.0
    if typical > LIMITS[component] and typical < 1000 * LIMITS[component] and not packed:
        raise PositionTextError(
            int(np.argmax(np.abs(values) > LIMITS[component])),
            f"has a {component} beyond {LIMITS[component] - 1:g}°, probably degrees and minutes "
            "in one number; state position.unit = 'ddmm.mmmm'",
        )
    return values


def _degrees(row: int, text: str, component: str, letter: str, packed: bool) -> float:
    """Convert one cell."""
    match = _COORDINATE.fullmatch(text.strip())
    if match is None:
        raise PositionTextError(row, f"{text!r} is not a {component}, such as 5412.345N or 54.2057")
    attached = (match["before"] or match["after"] or "").upper()
    if match["before"] and match["after"]:
        raise PositionTextError(row, f"{text!r} has two hemispheres; correct it")
    side = attached or letter
    if side and side not in _LETTERS[component]:
        raise PositionTextError(
            row, f"has the hemisphere {side!r} for a {component}; exchange the columns"
        )
    if side and match["sign"] == "-":
        raise PositionTextError(row, f"{text!r} has a hemisphere and a minus sign; correct it")
    degrees, minutes = float(match["degrees"]), float(match["minutes"] or 0)
    if packed and not match["minutes"]:
        whole, minutes = divmod(degrees, 100)
        degrees = whole
    minutes += float(match["seconds"] or 0) / 60
    if minutes > 60 or (minutes == 60 and packed):
        raise PositionTextError(row, f"{text!r} has {minutes:g} minutes of arc; correct it")
    negative = match["sign"] == "-" or side in ("S", "W")
    return (-1.0 if negative else 1.0) * (degrees + minutes / 60)
