import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_bags import (
    PUBLICATION_NS,
    RECEPTION_NS,
    START_NS,
    STEP_NS,
    definition,
    protobuf_type,
    stamp,
    write_json,
    write_location_fixes,
    write_messages,
    write_ros2,
)
from mcap.reader import make_reader
from mcap.writer import Writer

from shiplog import LayoutError, LogError, LogWriter, TrialLog
from shiplog.foreign_mcap.foreign_log import read_foreign_mcap
from shiplog.layouts.mcap_layout_parser import parse_mcap_layout
from shiplog.types import Channel
from shiplog.units import GEOGRAPHIC

N = 30
TIMES_NS = START_NS + STEP_NS * np.arange(N)
IMU = "sensor_msgs/msg/Imu"


def read(path: Path, layout: str) -> TrialLog:
    return read_foreign_mcap(path, parse_mcap_layout(layout, "bag.toml"))[0]


def section(name: str, topic: str, field: str, unit: str, more: str = "") -> str:
    return f"[{name}]\ntopic = '{topic}'\nfield = '{field}'\nunit = '{unit}'\n{more}\n"


def imu(number: int, **more: object) -> dict[str, Any]:
    yaw = np.pi / 2 - 0.02 * number  # a heading of 0.02 rad times the number
    return {
        "header": {"stamp": stamp(number), "frame_id": "imu_link"},
        "orientation": {"x": 0.0, "y": 0.0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)},
        "angular_velocity": {"x": 0.1, "y": 0.2, "z": -0.2 + 0.001 * number},
    } | more


IMU_LAYOUT = section("yaw_rate", "/imu/data", "angular_velocity.z", "rad/s", "sign = -1") + section(
    "heading", "/imu/data", "orientation", "quaternion", "axes = 'enu'"
)


def test_an_imu_gives_yaw_rate_and_heading_with_stamps_as_measured_times(tmp_path: Path) -> None:
    bag = write_ros2(tmp_path / "bag.mcap", {"/imu/data": (IMU, map(imu, range(N)))})
    log = read(bag, IMU_LAYOUT)
    rate, heading = log["yaw_rate"], log["heading"]
    np.testing.assert_allclose(rate.values, 0.2 - 0.001 * np.arange(N))
    np.testing.assert_allclose(heading.values, 0.02 * np.arange(N), atol=1e-12)
    np.testing.assert_array_equal(rate.measured_ns, TIMES_NS)
    np.testing.assert_array_equal(rate.received_ns, TIMES_NS + RECEPTION_NS)
    assert (rate.topic, rate.unit) == ("/yaw_rate/imu_data", "rad/s")
    assert rate.metadata["read_from"] == "/imu/data: angular_velocity.z"
    assert log.metadata["converted_from"] == "bag.mcap"
    assert log.warnings == ()
    assert not log.data_lost


def test_a_covariance_of_minus_one_means_not_measured_and_is_counted(tmp_path: Path) -> None:
    unknown = {"orientation_covariance": [-1.0] + [0.0] * 8}
    bag = write_ros2(
        tmp_path / "bag.mcap",
        {"/imu/data": (IMU, (imu(i, **(unknown if i < 5 else {})) for i in range(N)))},
    )
    log = read(bag, IMU_LAYOUT)
    assert (len(log["yaw_rate"]), len(log["heading"])) == (N, N - 5)
    assert any(
        f"5 of {N} values of heading.imu_data were not measured (orientation_covariance[0] below 0)"
        in text
        for text in log.warnings
    )


def test_an_orientation_without_rotation_throughout_is_a_warning(tmp_path: Path) -> None:
    still = {"orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    bag = write_ros2(
        tmp_path / "bag.mcap", {"/imu/data": (IMU, (imu(i, **still) for i in range(N)))}
    )
    assert any("without rotation in all 30" in text for text in read(bag, IMU_LAYOUT).warnings)


def test_a_fix_without_status_or_with_nan_is_dropped_and_counted(tmp_path: Path) -> None:
    def fix(number: int) -> dict[str, Any]:
        return {
            "header": {"stamp": stamp(number)},
            "status": {"status": -1 if number == 3 else 0},
            "latitude": np.nan if number == 4 else 54.0 + 1e-5 * number,
            "longitude": 10.0,
            "altitude": np.nan,
        }

    bag = write_ros2(
        tmp_path / "bag.mcap", {"/fix": ("sensor_msgs/msg/NavSatFix", map(fix, range(N)))}
    )
    layout = (
        "[position]\ntype = 'sensor_msgs/msg/NavSatFix'\nlatitude = 'latitude'\n"
        "longitude = 'longitude'\naltitude = 'altitude'\nunit = 'deg'\n"
    )
    log = read(bag, layout)
    kept = np.delete(np.arange(N), [3, 4])
    np.testing.assert_allclose(log["position"].values[:, 0], 54.0 + 1e-5 * kept)
    assert log["position"].fields == GEOGRAPHIC
    assert np.isnan(log["position"].values[:, 2]).all()
    texts = " ".join(log.warnings)
    assert "1 of 30 values of position.fix were not measured (status.status below 0)" in texts
    assert "(absent, NaN or infinite)" in texts


def test_odometry_and_a_number_without_stamp_are_read_from_one_file(tmp_path: Path) -> None:
    odometry = [
        {
            "header": {"stamp": stamp(i)},
            "twist": {"twist": {"linear": {"x": 5.0, "y": -0.1 * i}}},
        }
        for i in range(N)
    ]
    bag = write_ros2(
        tmp_path / "bag.mcap",
        {
            "/odom": ("nav_msgs/msg/Odometry", odometry),
            "/rudder": ("std_msgs/msg/Float64", [{"data": 10.0}] * N),
        },
    )
    layout = section("speed", "/odom", "twist.twist.linear.x", "m/s")
    layout += section("sway", "/odom", "twist.twist.linear.y", "m/s", "sign = -1")
    layout += section("rudder.feedback", "/rudder", "data", "deg")
    log = read(bag, layout)
    np.testing.assert_allclose(log["sway"].values, 0.1 * np.arange(N))
    np.testing.assert_allclose(log["rudder"].values, np.radians(10))
    np.testing.assert_array_equal(log["rudder"].measured_ns, TIMES_NS + PUBLICATION_NS)
    assert log["rudder"].source == "feedback"


def test_definitions_in_idl_are_read(tmp_path: Path) -> None:
    idl = """================================================================================
IDL: ship_msgs/msg/Rudder
module ship_msgs {
  module msg {
    struct Rudder {
      builtin_interfaces::msg::Time stamp;
      double angle;
    };
  };
};
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces {
  module msg {
    struct Time {
      int32 sec;
      uint32 nanosec;
    };
  };
};
"""
    data = [b"\0\1\0\0" + struct.pack("<iId", *stamp(i).values(), 0.01 * i) for i in range(N)]
    schema = ("ship_msgs/msg/Rudder", "ros2idl", idl.encode())
    bag = write_messages(tmp_path / "bag.mcap", data, topic="/r", encoding="cdr", schema=schema)
    log = read(bag, section("rudder", "/r", "angle", "rad"))
    np.testing.assert_allclose(log["rudder"].values, 0.01 * np.arange(N))
    np.testing.assert_array_equal(log["rudder"].measured_ns, TIMES_NS)


def test_protobuf_is_read_by_the_descriptors_in_the_file(tmp_path: Path) -> None:
    schema, message = protobuf_type()

    def motion(number: int) -> bytes:
        one = message(rates={"z": 0.5}, rudders=[0.1, 0.2] if number else [0.1], name="x")
        one.timestamp.FromNanoseconds(START_NS + number * STEP_NS)
        if number > 1:
            one.rpm = 100.0 + number
        return bytes(one.SerializeToString())

    bag = write_messages(
        tmp_path / "bag.mcap", map(motion, range(N)), encoding="protobuf", schema=schema
    )
    layout = section("yaw_rate", "/data", "rates.z", "rad/s")
    layout += section("rudder.second", "/data", "rudders[1]", "rad")
    layout += section("rpm", "/data", "rpm", "rpm")
    log = read(bag, layout)
    np.testing.assert_allclose(log["yaw_rate"].values, 0.5)
    np.testing.assert_allclose(log["rudder"].values, [0.2] * (N - 1))
    np.testing.assert_allclose(log["rpm"].values, 100.0 + np.arange(2, N))
    np.testing.assert_array_equal(log["rpm"].measured_ns, TIMES_NS[2:])
    with pytest.raises(LayoutError, match=r"no field 'rates.zz'; did you mean 'rates.z'"):
        read(bag, section("yaw_rate", "/data", "rates.zz", "rad/s"))
    with pytest.raises(LayoutError, match=r"'rates' is no number; name one.*'rates.z'"):
        read(bag, section("yaw_rate", "/data", "rates", "rad/s"))
    with pytest.raises(LayoutError, match=r"'name' has 'x', which is not a number"):
        read(bag, section("yaw_rate", "/data", "name", "rad/s"))


def test_a_location_fix_of_another_program_is_a_position_at_its_own_time(tmp_path: Path) -> None:
    bag, fixes = write_location_fixes(tmp_path / "bag.mcap", N)
    layout = (
        "[position]\ntype = 'foxglove.LocationFix'\nlatitude = 'latitude'\n"
        "longitude = 'longitude'\naltitude = 'altitude'\nunit = 'deg'\n"
    )
    log = read(bag, layout)
    assert [channel.topic for channel in log] == ["/position/gps"]
    np.testing.assert_array_equal(log["position"].values, fixes)
    np.testing.assert_array_equal(log["position"].measured_ns, TIMES_NS)


def test_json_is_read_by_its_keys_and_absent_ones_are_not_measured(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = [{"t": 1000 * i, "nav": {"rot": i, "log": [1.0, 2.0]}}
                                  for i in range(N)]  # fmt: skip
    del rows[3]["nav"]["rot"]
    rows[4]["nav"]["rot"] = None
    rows[5]["nav"]["log"] = [1.0]
    bag = write_json(tmp_path / "bag.mcap", rows)
    layout = "[time]\nstamp = 't'\nunit = 'ms'\n"
    layout += section("yaw_rate", "/data", "nav.rot", "deg/min")
    layout += section("speed", "/data", "nav.log[1]", "kn")
    log = read(bag, layout)
    kept = np.delete(np.arange(N), [3, 4])
    np.testing.assert_allclose(log["yaw_rate"].values, np.radians(kept / 60))
    np.testing.assert_array_equal(log["yaw_rate"].measured_ns, kept * 10**9)
    assert len(log["speed"]) == N - 1
    assert any("2 of 30 values of yaw_rate.data were not measured" in t for t in log.warnings)


def test_a_number_that_may_be_a_time_is_not_used_unasked(tmp_path: Path) -> None:
    bag = write_json(tmp_path / "bag.mcap", [{"timestamp": 5 + i, "v": 1.0} for i in range(N)])
    log = read(bag, section("speed", "/data", "v", "kn"))
    np.testing.assert_array_equal(log["speed"].measured_ns, TIMES_NS + PUBLICATION_NS)
    assert any("'timestamp' is a number" in text for text in log.warnings)


def test_unknown_topics_types_and_fields_are_reported_at_once_with_the_nearest(
    tmp_path: Path,
) -> None:
    bag = write_ros2(tmp_path / "bag.mcap", {"/imu/data": (IMU, map(imu, range(3)))})
    layout = section("yaw_rate", "/imu/dat", "angular_velocity.z", "rad/s")
    layout += "[heading]\ntype = 'sensor_msgs/msg/Img'\nfield = 'x'\nunit = 'rad'\n"
    with pytest.raises(
        LayoutError, match=r"no topic '/imu/dat'; did you mean '/imu/data'.*did you mean '.*Imu'"
    ):
        read(bag, layout)
    layout = section("yaw_rate", "/imu/data", "angular_velocity.zz", "rad/s")
    layout += section("heading", "/imu/data", "orient", "quaternion", "axes = 'enu'")
    with pytest.raises(LayoutError, match=r"'angular_velocity.zz'; did you.*no field 'orient.x'"):
        read(bag, layout)


def test_a_type_that_several_topics_have_needs_the_topic(tmp_path: Path) -> None:
    bag = write_ros2(
        tmp_path / "bag.mcap",
        {topic: (IMU, map(imu, range(2))) for topic in ("/imu/a", "/imu/b")},
    )
    layout = f"[yaw_rate]\ntype = '{IMU}'\nfield = 'angular_velocity.z'\nunit = 'rad/s'\n"
    with pytest.raises(LayoutError, match="state topic: /imu/a, /imu/b"):
        read(bag, layout)


def test_a_topic_with_two_types_needs_the_type(tmp_path: Path) -> None:
    with (tmp_path / "bag.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for name in ("a/Speed", "b/Text"):
            schema = writer.register_schema(name, "jsonschema", b"{}")
            channel = writer.register_channel("/odd", "json", schema)
            data = b'{"v": 1}' if name == "a/Speed" else b'{"text": "x"}'
            for i in range(N):
                writer.add_message(channel, START_NS + i * STEP_NS, data, START_NS + i * STEP_NS)
        writer.finish()
    layout = section("speed", "/odd", "v", "kn")
    with pytest.raises(LayoutError, match="several types, state type: a/Speed, b/Text"):
        read(tmp_path / "bag.mcap", layout)
    log = read(tmp_path / "bag.mcap", layout + "type = 'a/Speed'\n")
    assert len(log["speed"]) == N


def test_two_sections_of_one_channel_need_sources(tmp_path: Path) -> None:
    bag = write_json(tmp_path / "bag.mcap", [{"a": 1.0, "b": 2.0}] * 3)
    layout = section("speed", "/data", "a", "kn") + section("speed.data", "/data", "b", "kn")
    with pytest.raises(LayoutError, match=r"two sections give speed.data; state a source"):
        read(bag, layout)


def test_damaged_messages_are_dropped_and_reported_as_lost(tmp_path: Path) -> None:
    good = write_ros2(tmp_path / "a.mcap", {"/imu/data": (IMU, map(imu, range(N)))})
    with good.open("rb") as stream:
        data = [message.data for *_, message in make_reader(stream).iter_messages()]
    data[3] = data[3][:40]  # cut
    data[4] = b"\0\7" + data[4][2:]  # another representation
    data[5] = data[5] + b"\0" * 12  # longer than the type
    data[6] = data[6][:12] + b"\xff\xff\xff\x7f" + data[6][16:]  # a text of 2 GB
    schema = (IMU, "ros2msg", definition(IMU).encode())
    bag = write_messages(
        tmp_path / "b.mcap", data, topic="/imu/data", encoding="cdr", schema=schema
    )
    log = read(bag, IMU_LAYOUT)
    assert log.data_lost
    assert any("4 of 30 messages could not be decoded" in text for text in log.warnings)
    np.testing.assert_allclose(log["heading"].values, 0.02 * np.delete(np.arange(N), [3, 4, 5, 6]),
                               atol=1e-12)  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "schema", "message"),
    [
        ("cdr", (IMU, "ros2msg", b""), "the schema of /data .* is empty"),
        ("cdr", (IMU, "ros2msg", b"strin\xff data"), "cannot be read"),
        ("cdr", (IMU, "ros2msg", b"Nothing data"), "cannot be read"),
        ("cdr", (IMU, "ros2idl", b"struct {"), "cannot be read"),
        ("cdr", (IMU, "ros2msg", b"# x\n" * 300_000), "bytes long, at most"),
        ("protobuf", ("ship.Motion", "protobuf", b"\xff\xff"), "cannot be read"),
        ("protobuf", ("ship.Motion", "protobuf", b""), "is empty"),
        ("cbor", None, "have the encoding cbor without a schema; readable are json"),
        ("cdr", None, "readable are json, protobuf, and cdr"),
        ("json", None, "3 of 3 messages could not be decoded"),
        ("protobuf", protobuf_type()[0], "3 of 3 messages could not be decoded"),
    ],
)
def test_what_cannot_be_decoded_is_an_error_in_one_line(
    tmp_path: Path, encoding: str, schema: tuple[str, str, bytes] | None, message: str
) -> None:
    bag = write_messages(tmp_path / "x.mcap", [b"\xff\xfe["] * 3, encoding=encoding, schema=schema)
    with pytest.raises(LogError, match=message) as error:
        read(bag, section("speed", "/data", "v", "kn"))
    assert "\n" not in str(error.value)
    assert "x.mcap" in str(error.value)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("'5'", "'v' has \"'5'\", which is not a number"),
        (True, "'v' has True, which is not a number"),
        ({"x": 1.0}, "'v' is no number; name one of its fields, such as 'v.x'"),
        ([1.0], "'v' is no number"),
    ],
)
def test_a_field_that_is_no_number_is_an_error(tmp_path: Path, value: object, message: str) -> None:
    bag = write_json(tmp_path / "bag.mcap", [{"v": value}] * 3)
    with pytest.raises(LayoutError, match=message):
        read(bag, section("speed", "/data", "v", "kn"))


def test_nan_infinite_and_huge_numbers_are_not_measured(tmp_path: Path) -> None:
    rows = [b'{"v": NaN}', b'{"v": Infinity}', b'{"v": 1' + b"0" * 400 + b"}", b'{"v": 3}']
    bag = write_messages(tmp_path / "bag.mcap", rows)
    log = read(bag, section("rpm", "/data", "v", "rpm"))
    assert log["rpm"].values.tolist() == [3.0]
    assert any("3 of 4 values of rpm.data" in text for text in log.warnings)


def test_json_nested_too_deeply_is_a_damaged_message(tmp_path: Path) -> None:
    deep = b'{"v": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"
    bag = write_messages(tmp_path / "bag.mcap", [b'{"v": 1}', deep])
    log = read(bag, section("rpm", "/data", "v", "rpm"))
    assert log.data_lost
    assert len(log["rpm"]) == 1


def test_stamps_that_were_not_set_are_replaced_by_the_times_of_reception(tmp_path: Path) -> None:
    unset = {"header": {"stamp": {"sec": 0, "nanosec": 0}}}
    bag = write_ros2(
        tmp_path / "bag.mcap", {"/imu/data": (IMU, (imu(i, **unset) for i in range(N)))}
    )
    log = read(bag, IMU_LAYOUT)
    np.testing.assert_array_equal(log["yaw_rate"].measured_ns, TIMES_NS + RECEPTION_NS)
    assert any("time" in text for text in log.warnings)


def test_channels_of_shiplog_in_the_file_are_kept_and_unused_topics_named(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "own.mcap") as writer:
        writer.write(Channel("rudder", "feedback", "rad", TIMES_NS, TIMES_NS, np.full(N, 0.1)))
    write_json(tmp_path / "json.mcap", [{"v": 1.0}] * N)
    write_messages(tmp_path / "other.mcap", [b"x"], topic="/camera", encoding="jpeg")
    with (tmp_path / "bag.mcap").open("wb") as stream:
        bag = Writer(stream)
        bag.start()
        for name in ("own", "json", "other"):
            with (tmp_path / f"{name}.mcap").open("rb") as part:
                for schema, channel, message in make_reader(part).iter_messages():
                    schema_id = 0
                    if schema:
                        schema_id = bag.register_schema(schema.name, schema.encoding, schema.data)
                    channel_id = bag.register_channel(
                        channel.topic, channel.message_encoding, schema_id, channel.metadata
                    )
                    bag.add_message(
                        channel_id, message.log_time, message.data, message.publish_time
                    )
        bag.finish()
    log = read(tmp_path / "bag.mcap", section("speed", "/data", "v", "kn"))
    assert [channel.topic for channel in log] == ["/rudder/feedback", "/speed/data"]
    assert [len(channel) for channel in log] == [N, N]
    assert any("ignored 1 topics of other programs: /camera" in text for text in log.warnings)


def test_what_a_draft_assumed_is_a_warning_until_it_is_confirmed(tmp_path: Path) -> None:
    bag = write_json(tmp_path / "bag.mcap", [{"v": 1.0}] * 3)
    log = read(bag, section("speed", "/data", "v", "kn", "assumed = 'unit'"))
    assert any("assumes the unit of speed" in text for text in log.warnings)


def test_an_unfinished_file_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    bag = write_ros2(tmp_path / "bag.mcap", {"/imu/data": (IMU, map(imu, range(N)))})
    data = bag.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    log = read(tmp_path / "cut.mcap", IMU_LAYOUT)
    heading = log["heading"].values
    assert 0 < len(heading) <= N
    np.testing.assert_allclose(heading, 0.02 * np.arange(len(heading)), atol=1e-12)
    assert any("not finished" in text for text in log.warnings)
