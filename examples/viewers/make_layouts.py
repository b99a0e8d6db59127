"""Write layouts for PlotJuggler and Foxglove that fit the topics of a log.

    python examples/viewers/make_layouts.py trial.mcap [FOLDER]

A topic is `/CHANNEL/SOURCE`, so that a layout fits the logs that have the same sources. Those in
this folder fit `shiplog record nmea0183 sample_data/ship.nmea -o ship.mcap`.
"""

import json
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

from shiplog.checks.info import read_log_info
from shiplog.checks.log_content import ChannelInfo
from shiplog.units import GEOGRAPHIC, conversion_factor

PANELS = {  # title: the channels, with the unit in which PlotJuggler shows them
    "rudder [deg]": {"rudder": "deg", "rudder_order": "deg"},
    "heading [deg]": {"heading": "deg"},
    "yaw rate [deg/min]": {"yaw_rate": "deg/min"},
    "speed [kn]": {"speed": "kn", "speed_over_ground": "kn"},
    "rpm": {"rpm": "rpm"},
}
COLOURS = "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b"
MARGIN = 0.05  # of an axis beyond the values


@dataclass(frozen=True)
class Curve:
    """A channel in a panel, its unit in the log, and the one in which it is shown."""

    channel: ChannelInfo
    unit: str
    shown: str

    @property
    def factor(self) -> float:
        """The factor from the unit of the log to that of the panel."""
        return conversion_factor(self.unit, self.shown)

    @property
    def limits(self) -> tuple[float, float]:
        """The lowest and the highest value, in the unit of the panel."""
        values = self.channel.ranges[0]
        scale = conversion_factor(values.unit, self.shown)
        return values.lowest * scale, values.highest * scale


def main() -> None:
    """Write `plotjuggler.xml` and `foxglove.json` to the folder, by default the current one."""
    log, *rest = sys.argv[1:]
    folder = Path(rest[0]) if rest else Path()
    for name, text in layouts_of(log).items():
        (folder / name).write_text(text, encoding="utf-8")
        print(folder / name)


def layouts_of(log: str | Path) -> dict[str, str]:
    """Return the texts of the layouts by the names of their files."""
    info = read_log_info(log)
    panels = {
        title: [
            Curve(channel, channel.unit, units[name])
            for channel in info.channels
            if (name := channel.topic.split("/")[1]) in units and channel.ranges
        ]
        for title, units in PANELS.items()
    }
    panels = {title: curves for title, curves in panels.items() if curves}
    positions = [channel for channel in info.channels if channel.topic.startswith("/position/")]
    return {
        "plotjuggler.xml": plotjuggler_layout(panels, positions, info.duration_secs),
        "foxglove.json": foxglove_layout(panels, positions, has_events=bool(info.events)),
    }


def plotjuggler_layout(
    panels: dict[str, list[Curve]], positions: Sequence[ChannelInfo], secs: float
) -> str:
    """Return a layout of PlotJuggler: the panels one above the other, and the track beside them.

    The field of a message is a part of the name of its curve, such as ``/rudder/AG/value``.
    """
    root = ET.Element("root", version="2.3.8")
    window = ET.SubElement(root, "tabbed_widget", name="Main Window", parent="main_window")
    tab = ET.SubElement(window, "Tab", tab_name="shiplog", containers="1")
    page = _splitter(ET.SubElement(tab, "Container"), "|", 1 + bool(positions))
    column = _splitter(page, "-", len(panels))
    for title, curves in panels.items():
        _time_series(column, title, curves, secs)
    if positions:
        _track(page, positions)
    ET.SubElement(window, "currentTabIndex", index="0")
    ET.SubElement(root, "use_relative_time_offset", enabled="1")
    ET.indent(root, " ")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, encoding='unicode')}\n"


def _splitter(parent: ET.Element, orientation: str, count: int) -> ET.Element:
    sizes = ";".join(f"{1 / count:.6g}" for _ in range(count))
    attributes = {"orientation": orientation, "count": str(count), "sizes": sizes}
    return ET.SubElement(parent, "DockSplitter", attributes)


def _plot(
    parent: ET.Element, title: str, mode: str, x: tuple[float, float], y: tuple[float, float]
) -> ET.Element:
    """Add a plot with the ranges of its axes."""
    area = ET.SubElement(parent, "DockArea", name=title)
    attributes = {"mode": mode, "style": "Lines", "flip_x": "false", "flip_y": "false"}
    plot = ET.SubElement(area, "plot", attributes)
    (left, right), (bottom, top) = x, (_widened(*y))
    ends = {"left": left, "right": right, "bottom": bottom, "top": top}
    ET.SubElement(plot, "range", {name: f"{value:.6f}" for name, value in ends.items()})
    ET.SubElement(plot, "limitY")
    return plot


def _widened(low: float, high: float) -> tuple[float, float]:
    pad = MARGIN * (high - low or 1.0)
    return low - pad, high + pad


def _time_series(parent: ET.Element, title: str, curves: list[Curve], secs: float) -> None:
    lows, highs = zip(*(curve.limits for curve in curves), strict=True)
    plot = _plot(parent, title, "TimeSeries", (0.0, secs), (min(lows), max(highs)))
    for number, curve in enumerate(curves):
        topic = curve.channel.topic
        element = ET.SubElement(
            plot, "curve", name=f"{topic}/value", color=COLOURS[number % len(COLOURS)]
        )
        if curve.factor != 1.0:
            alias = f"{topic} [{curve.shown}]"
            transform = ET.SubElement(element, "transform", name="Scale/Offset", alias=alias)
            ET.SubElement(
                transform, "options", time_offset="0", value_offset="0",
                value_scale=f"{curve.factor:.9g}",
            )  # fmt: skip


def _track(parent: ET.Element, positions: Sequence[ChannelInfo]) -> None:
    """Add the track: north over east, or latitude over longitude."""
    channel = positions[0]
    ranges = {each.component: (each.lowest, each.highest) for each in channel.ranges}
    y, x = ("latitude", "longitude") if set(ranges) & set(GEOGRAPHIC) else ("north", "east")
    unit = "deg" if y == "latitude" else "m"
    plot = _plot(parent, f"{y} over {x} [{unit}]", "XYPlot", _widened(*ranges[x]), ranges[y])
    ET.SubElement(
        plot, "curve", name=f"{channel.topic}/[{x};{y}]", color=COLOURS[0],
        curve_x=f"{channel.topic}/{x}", curve_y=f"{channel.topic}/{y}",
    )  # fmt: skip


def foxglove_layout(
    panels: dict[str, list[Curve]], positions: Sequence[ChannelInfo], *, has_events: bool
) -> str:
    """Return a layout of Foxglove or Lichtblick: plots, the map or the track, and the events.

    Angles are converted to degrees; other values stay in the units of the log, as message paths
    have no other factors.
    """
    configs: dict[str, dict[str, object]] = {
        f"Plot!{number}": _plot_config(_si_title(title), [_path(curve) for curve in curves])
        for number, (title, curves) in enumerate(panels.items())
    }
    column = _mosaic(list(configs), "column")
    side = []
    fixes = [
        channel
        for channel in positions
        if {each.component for each in channel.ranges} & {"latitude"}
    ]
    if fixes:
        configs["map!track"] = {
            "customTileUrl": "", "disabledTopics": [], "followTopic": fixes[0].topic,
            "layer": "map", "topicColors": {}, "zoomLevel": 13,
        }  # fmt: skip
        side.insert(0, "map!track")
    elif positions:
        topic = positions[0].topic
        path = {"value": f"{topic}.north", "enabled": True, "timestampMethod": "receiveTime"}
        x_path = {"value": f"{topic}.east", "enabled": True, "timestampMethod": "receiveTime"}
        configs["Plot!track"] = _plot_config("north over east [m]", [path]) | {
            "xAxisVal": "custom", "xAxisPath": x_path,
        }  # fmt: skip
        side.insert(0, "Plot!track")
    if has_events:
        configs["RosOut!events"] = {"topicToRender": "/events", "minLogLevel": 1, "searchTerms": []}
        side.append("RosOut!events")
    layout = {
        "configById": configs,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _beside(column, _mosaic(side, "column")) if side else column,
    }
    return json.dumps(layout, indent=1) + "\n"


def _si_title(title: str) -> str:
    return title.replace("[deg/min]", "[deg/s]").replace("[kn]", "[m/s]")


def _path(curve: Curve) -> dict[str, object]:
    """Return a series of a plot; names of topics with other signs, such as points, are quoted."""
    topic = curve.channel.topic
    topic = topic if re.fullmatch(r"[\w/-]+", topic) else json.dumps(topic)
    angle = ".@rad2deg" if curve.unit in {"rad", "rad/s"} else ""
    return {
        "value": f"{topic}.value{angle}",
        "label": curve.channel.topic.strip("/"),
        "enabled": True,
        "timestampMethod": "receiveTime",
    }


def _plot_config(title: str, paths: list[dict[str, object]]) -> dict[str, object]:
    return {
        "foxglovePanelTitle": title,
        "paths": paths,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }


def _beside(first: object, second: object) -> dict[str, object]:
    return {"direction": "row", "first": first, "second": second, "splitPercentage": 60}


def _mosaic(panels: list[str], direction: str) -> str | dict[str, object]:
    """Return the panels one after the other with equal shares, as nested pairs."""
    if len(panels) == 1:
        return panels[0]
    return {
        "direction": direction,
        "first": panels[0],
        "second": _mosaic(panels[1:], direction),
        "splitPercentage": 100 / len(panels),
    }


if __name__ == "__main__":
    main()
