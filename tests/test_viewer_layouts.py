"""The layouts for PlotJuggler and Foxglove: everything in them is in a recorded log."""

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from example_scripts import example_script
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from places import PROJECT, SAMPLE_DATA

from shiplog.cli.main import main

FOLDER = PROJECT / "examples" / "viewers"


@pytest.fixture(scope="module")
def ship(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the log of the sample sentences, which the layouts of the folder fit."""
    path = tmp_path_factory.mktemp("log") / "ship.mcap"
    assert main(["record", "nmea0183", str(SAMPLE_DATA / "ship.nmea"), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module", params=["ship", "zigzag"])
def log(request: pytest.FixtureRequest, ship: Path) -> Path:
    """Return a log with positions on the earth, and one with local ones."""
    return ship if request.param == "ship" else SAMPLE_DATA / "zigzag_20_20.mcap"


def fields_of(log: Path) -> dict[str, set[str]]:
    """Return the fields of each topic, by the descriptors in the file, read by another library."""
    found = {}
    with log.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        files = FileDescriptorSet.FromString(schema.data).file
        found[channel.topic] = {
            field.name
            for file in files
            for message in file.message_type
            if f"{file.package}.{message.name}" == schema.name
            for field in message.field
        }
    return found


def panels(node: Any) -> list[str]:  # noqa: ANN401 - a tree of JSON
    """Return the panels of a layout of Foxglove, and check the form of its nodes."""
    if isinstance(node, str):
        return [node]
    assert set(node) == {"direction", "first", "second", "splitPercentage"}
    assert node["direction"] in {"row", "column"}
    return [*panels(node["first"]), *panels(node["second"])]


def test_every_curve_of_plotjuggler_is_a_field_of_the_log(log: Path) -> None:
    fields = fields_of(log)
    root = ET.fromstring(example_script("viewers/make_layouts").layouts_of(log)["plotjuggler.xml"])  # noqa: S314
    curves = list(root.iter("curve"))
    names = [
        curve.get(key, "")
        for curve in curves
        for key in (("curve_x", "curve_y") if curve.get("curve_x") else ("name",))
    ]
    assert len(names) >= 7
    for name in names:
        topic, _, field = name.rpartition("/")
        assert field in fields[topic], name
    shown = {name.split("/")[1] for name in names}
    assert {"rudder", "heading", "yaw_rate", "speed", "rpm", "position"} <= shown


def test_a_layout_of_plotjuggler_has_the_structure_that_it_reads(ship: Path) -> None:
    root = ET.fromstring(example_script("viewers/make_layouts").layouts_of(ship)["plotjuggler.xml"])  # noqa: S314
    assert root.find("tabbed_widget[@parent='main_window']/Tab/Container/DockSplitter") is not None
    for splitter in root.iter("DockSplitter"):
        assert len(splitter) == int(splitter.get("count", "0"))
        assert len(splitter.get("sizes", "").split(";")) == len(splitter)
    scales = {
        transform.get("alias"): float(transform.find("options").get("value_scale"))  # type: ignore[union-attr,arg-type]
        for transform in root.iter("transform")
    }
    assert scales["/speed/VD [kn]"] == pytest.approx(3600 / 1852)
    assert scales["/yaw_rate/TI [deg/min]"] == pytest.approx(60 * 57.29578)
    for area in root.iter("DockArea"):
        ends = area.find("plot/range")
        assert ends is not None
        assert float(ends.get("left", "")) < float(ends.get("right", ""))
        assert float(ends.get("bottom", "")) < float(ends.get("top", ""))


def test_every_path_of_foxglove_is_a_field_of_the_log(log: Path) -> None:
    fields = fields_of(log)
    layout = json.loads(example_script("viewers/make_layouts").layouts_of(log)["foxglove.json"])
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    values = []
    for config in layout["configById"].values():
        values += [path["value"] for path in config.get("paths", ())]
        values += [config["xAxisPath"]["value"]] if "xAxisPath" in config else []
        if "followTopic" in config:
            assert fields[config["followTopic"]] >= {"latitude", "longitude"}
    assert len(values) >= 6
    for value in values:
        found = re.fullmatch(r'("?)(/[^"]+?)\1\.(\w+)(\.@rad2deg)?', value)
        assert found, value
        assert found[3] in fields[found[2]], value
        is_plain = re.fullmatch(r"[\w/-]+", found[2]) is not None
        assert is_plain == (found[1] == ""), value


@pytest.mark.parametrize("name", ["plotjuggler.xml", "foxglove.json"])
def test_the_layouts_in_the_folder_are_those_of_the_sample_recording(ship: Path, name: str) -> None:
    made = example_script("viewers/make_layouts").layouts_of(ship)[name]
    assert (FOLDER / name).read_text(encoding="utf-8") == made
