"""Draft of a layout, from the header and the values of a foreign table."""

import re
from pathlib import Path

import numpy as np

from shiplog.errors import LayoutError
from shiplog.layouts.header_words import named_unit, recognise, split_header
from shiplog.layouts.layout import HEMISPHERES, Draft
from shiplog.layouts.layout_parser import parse_layout
from shiplog.printable import printable
from shiplog.toml_output import toml_string
from shiplog.units import CATALOGUE, UNITS

from .draft_sample import read_sample, sample_numbers
from .draft_times import draft_times
from .foreign import read_table
from .printed_positions import looks_packed

POSITION = ("latitude", "longitude", *HEMISPHERES)

USUAL_UNITS = {"yaw_rate": "deg/min", "speed": "kn", "rpm": "rpm"}  # where nothing is stated


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
    sample = read_sample(path)
    columns, comma = sample.columns, bool(sample.keys["decimal_comma"])
    words = {name: split_header(name) for name in columns}
    for name, text in sample.units.items():
        if name in words and named_unit(text) in UNITS:
            words[name] = (words[name][0], named_unit(text))
    time = draft_times(columns, words)
    if time is None:
        raise LayoutError(
            f"no column of times among {', '.join(map(repr, columns))}; "
            f"write the layout by hand: {path}"
        )
    lines = [f"# drafted from {printable(path.name)}; check every unit and sign"]
    lines += [f"{key} = {_toml(value)}" for key, value in sample.keys.items()]
    lines += ["", "[time]", *(f"{key} = {_toml(value)}" for key, value in time.entries.items())]
    remarks = list(time.remarks)
    taken = [time.entries[key] for key in ("column", "date") if key in time.entries]
    roles = recognise({name: text for name, (text, _) in words.items()}, taken)
    for source, position in _receivers(roles).items():
        lines += _position_section(source, position, columns, remarks)
        taken += position.values()
    roles = {role: name for role, name in roles.items() if role.partition(".")[0] not in POSITION}
    for role, name in roles.items():
        unit, basis = _unit(role.partition(".")[0], columns[name], words[name][1], comma)
        lines += ["", f"[{role}]", f"column = {_toml(name)}", f"unit = {_toml(unit)}"]
        sense = CATALOGUE[role.partition(".")[0]].positive
        remarks.append(f"{name!r}: {role} in {unit} ({basis}); positive: {sense}")
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


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    return toml_string(str(value))


def _receivers(roles: dict[str, str]) -> dict[str, dict[str, str]]:
    """Return the columns of each position that has latitude and longitude, by its source."""
    receivers: dict[str, dict[str, str]] = {}
    for role, column in roles.items():
        name, _, source = role.partition(".")
        if name in POSITION:
            receivers.setdefault(source, {})[name] = column
    return {s: names for s, names in receivers.items() if {"latitude", "longitude"} <= set(names)}


def _position_section(
    source: str, roles: dict[str, str], columns: dict[str, list[str]], remarks: list[str]
) -> list[str]:
    """Return the section of the position from one source."""
    pair = [(role, roles[role]) for role in ("latitude", "longitude")]
    packed = any(looks_packed(columns[name], role) for role, name in pair)
    for (_, name), limit in zip(pair, (91, 361), strict=True):
        packed |= bool(np.nanmedian(np.abs(sample_numbers(columns[name], comma=True))) > limit)
    unit = "ddmm.mmmm" if packed else "deg"
    section = f"position.{source}" if source else "position"
    remarks.append(f"{pair[0][1]!r} and {pair[1][1]!r}: {section} in {unit} (header and cells)")
    if not set(HEMISPHERES) <= set(roles):
        roles = dict(pair)
    places = [f"{role} = {_toml(name)}" for role, name in roles.items()]
    return ["", f"[{section}]", *places, f"unit = {_toml(unit)}"]


def _unit(role: str, cells: list[str], stated: str, comma: bool) -> tuple[str, str]:
    """Return the unit of a column, and what it is based on."""
    kind = CATALOGUE[role]
    if stated == "ms" and kind.unit == "m/s":
        stated = "m/s"
    if stated in UNITS and UNITS[stated][0] == kind.unit:
        return stated, "unit stated in the table"
    letters = [re.sub(r"[PpSs]|STBD|PORT", "", cell).strip() for cell in cells]
    largest = float(np.nanmax(np.abs(sample_numbers(letters, comma=comma))))
    if kind.unit == "rad":
        unit = "rad" if 0 < largest <= (6.3 if kind.circular else 0.8) else "deg"
        return unit, f"values up to {largest:.3g}; check"
    if role == "rpm" and 0 < largest < 10:
        return "rev/s", f"values up to {largest:.3g}; check"
    return USUAL_UNITS.get(role, kind.display_unit), "assumed, the table states none; check"
