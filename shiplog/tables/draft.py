"""Draft of a layout, from the header and the values of a foreign table."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.types import FloatArray
from shiplog.units import CATALOGUE, UNITS

from .foreign import read_table
from .layout import DELIMITERS
from .layout_parser import parse_layout
from .printed_positions import looks_packed
from .printed_times import is_time_text

SAMPLE_LINES = 5000  # of the table, from which a layout is drafted
ENCODINGS = ("utf-8", "cp1252")
# words of a header, in lower case without their unit, and the quantity; the first match counts
HEADER_WORDS = (
    (r"lat|latitude", "latitude"),
    (r"lon|long|lng|longitude", "longitude"),
    (r"rot|r|yaw_?rate|yawrate|rate_of_turn|turn_rate|gyro_?rate", "yaw_rate"),
    (r"hdt|hdg|heading|heading_true|true_heading|psi|gyro", "heading"),
    (r"cog|course|course_over_ground", "course_over_ground"),
    (r"sog|speed_over_ground|gps_speed", "speed_over_ground"),
    (r"stw|u|speed|log|speed_log|log_speed|water_speed|speed_through_water", "speed"),
    (r"rudder_(order|command|cmd|set)|(ordered|commanded)_rudder", "rudder_order"),
    (r"rudder|rudder_angle|rsa|delta|rud", "rudder"),
    (r"rpm|n|shaft_rpm|shaft|shaft_speed|engine_rpm|propeller_rpm|rev|revs|revolutions", "rpm"),
    (r"(true_)?wind_speed|tws", "wind_speed"),
    (r"(true_)?wind_dir(ection)?|twd", "wind_direction"),
    (r"(shaft_)?power", "power"),
    (r"(shaft_)?torque", "torque"),
    (r"draft|draught", "draught"),
    (r"depth|water_depth", "depth"),
    *((name, name) for name in ("heel", "roll", "pitch", "thrust", "wave_height", "sway")),
)
TIME_WORDS = r"t|time|utc|utc_time|time_utc|timestamp|datetime|date_time|secs?|seconds|clock"
UNIT_WORDS = {
    "°": "deg", "degrees": "deg", "degree": "deg", "°/min": "deg/min", "°/s": "deg/s",
    "deg/sec": "deg/s", "knots": "kn", "knot": "kn", "kt": "kn", "kts": "kn", "kmh": "km/h",
    "1/min": "rpm", "rev/min": "rpm", "r/min": "rpm", "rps": "rev/s", "sec": "s", "seconds": "s",
    "metres": "m", "meters": "m", "mps": "m/s", "deg/m": "deg/min",
}  # fmt: skip
USUAL_UNITS = {"yaw_rate": "deg/min", "speed": "kn", "rpm": "rpm"}  # where nothing is stated


@dataclass(frozen=True)
class Draft:
    """A drafted layout.

    Attributes
    ----------
    text
        The layout file, TOML.
    remarks
        One line for each column: what it is read as, and what this is based on.
    """

    text: str
    remarks: tuple[str, ...]


def draft_layout(path: Path) -> Draft:
    """Draft a layout from the first lines of a table.

    Quantities come from the words of the header, units from the header or else from the values:
    a yaw rate is compared with the derivative of the heading. Columns that are not recognised are
    comments of the draft.

    Raises
    ------
    LayoutError
        The table cannot be read, or has no header or no column of times.
    """
    text, encoding = _read(path)
    delimiter = _delimiter(text, path)
    top, header, rows = _table(text, delimiter, path)
    top = {"encoding": encoding, "delimiter": delimiter} | top
    columns = {name: [row[i] for row in rows] for i, name in enumerate(header) if name}
    words = {name: _words(name) for name in columns}
    lines = [f"# drafted from {path.name}; check every unit and sign"]
    lines += [f"{key} = {_toml(value)}" for key, value in top.items()]
    remarks: list[str] = []
    taken = _time_section(columns, words, lines, remarks, path)
    roles = _roles(words, taken)
    if "latitude" in roles and "longitude" in roles:
        lines += _position_section(roles, columns, remarks)
    for role, name in roles.items():
        if role not in ("latitude", "longitude"):
            unit, basis = _unit(role, name, words[name][1], columns, top["decimal_comma"])
            lines += ["", f"[{role}]", f"column = {_toml(name)}", f"unit = {_toml(unit)}"]
            remarks.append(f"{name!r}: {role} in {unit} ({basis}); positive: {_sense(role)}")
    rest = [n for n in columns if n not in taken and n not in roles.values()]
    if rest:
        lines += ["", "# not recognised; a further quantity needs column, unit and positive:"]
        lines += [f"# column {_toml(name)}" for name in rest]
        remarks.append(f"not recognised, comments in the draft: {', '.join(map(repr, rest))}")
    draft = "\n".join(lines) + "\n"
    if {"yaw_rate", "heading"} <= set(roles):
        draft, remark = _compare_with_heading(draft, path)
        remarks.append(f"{roles['yaw_rate']!r}: {remark}")
    return Draft(draft, tuple(remarks))


def _compare_with_heading(draft: str, path: Path) -> tuple[str, str]:
    """Correct unit and sign of the yaw rate by the derivative of the heading; add a remark."""
    try:
        log = read_table(path, parse_layout(draft, "draft"))
    except LayoutError as error:
        return draft, f"not compared with the heading ({error})"
    rate, heading = log["yaw_rate"], log["heading"]
    secs = (heading.measured_ns - heading.measured_ns[0]) * 1e-9
    good = np.isfinite(rate.values) & np.isfinite(heading.values)
    if np.count_nonzero(good) < 20:
        return draft, "not compared with the heading, too few rows"
    secs, values, yaw = secs[good], rate.values[good], np.unwrap(heading.values[good])
    turned = np.append(0.0, np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(secs)))
    turned, yaw = turned - turned.mean(), yaw - yaw.mean()
    if np.ptp(yaw) < np.radians(5) or np.ptp(turned) == 0:
        return draft, "not compared with the heading, the ship hardly turns"
    if abs(np.corrcoef(turned, yaw)[0, 1]) < 0.9:
        return draft, "does not agree with the heading's derivative; check both columns"
    ratio = float(turned @ yaw / (turned @ turned))
    section = draft[draft.index("[yaw_rate]") :]
    now = section.split('unit = "')[1].split('"')[0]
    factors = {unit: UNITS[unit][1] / UNITS[now][1] for unit in ("deg/min", "deg/s", "rad/s")}
    unit = min(factors, key=lambda name: abs(np.log(abs(ratio) / factors[name])))
    if abs(abs(ratio) / factors[unit] - 1) > 0.3:
        return draft, f"is {1 / ratio:.3g} times the heading's derivative; check its unit"
    sign = "\nsign = -1" if ratio < 0 else ""
    changed = section.replace(f'unit = "{now}"', f'unit = "{unit}"{sign}', 1)
    side = "port" if ratio < 0 else "starboard"
    return (
        draft.replace(section, changed),
        f"{unit}, positive to {side}, by the heading's derivative",
    )


def _sense(role: str) -> str:
    return CATALOGUE[role].positive


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    escaped = str(value).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'


def _read(path: Path) -> tuple[str, str]:
    """Return the first lines of a table, and its encoding."""
    try:
        data = path.read_bytes()[:1_000_000]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LayoutError(f"cannot read: {reason}: {path}") from error
    data = b"\n".join(data.splitlines()[:SAMPLE_LINES])
    for encoding in ENCODINGS:
        try:
            return data.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    raise LayoutError(f"not text in {' or '.join(ENCODINGS)}; write the layout by hand: {path}")


def _delimiter(text: str, path: Path) -> str:
    """Return the delimiter that splits most lines into the same number of cells, above one."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    scores = {}
    for name, sign in DELIMITERS.items():
        counts = [len(line.split(sign)) for line in lines]
        typical = max(set(counts), key=counts.count) if counts else 0
        scores[name] = (counts.count(typical) > 0.9 * len(counts) and typical > 1, sign is not None)
    for name in (";", "tab", ",", "whitespace"):
        if scores[name][0]:
            return name
    raise LayoutError(
        f"no delimiter splits the lines into columns; write the layout by hand: {path}"
    )


def _table(
    text: str, delimiter: str, path: Path
) -> tuple[dict[str, object], list[str], list[list[str]]]:
    """Split the text; return the keys of the top level, the header and the rows."""
    sign = DELIMITERS[delimiter]
    try:
        cells = (
            [line.split() for line in text.splitlines()] if sign is None
            else list(csv.reader(io.StringIO(text), delimiter=sign, skipinitialspace=True))
        )  # fmt: skip
    except csv.Error as error:
        raise LayoutError(f"cannot be split ({error}); write the layout by hand: {path}") from error
    counts = [len(row) for row in cells if any(row)]
    typical = max(set(counts), key=counts.count) if counts else 0
    first = next((i for i, row in enumerate(cells) if len(row) >= typical - 1 and any(row)
                  and not row[0].startswith("#") and len(row) > 1), 0)  # fmt: skip
    header = [cell.strip() for cell in cells[first]] if cells else []
    rows = [[cell.strip() for cell in row] for row in cells[first + 1 :]
            if any(map(str.strip, row)) and not row[0].startswith("#")]  # fmt: skip
    if not rows or any(_is_number(cell) for cell in header):
        raise LayoutError(f"no header above the numbers; write the layout by hand: {path}")
    rows = [row + [""] * (len(header) - len(row)) for row in rows]
    numbers = [cell for row in rows[:100] for cell in row]
    comma = delimiter != "," and any(re.fullmatch(r"[+-]?\d+,\d+", cell) for cell in numbers)
    return {"skip_rows": first, "header": True, "decimal_comma": comma}, header, rows


def _is_number(text: str) -> bool:
    return bool(re.fullmatch(r"[+-]?\d+([.,]\d*)?([eE][+-]?\d+)?", text.strip()))


def _words(name: str) -> tuple[str, str]:
    """Return the words of a header joined by underscores, and the unit stated in it."""
    match = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]\s*", name)
    words, unit = (match[1], match[2]) if match else (name, "")
    unit = UNIT_WORDS.get(unit.lower(), unit)
    if not match:  # such as speed_kn
        head, _, tail = name.rpartition("_")
        tail = UNIT_WORDS.get(tail.lower(), tail)
        if head and tail in UNITS:
            words, unit = head, tail
    return re.sub(r"[^a-z0-9]+", "_", words.lower()).strip("_"), unit


def _roles(words: dict[str, tuple[str, str]], taken: Sequence[str]) -> dict[str, str]:
    """Return the header of each quantity that is recognised."""
    roles: dict[str, str] = {}
    for pattern, role in HEADER_WORDS:
        for name, (text, _) in words.items():
            if role not in roles and name not in taken and re.fullmatch(pattern, text):
                roles[role] = name
    return roles


def _time_section(
    columns: dict[str, list[str]],
    words: dict[str, tuple[str, str]],
    lines: list[str],
    remarks: list[str],
    path: Path,
) -> list[str]:
    """Add the section of the time; return its columns."""
    texts = [n for n, cells in columns.items() if cells[0] and all(map(is_time_text, cells[:20]))]
    dates = [n for n, (text, _) in words.items() if text == "date" and n not in texts]
    named = [n for n, (text, _) in words.items() if re.fullmatch(TIME_WORDS, text)]
    if not texts and not named:
        raise LayoutError(
            f"no column of times among {', '.join(map(repr, columns))}; "
            f"write the layout by hand: {path}"
        )
    name = (texts or named)[0]
    lines += ["", "[time]", f"column = {_toml(name)}"]
    if not texts:
        unit = words[name][1] if UNITS.get(words[name][1], ("",))[0] == "s" else ""
        first = _numbers(columns[name], comma=True)[0]
        basis = "its header" if unit else "the size of its numbers"
        unit = unit or ("ms" if first > 1e11 else "s")
        lines.append(f"unit = {_toml(unit)}")
        remarks.append(f"{name!r}: time in {unit} ({basis})")
        return [name]
    cells = columns[name][0]
    dated = re.search(r"\d[-./]\w+[-./]\d|\d{8}T", cells)
    used = [name]
    if not dated and dates:
        lines.append(f"date = {_toml(dates[0])}")
        used.append(dates[0])
    if not re.search(r"(Z|UTC|GMT|[+-]\d\d:?\d\d)$", cells):
        lines.append('zone = "UTC"  # assumed')
        remarks.append(f"{name!r}: no time zone is printed; UTC is assumed, correct time.zone")
    printed = columns[used[-1]]
    if not re.match(r"\d{4}", printed[0]) and re.match(r"\d{1,2}[-./]\d{1,2}[-./]", printed[0]):
        pairs = [re.split(r"[-./ ]", text)[:2] for text in printed if text]
        month_first = any(pair[1].isdigit() and int(pair[1]) > 12 for pair in pairs)
        day_first = any(pair[0].isdigit() and int(pair[0]) > 12 for pair in pairs)
        order = "mdy" if month_first else "dmy"
        note = "" if day_first or month_first else "  # assumed"
        lines.append(f"date_order = {_toml(order)}{note}")
        if note:
            remarks.append(f"{used[-1]!r}: day and month are ambiguous; dmy is assumed, correct it")
    remarks.append(f"{' and '.join(map(repr, used))}: time (its cells)")
    return used


def _position_section(
    roles: dict[str, str], columns: dict[str, list[str]], remarks: list[str]
) -> list[str]:
    """Return the section of the position."""
    pair = [(role, roles[role]) for role in ("latitude", "longitude")]
    packed = any(looks_packed(columns[name], role) for role, name in pair)
    for (_, name), limit in zip(pair, (91, 361), strict=True):
        packed |= bool(np.nanmedian(np.abs(_numbers(columns[name], comma=True))) > limit)
    unit = "ddmm.mmmm" if packed else "deg"
    remarks.append(f"{pair[0][1]!r} and {pair[1][1]!r}: position in {unit} (header and cells)")
    places = [f"{role} = {_toml(name)}" for role, name in pair]
    return ["", "[position]", *places, f"unit = {_toml(unit)}"]


def _numbers(cells: Sequence[str], *, comma: bool) -> FloatArray:
    plain = [cell.replace(",", ".") if comma else cell for cell in cells]
    values = np.array([float(text) if _is_number(text) else np.nan for text in plain])
    return values if np.any(np.isfinite(values)) else np.zeros(len(values))


def _unit(
    role: str,
    name: str,
    stated: str,
    columns: dict[str, list[str]],
    comma: object,
) -> tuple[str, str]:
    """Return the unit of a column, and what it is based on."""
    kind = CATALOGUE[role]
    if stated in UNITS and UNITS[stated][0] == kind.unit:
        return stated, "unit stated in the header"
    values = _numbers(columns[name], comma=bool(comma))
    largest = float(np.nanmax(np.abs(values)))
    if kind.unit == "rad":
        unit = "rad" if 0 < largest <= (6.3 if kind.circular else 0.8) else "deg"
        return unit, f"values up to {largest:.3g}; check"
    if role == "rpm" and 0 < largest < 10:
        return "rev/s", f"values up to {largest:.3g}; check"
    return USUAL_UNITS.get(role, kind.display_unit), "assumed, the header states none; check"
