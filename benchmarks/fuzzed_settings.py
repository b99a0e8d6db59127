"""Texts that settings and headers of tables are read from, with random errors."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from analysis.linear.system_file import parse_system
from recorders.csv_lines.device import parse_device
from recorders.trial.trial_file import load_trial_file
from shiplog.layouts.layout_parser import parse_layout
from shiplog.layouts.mcap_layout_parser import parse_mcap_layout
from shiplog.tables.foreign import read_table
from shiplog.tables.table_header import read_header
from shiplog.vessel.vessel_parser import parse_vessel

PROJECT = Path(__file__).parents[1]
SAMPLES = PROJECT / "sample_data"

VESSEL = """
name = "a tanker"
length = 320.0
approach_rpm = 90.0
angle_unit = "deg"
[yaw]
T1 = 150.0
T2 = 50.0
T3 = 0.5
c2 = 10.0
c3 = 20.0
[rudder]
alpha1 = 1.0
alpha2 = 0.0
alpha3 = 0.0
max = 35.0
rate = 2.5
[surge]
f = -0.1
g = -0.0003
h = 0.0004
[model]
name = "norrbin"
speed = 8.0
rpm = 90.0
a = -0.4
a3 = -0.1
k = 0.5
f = -0.5
g = -0.05
h = 0.05
[filter]
kind = "extended"
smooth = true
gate = 6.0
yaw_rate_std = 1e-4
process_ratio = 2.5e-5
wave = true
sensor_bias = ["gyro", "log"]
[disturbance]
models = ["constant", "wave"]
spectrum = "butterworth"
wave_frequency = 0.6
[identifier]
window_secs = 200.0
"""
TRIAL = """
[output]
file = "trial.mcap"
rotate_minutes = 60
flush_secs = 0.25
[vessel]
file = "table1"
[conditions]
loading = "ballast"
draught_forward = 7.9
beaufort = 3
[[source]]
name = "gyro"
format = "nmea0183"
address = "udp://127.0.0.1:60004"
time = "gnss"
[[source]]
name = "engine"
format = "csv-lines"
address = "tcp://127.0.0.1:60005"
raw = true
"""
TABLE = (
    'metadata {"place": "Neva"}',
    'channel {"name": "yaw_rate", "source": "gyro", "unit": "rad/s", "fields": [], "metadata": {}}',
    (
        'channel {"name": "position", "source": "gnss", "unit": "1", "metadata": {"a": "b"}, '
        '"fields": ["latitude", "longitude", "altitude"]}'
    ),
    'event {"time_ns": 5, "text": "execute", "source": "bridge", "level": "info"}',
    'vessel "length = 320.0"',
)
# values of wrong types, beyond any limit, and texts that no terminal should get
VALUES = (
    '""', '"x"', '"\\u001b[2J"', '"\\u202e\\u0000"', '"é" ', "0", "-1", "1e400", "-1e300", "5e-324",
    "0.5", "-0.25", "1e-9", "1e9", "3", "100", "nan", "-inf", "true", "[]", "[[]]", "{}",
    "{a = 1}", "[1, 'a', [2.5], {}]", "[0, -1, nan]", "2020-01-01", "07:32:00",
    "2020-01-01T00:00:00Z", "9223372036854775807", "-9223372036854775808", "9223372036854775808",
    "1" + "0" * 400, '"' + "x" * 5000 + '"', "[" * 19 + "]" * 19, "[" * 300 + "]" * 300,
    '["gyro", "gyro"]', "0.1.2", "= 1", '"constant"', "[0.1]", "1_000", "'''\n\n'''",
    ".".join("ab" * 30) + " = 1", "[1, 2, 3, 4, 5, 6, 7, 8, 9]",
)  # fmt: skip
_SETTING = re.compile(r"^(?P<key>[\w.]+)\s*=\s*(?P<value>.*)$", re.MULTILINE)
_INNER = re.compile(r"(?<=[=\[,{ ])\s*(?:\"[^\"\n]*\"|[-+\d.e]+|true)(?=\s*[,\]}\n#])")


@dataclass(frozen=True)
class FuzzedText:
    """A kind of text, and what reads it.

    Attributes
    ----------
    name
        The kind.
    texts
        Valid texts of this kind.
    read
        Reads one, as the command line does with a file.
    values
        What may stand in the place of a value.
    """

    name: str
    texts: tuple[str, ...]
    read: Callable[[str], object]
    values: tuple[str, ...] = VALUES


def mutated(kind: FuzzedText, rng: Random) -> str:
    """Return a text of a kind with one to three errors."""
    text = rng.choice(kind.texts)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        text = rng.choice(_MUTATIONS)(text, rng, kind.values)
    return text


def _other_value(text: str, rng: Random, values: tuple[str, ...]) -> str:
    """Put another value in the place of one, whole or within a list."""
    places = list((_INNER if rng.random() < 0.5 else _SETTING).finditer(text))
    if not places:
        return text
    match = rng.choice(places)
    start, end = match.span("value" if match.re is _SETTING else 0)
    return f"{text[:start]} {rng.choice(values)}{text[end:]}"


def _other_key(text: str, rng: Random, values: tuple[str, ...]) -> str:
    """Give the key of another line, an unknown one or none to a line."""
    lines = text.split("\n")
    here, there = rng.choice(lines), rng.choice(lines)
    key = rng.choice((there.partition("=")[0], "unknown", '"\\u001b[2J"', "", rng.choice(values)))
    return text.replace(here, f"{key}={here.partition('=')[2]}", 1)


def _other_lines(text: str, rng: Random, _: tuple[str, ...]) -> str:
    """Omit, repeat or exchange lines."""
    lines = text.split("\n")
    here, there = rng.randrange(len(lines)), rng.randrange(len(lines))
    way = rng.randrange(3)
    if way == 0:
        del lines[here]
    elif way == 1:
        lines.insert(there, lines[here])
    else:
        lines[here], lines[there] = lines[there], lines[here]
    return "\n".join(lines)


def _other_characters(text: str, rng: Random, _: tuple[str, ...]) -> str:
    """Put other characters in the place of some, or cut the text off."""
    if rng.random() < 0.2:
        return text[: rng.randrange(len(text) + 1)]
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice("\"'\\[]{}=.,#\n\r\t\0\x1b-0e_é") + text[at + rng.randrange(3) :]


_MUTATIONS = (_other_value, _other_value, _other_value, _other_key, _other_lines, _other_characters)


def _files(*names: str) -> tuple[str, ...]:
    return tuple((PROJECT / name).read_text(encoding="utf-8") for name in names)


def _read_bridge(text: str) -> object:
    return read_table(SAMPLES / "bridge.csv", parse_layout(text, "bridge.toml"))


def _load_trial(text: str) -> object:
    with TemporaryDirectory() as folder:
        path = Path(folder, "trial.toml")
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        return load_trial_file(path)


def _json_values() -> tuple[str, ...]:
    deep = "[" * 100_000 + "]" * 100_000
    texts = ("null", "true", "0", "-1", "1e400", "NaN", '""', '"\\u0000"', '"\\ud800"', "[]", "{}")
    return (*texts, deep, "9" * 5000, json.dumps("x" * 5000), '{"a": 1}', '["a", 1]', "1.5")


KINDS = (
    FuzzedText("vessel file", (VESSEL,), lambda text: parse_vessel(text, "ship.toml")),
    FuzzedText(
        "layout of a table",
        _files("sample_data/layouts/bridge.toml"),
        _read_bridge,
    ),
    FuzzedText(
        "layout of an MCAP file",
        _files(
            "shiplog/foreign_mcap/ready_layouts/Imu.toml",
            "shiplog/foreign_mcap/ready_layouts/Odometry.toml",
        ),
        lambda text: parse_mcap_layout(text, "ros.toml"),
    ),
    FuzzedText(
        "description of a device",
        _files("sample_data/layouts/weather_lines.toml"),
        lambda text: parse_device(text, "wind.toml"),
    ),
    FuzzedText("trial file", (TRIAL,), _load_trial),
    FuzzedText(
        "system file",
        _files(
            "examples/systems/roll.toml",
            "examples/systems/heading_loop.toml",
            "examples/systems/speed_and_thrust.toml",
            "examples/systems/heading_regulator.toml",
        ),
        lambda text: parse_system(text, "roll.toml"),
    ),
    FuzzedText(
        "header of a table",
        ("\n".join(TABLE),),
        lambda text: read_header("a.csv", text.split("\n")),
        _json_values(),
    ),
)
