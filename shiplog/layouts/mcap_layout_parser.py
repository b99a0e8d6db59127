"""Parser of the layouts of MCAP files: the sections of channels, with topics and fields."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shiplog.errors import LayoutError
from shiplog.toml_text import list_errors, parse_toml
from shiplog.units import CATALOGUE, GEOGRAPHIC

from .channel_sections import SectionParser
from .field_paths import parse_path
from .layout import DEGREES_MINUTES, VELOCITIES, Column
from .layout_parser import KIND
from .mcap_layout import (
    ASSUMABLE,
    AXES,
    MESSAGE_TIMES,
    QUATERNION,
    FieldChannel,
    McapLayout,
    TopicChoice,
)

_FURTHER_KEYS = ("topic", "type", "stamp", "axes", "assumed")
_ORIENTATION = ("heading", "roll", "pitch")  # what a quaternion gives
_FROM_NORTH = ("heading", "course_over_ground")  # angles that can be stated in axes
_PLANE = ("north", "east")


def parse_mcap_layout(text: str, where: str) -> McapLayout:
    """Parse the text of the layout of an MCAP file.

    Parameters
    ----------
    text
        TOML; docs/foreign_mcap.md describes the keys.
    where
        Name of the file, for messages.

    Raises
    ------
    LayoutError
        The text has errors; the message lists all of them.

    Examples
    --------
    >>> text = '''
    ... [yaw_rate]
    ... topic = "/imu"
    ... field = "angular_velocity.z"
    ... unit = "rad/s"
    ... sign = -1
    ... '''
    >>> parse_mcap_layout(text, "ros.toml").channels[0].paths
    ('angular_velocity.z',)
    """
    return _McapLayoutParser(parse_toml(text, where, KIND, LayoutError), where).layout()


class _McapLayoutParser(SectionParser):
    """The sections of the layout of an MCAP file, and their errors."""

    place_key = "field"
    place_words = "a path of fields such as 'twist.linear.x' or 'data[0]'"
    top_keys = ("name", "source")
    position_texts = ()

    def __init__(self, table: Mapping[str, Any], where: str) -> None:
        super().__init__(table, where)
        self._top: dict[str, str] = {}
        self._choices: dict[str, TopicChoice] = {}  # by the name of the section
        self._axes: dict[str, str] = {}
        self._assumed: list[str] = []

    def layout(self) -> McapLayout:
        """Return the layout, or raise all its errors at once."""
        sections = [section for section in self.table.values() if isinstance(section, dict)]
        if any("column" in section for section in sections):
            raise LayoutError(
                "a layout of a table, but the file is MCAP; `shiplog layout FILE.mcap` drafts one "
                f"for it, and a log of shiplog needs none: {self.where}"
            )
        self.parse_file()
        self._find_contradictions()
        if self.errors:
            raise LayoutError(list_errors(self.errors, KIND, self.where))
        top = {"name": Path(self.where).stem} | self._top
        channels = tuple(self._channels())
        return McapLayout(
            where=self.where, channels=channels, assumed=tuple(self._assumed), **top
        )  # fmt: skip

    def further_keys(self, role: str) -> tuple[str, ...]:  # noqa: ARG002
        """Return the keys of the messages and of their axes."""
        return _FURTHER_KEYS

    def is_place(self, place: object) -> bool:
        """Whether a value is a path of fields."""
        return isinstance(place, str) and parse_path(place) is not None

    def is_special_unit(self, name: str, unit: object) -> bool:
        """Whether a unit is that of an orientation."""
        return unit == QUATERNION and name in _ORIENTATION

    def parse_further(self, role: str, section: Mapping[str, Any]) -> None:
        """Parse topic, type, stamp, axes and what is assumed."""
        texts = {key: section.get(key, "") for key in ("topic", "type", "stamp")}
        for key, text in texts.items():
            if not isinstance(text, str) or (key in section and not text):
                self.errors.append(f"{role}.{key} must be a text, got {text!r:.60}")
        if "topic" not in section and "type" not in section:
            self.errors.append(f"[{role}] lacks topic, or the type that selects it")
        self._check_stamp(f"{role}.stamp", texts["stamp"])
        self._choices[role] = TopicChoice(**{key: str(text) for key, text in texts.items()})
        self._parse_axes(role, section)
        self._parse_assumed(role, section)
        if section.get("unit") == DEGREES_MINUTES:
            self.errors.append(f"{role}.unit {DEGREES_MINUTES!r} is of tables; use deg or rad")

    def _parse_axes(self, role: str, section: Mapping[str, Any]) -> None:
        name = role.partition(".")[0]
        is_orientation = section.get("unit") == QUATERNION
        axes = section.get("axes", "")
        if "axes" not in section:
            if is_orientation and name in _ORIENTATION:
                self.errors.append(f"[{role}] lacks axes, {' or '.join(map(repr, AXES))}")
            return
        if axes not in AXES:
            self.errors.append(f"{role}.axes must be {' or '.join(map(repr, AXES))}, got {axes!r}")
        elif not is_orientation and name not in _FROM_NORTH:
            self.errors.append(f"{role}.axes is of a quaternion or an angle from north; use sign")
        elif "sign" in section:
            self.errors.append(f"[{role}] has axes, which determine its sign; remove sign")
        self._axes[role] = str(axes)

    def _parse_assumed(self, role: str, section: Mapping[str, Any]) -> None:
        text = section.get("assumed", "")
        names = [name.strip() for name in str(text).split(",")] if text else []
        if "assumed" in section and (not names or any(name not in ASSUMABLE for name in names)):
            self.errors.append(
                f"{role}.assumed must be some of {', '.join(ASSUMABLE)}, got {text!r:.60}"
            )
        self._assumed += [f"{name} of {role}" for name in names]

    def parse_top(self, key: str, value: object) -> None:
        good = isinstance(value, str) and bool(value) and value.isprintable()
        if not good or (key == "source" and "/" in str(value)):
            without = " without '/'" if key == "source" else ""
            self.errors.append(f"{key} must be a string{without}, got {value!s:.60}")
        self._top[key] = str(value)

    def parse_time(self, section: Mapping[str, Any]) -> None:
        """Parse the time of measurement that all messages have."""
        self.check_keys("time", section, ("stamp", "unit"))
        self.require("time", section, ("stamp",))
        self._check_stamp("time.stamp", section.get("stamp", ""))
        if "unit" in section:
            self.check_unit("time.unit", section["unit"], "s")
        self._top["stamp"] = str(section.get("stamp", ""))
        self._top["stamp_unit"] = str(section.get("unit", ""))

    def _check_stamp(self, label: str, stamp: object) -> None:
        if stamp and not self.is_place(stamp):
            times = " or ".join(map(repr, MESSAGE_TIMES))
            self.errors.append(f"{label} must be a path of fields, {times}, got {stamp!r:.60}")

    def _find_contradictions(self) -> None:
        """Check values that are right by themselves but contradict each other."""
        if not self._choices and not self.errors:
            self.errors.append(f"no channel is given, possible are {', '.join(CATALOGUE)}")
        velocities = [name for name in VELOCITIES if name in self._choices]
        if len(velocities) == 1:
            self.errors.append(f"[{velocities[0]}] needs the other component, too")
        elif velocities and len({self._choices[name] for name in velocities}) > 1:
            self.errors.append(f"{' and '.join(VELOCITIES)} must be of the same messages")

    def _channels(self) -> list[FieldChannel]:
        """Return the channels of sections without errors."""
        channels = []
        for label, choice in self._choices.items():
            name, _, source = label.partition(".")
            if name == VELOCITIES[1]:
                continue
            columns, components = self._columns(label)
            channels.append(
                FieldChannel(
                    "velocity" if name == VELOCITIES[0] else name,
                    source,
                    choice,
                    tuple(str(column.place) for column in columns),
                    tuple(column.unit for column in columns),
                    tuple(column.sign for column in columns),
                    components,
                    self._axes.get(label, ""),
                    columns[0].metadata,
                )
            )
        return channels

    def _columns(self, label: str) -> tuple[list[Column], tuple[str, ...]]:
        """Return the columns of a section, and the names of its components."""
        name, _, source = label.partition(".")
        if name == VELOCITIES[0]:
            return [self.found[velocity] for velocity in VELOCITIES], _PLANE
        if name != "position":
            return [self.found[label]], ()
        suffix = f".{source}" if source else ""
        components = GEOGRAPHIC if f"latitude{suffix}" in self.found else _PLANE
        found = {each: self.found.get(f"{each}{suffix}") for each in components}
        return [column for column in found.values() if column], tuple(
            each for each, column in found.items() if column
        )
