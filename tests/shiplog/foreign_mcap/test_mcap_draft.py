import math
from pathlib import Path

import numpy as np
import pytest
from foreign_bags import (
    START_NS,
    STEP_NS,
    stamp,
    write_json,
    write_location_fixes,
    write_messages,
    write_ros2,
)
from mcap.writer import Writer

from shiplog import LayoutError
from shiplog.cli.main import main
from shiplog.foreign_mcap.mcap_draft import draft_mcap_layout
from shiplog.foreign_mcap.ready_layouts import ready_layouts
from shiplog.layouts.mcap_layout_parser import parse_mcap_layout
from shiplog.mcap.reader import read
from shiplog.tables.convert import convert

N = 20


def convert_by_draft(bag: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """Convert a file by its draft; return the values by topic, and the warnings."""
    layout = bag.with_suffix(".toml")
    layout.write_text(draft_mcap_layout(bag).text, encoding="utf-8")
    target = bag.with_name("out.mcap")
    _, warnings = convert(bag, target, layout)
    return {channel.topic: channel.values for channel in read(target)}, warnings


@pytest.mark.parametrize("name", sorted(ready_layouts()))
def test_every_ready_layout_is_right_by_itself(name: str) -> None:
    layout = parse_mcap_layout(ready_layouts()[name], name)
    for channel in layout.channels:
        assert channel.choice.type.replace("/msg/", "/") == name
        is_defined = name.startswith("vehicle_")  # PX4's definitions of messages state the axes
        has_sense = (-1 in channel.signs or channel.axes) and not is_defined
        if has_sense and channel.name != "roll":  # the same in all axes
            assert any(channel.name in text for text in layout.assumed), channel.name


def bag_of_well_known_types(path: Path, frame: str) -> Path:
    half = math.sqrt(0.5)
    header = [{"stamp": stamp(i), "frame_id": frame} for i in range(N)]
    turned = {"x": 0.0, "y": 0.0, "z": half, "w": half}  # by 90 deg about z
    twist = {"linear": {"x": 5.0, "y": 0.5}, "angular": {"z": 0.01}}
    return write_ros2(
        path,
        {
            "/imu": (
                "sensor_msgs/msg/Imu",
                [{"header": h, "orientation": turned, "angular_velocity": {"y": 0.2, "z": 0.1}}
                 for h in header],
            ),
            "/vel": (
                "geometry_msgs/msg/TwistStamped", [{"header": h, "twist": twist} for h in header]
            ),
            "/odom": (
                "nav_msgs/msg/Odometry",
                [{"header": h, "twist": {"twist": twist},
                  "pose": {"pose": {"position": {"x": 3.0, "y": 4.0}, "orientation": turned}}}
                 for h in header],
            ),
            "/fix": (
                "sensor_msgs/msg/NavSatFix",
                [{"header": h, "latitude": 54.0, "longitude": 10.0} for h in header],
            ),
            "/ship/rudder_angle": ("std_msgs/msg/Float64", [{"data": 0.1}] * N),
            "/temperature": ("std_msgs/msg/Float64", [{"data": 20.0}] * N),
        },
    )  # fmt: skip


def test_well_known_types_are_converted_by_their_draft(tmp_path: Path) -> None:
    values, warnings = convert_by_draft(bag_of_well_known_types(tmp_path / "bag.mcap", "base_link"))
    assert values["/yaw_rate/imu"][0] == -0.1  # to port
    assert values["/pitch_rate/imu"][0] == -0.2
    heading = values["/heading/imu"][0]
    assert min(heading, 2 * np.pi - heading) == pytest.approx(0, abs=1e-9)  # north
    assert (values["/speed/vel"][0], values["/sway/vel"][0]) == (5.0, -0.5)
    assert values["/yaw_rate/odom"][0] == -0.01
    assert values["/position/odom"][0].tolist() == [4.0, 3.0]  # y is north
    assert values["/position/fix"][0].tolist() == [54.0, 10.0, 0.0]
    assert values["/rudder/ship_rudder_angle"][0] == 0.1
    assert "/temperature" not in " ".join(values)
    (assumed,) = (text for text in warnings if "assumes" in text)
    for text in ("sign of yaw_rate.imu", "axes of heading.imu", "unit of rudder"):
        assert text in assumed


def test_a_frame_that_names_its_axes_is_followed(tmp_path: Path) -> None:
    values, _ = convert_by_draft(bag_of_well_known_types(tmp_path / "bag.mcap", "base_link_frd"))
    assert values["/yaw_rate/imu"][0] == 0.1
    assert values["/sway/vel"][0] == 0.5
    assert values["/heading/imu"][0] == pytest.approx(np.pi / 2)


def test_a_location_fix_is_converted_by_its_draft(tmp_path: Path) -> None:
    bag, fixes = write_location_fixes(tmp_path / "bag.mcap", N)
    values, warnings = convert_by_draft(bag)
    np.testing.assert_array_equal(values["/position/gps"], fixes)
    assert not any("assumes" in text for text in warnings)


def test_names_of_fields_state_quantities_units_and_sides(tmp_path: Path) -> None:
    row = {"time": 5.0, "nav": {"lat": 54.0, "lon": 10.0, "speed_kn": 10.0}, "x9": 3.0,
           "rudder_port_deg": 2.0}  # fmt: skip
    bag = write_json(tmp_path / "bag.mcap", [row] * N)
    draft = draft_mcap_layout(bag)
    values, warnings = convert_by_draft(bag)
    assert values["/speed/data"][0] == pytest.approx(10 * 1852 / 3600)
    assert values["/rudder/data_port"][0] == pytest.approx(np.radians(2))
    assert values["/position/data"][0][:2].tolist() == [54.0, 10.0]
    assert '# topic = "/data", field = "x9"' in draft.text
    (assumed,) = (text for text in warnings if "assumes" in text)
    assert "unit of speed" not in assumed  # stated in its name
    assert "sign of rudder" in assumed


def test_names_of_fields_may_have_points_and_brackets(tmp_path: Path) -> None:
    row = {"imu.yaw_rate": 0.25, "a": {"set[1].speed_kn": 10.0}, "heading\ud800": 1.0, '"': 2.0}
    values, _ = convert_by_draft(write_json(tmp_path / "bag.mcap", [row] * N))
    assert values["/yaw_rate/data"][0] == 0.25
    assert values["/speed/data"][0] == pytest.approx(10 * 1852 / 3600)
    assert len(values) == 2


def test_topics_with_odd_or_equal_names_and_two_types_are_drafted(tmp_path: Path) -> None:
    with (tmp_path / "bag.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        odd, hidden = '/odd\n"]\x1b[31m', "/hidden\U000e0001"
        topics = [("/a/b", "T"), ("/a_b", "T"), ("/two", "A"), ("/two", "B"), (odd, "T")]
        for topic, name in (*topics, ("/Kompaß", "T"), (hidden, "T")):
            schema = writer.register_schema(name, "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for i in range(N):
                at = START_NS + i * STEP_NS
                writer.add_message(channel, at, b'{"speed_kn": 3}', at)
        writer.finish()
    values, _ = convert_by_draft(tmp_path / "bag.mcap")
    assert [topic for topic in values if topic.startswith("/speed/")] == [
        "/speed/a_b", "/speed/a_b_2", "/speed/two", "/speed/two_2", "/speed/odd_31m",
        "/speed/Kompaß", "/speed/hidden",
    ]  # fmt: skip
    assert all(len(each) == N for each in values.values())


def test_what_has_no_numbers_is_an_error_with_the_cause(tmp_path: Path) -> None:
    bag = write_messages(tmp_path / "bag.mcap", [b"x"], encoding="jpeg")
    with pytest.raises(LayoutError, match=r"no topic has numbers that can be read .*jpeg"):
        draft_mcap_layout(bag)


def test_a_log_of_shiplog_needs_no_layout() -> None:
    with pytest.raises(LayoutError, match="needs no layout"):
        draft_mcap_layout(Path("sample_data/zigzag_20_20.mcap"))


def test_the_verbs_draft_and_convert(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = write_json(tmp_path / "bag.mcap", [{"speed_kn": 3.0}] * N)
    layout = tmp_path / "bag.toml"
    assert main(["layout", str(bag), "-o", str(layout)]) == 0
    assert main(["convert", str(bag), str(tmp_path / "o.mcap"), "--layout", str(layout)]) == 0
    output = capsys.readouterr()
    assert "recognised by name: speed" in output.err
    assert "20 samples of 1 channel\n" in output.out
