"""Words of headers: the quantity, the source and the unit that a column's name states."""

import re
from collections.abc import Mapping, Sequence

from shiplog.units import CATALOGUE, UNITS

# words of a header, in lower case without their unit, and the quantity; the first match counts
_QUANTITIES = (
    (r"lat|latitude|breite", "latitude"),
    (r"lon|long|lng|longitude|l[aä]nge", "longitude"),
    (r"rot|r|yaw_?rate|rate_of_turn|turn_rate|gyro_?rate|drehrate", "yaw_rate"),
    (r"hdt|hdg|heading|heading_true|true_heading|gyro_heading|psi|gyro|kurs", "heading"),
    (r"cog|course|course_over_ground|kurs_über_grund|kü?g", "course_over_ground"),
    (r"sog|speed_over_ground|gps_speed|fahrt_über_grund|f[uü]g", "speed_over_ground"),
    (r"stw|u|speed|log|speed_log|log_speed|water_speed|speed_through_water|fahrt|fdw", "speed"),
    (r"rudder_(order|command|cmd|set)|(ordered|commanded)_rudder", "rudder_order"),
    (r"rudder|rudder_angle|rsa|delta|rud|ruder|ruderlage|ruderwinkel", "rudder"),
    (r"rpm|n|(shaft|engine|propeller)_(rpm|speed)|shaft|revs?|revolutions|drehzahl", "rpm"),
    (r"(true_)?wind_speed|tws", "wind_speed"),
    (r"(true_)?wind_dir(ection)?|twd", "wind_direction"),
    (r"(shaft_)?power|leistung", "power"),
    (r"(shaft_)?torque|drehmoment", "torque"),
    (r"draft|draught|tiefgang", "draught"),
    (r"depth|water_depth", "depth"),
    (r"n_?s|lat_?(ns|n_s|dir|hemi(sphere)?)", "north_south"),
    (r"e_?w|lon_?(ew|e_w|dir|hemi(sphere)?)", "east_west"),
    *((name, name) for name in CATALOGUE if name != "position"),
)
_SIDES = {"port": "port", "ps": "port", "starboard": "starboard", "stbd": "starboard",
          "sb": "starboard", "stb": "starboard", "bb": "port"}  # fmt: skip
_RECEIVER = (  # words that name a receiver of positions
    r"(d?gps|gnss|receiver|rx|antenna|ant|bow|stern|fore|forward|aft|mid|main|backup|primary|"
    r"secondary|master|port|starboard|[ab]|)\d*"
)
_POSITION = ("latitude", "longitude", "north_south", "east_west")
_UNIT_WORDS = {
    "°": "deg", "degrees": "deg", "degree": "deg", "°/min": "deg/min", "°/s": "deg/s",
    "deg/sec": "deg/s", "dps": "deg/s", "knots": "kn", "knot": "kn", "kt": "kn", "kts": "kn",
    "kmh": "km/h", "1/min": "rpm", "rev/min": "rpm", "r/min": "rpm", "min-1": "rpm",
    "u/min": "rpm", "rps": "rev/s", "sec": "s", "seconds": "s", "metres": "m", "meters": "m",
    "mps": "m/s", "°/m": "deg/min", "%": "%",
}  # fmt: skip


def named_unit(text: str) -> str:
    """Return the unit that a word names, as `UNITS` spells it; the word itself if unknown.

    Examples
    --------
    >>> named_unit("knots"), named_unit("Deg/Min"), named_unit("kN"), named_unit("x")
    ('kn', 'deg/min', 'kN', 'x')
    """
    plain = text.strip().strip("[]()").strip()
    if plain in UNITS:
        return plain
    lower = plain.lower()
    return _UNIT_WORDS.get(lower, lower if lower in UNITS else plain)


def bracketed_unit(name: str) -> str:
    """Return the known unit in the brackets at the end of a header; empty if there is none.

    Examples
    --------
    >>> bracketed_unit("STW [knots]"), bracketed_unit("Rudder (port)"), bracketed_unit("speed_kn")
    ('kn', '', '')
    """
    match = re.fullmatch(r".*[\[(]([^\])]*)[\])]\s*", name)
    unit = named_unit(match[1]) if match else ""
    return unit if unit in UNITS else ""


def split_header(name: str) -> tuple[str, str]:
    """Return the words of a header joined by underscores, and the unit stated in it.

    Examples
    --------
    >>> split_header("Rudder Angle [°]"), split_header("speed_kn")
    (('rudder_angle', 'deg'), ('speed', 'kn'))
    """
    words, unit = name, bracketed_unit(name)
    if unit:
        words = re.sub(r"[\[(][^\])]*[\])]\s*$", "", name)
    else:
        head, _, tail = name.rpartition("_")
        if head and (tail in _UNIT_WORDS or named_unit(tail) in UNITS):
            words, unit = head, named_unit(tail)
    return re.sub(r"[^a-z0-9äöü]+", "_", words.lower()).strip("_"), unit


def recognise(words: Mapping[str, str], taken: Sequence[str]) -> dict[str, str]:
    """Return the column of each quantity that is recognised.

    Parameters
    ----------
    words
        Words of each column's header, as `split_header` returns them.
    taken
        Columns that already have a meaning.

    Returns
    -------
    dict
        Column by quantity; with its side or, of a position, its receiver after a point where the
        header states one (`rpm.port`, `latitude.gps1`).
    """
    roles: dict[str, str] = {}
    for name, text in words.items():
        if name in taken:
            continue
        parts = text.split("_")
        sides = [_SIDES[part] for part in parts if part in _SIDES]
        plain = "_".join(part for part in parts if part not in _SIDES)
        quantity = _quantity(plain)
        role = f"{quantity}.{sides[0]}" if len(sides) == 1 else quantity
        if not quantity or quantity in _POSITION:
            role = _received(parts) or role
        if role and role not in roles:
            roles[role] = name
    return roles


def _quantity(words: str) -> str:
    """Return the quantity that words joined by underscores name; empty if none."""
    return next((role for pattern, role in _QUANTITIES if re.fullmatch(pattern, words)), "")


def _received(parts: Sequence[str]) -> str:
    """Return the component of a position and its receiver, such as `latitude.gps1`.

    Empty where the words are no component of a position, or name no receiver.
    """
    words = [word for part in parts for word in re.findall(r"[^\W\d]+|\d+", part)]
    for start in range(len(words)):
        for end in range(len(words), start, -1):
            quantity = _quantity("_".join(words[start:end]))
            receiver = [*words[:start], *words[end:]]
            if quantity in _POSITION and receiver:
                named = [_SIDES.get(word, word) for word in receiver]
                if all(re.fullmatch(_RECEIVER, word) for word in named):
                    return f"{quantity}.{''.join(named)}"
    return ""


def is_units_row(row: Sequence[str], following: Sequence[str]) -> bool:
    """Whether a row under the header has the units of the columns, above a row of numbers.

    Examples
    --------
    >>> is_units_row(["", "deg", "knots"], ["12:00:00", "1", "2"])
    True
    """
    cells = [cell for cell in row if cell.strip()]
    units = [cell for cell in cells if named_unit(cell) in UNITS and named_unit(cell) != "1"]
    values = [cell for cell in cells if re.match(r"[+-]?[.,]?\d+([.,:]|$)", cell.strip())]
    numbers = any(re.match(r"[+-]?[.,]?\d", cell.strip()) for cell in following)
    return bool(units) and not values and numbers
