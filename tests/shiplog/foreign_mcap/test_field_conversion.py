import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shiplog.foreign_mcap.field_conversion import convert_fields, orientation_angle, read_paths
from shiplog.layouts.mcap_layout import FieldChannel, TopicChoice

ANGLES = np.radians([[10.0, 3.0, -2.0], [200.0, -4.0, 6.0], [359.0, 0.0, 25.0]])  # heading, ...


def _quaternions(axes: str) -> np.ndarray:
    """Rotate a ship by heading, pitch and roll, as geometry defines them, without our formulas."""
    heading, bow_up, starboard_down = ANGLES.T
    if axes == "ned":  # body forward, starboard, down
        angles = np.column_stack([heading, bow_up, starboard_down])
    else:  # yaw counter-clockwise from east; the axis of pitch is to port
        angles = np.column_stack([np.pi / 2 - heading, -bow_up, starboard_down])
    return Rotation.from_euler("ZYX", angles).as_quat()


@pytest.mark.parametrize("axes", ["enu", "ned"])
def test_angles_of_a_ship_follow_from_its_quaternion_in_both_axes(axes: str) -> None:
    for number, name in enumerate(("heading", "pitch", "roll")):
        angle = orientation_angle(name, _quaternions(axes), axes)
        np.testing.assert_allclose(angle, ANGLES[:, number], atol=1e-12)


@pytest.mark.parametrize("axes", ["enu", "ned"])
def test_bow_and_starboard_side_point_where_the_angles_state(axes: str) -> None:
    turn = Rotation.from_quat(_quaternions(axes))
    bow = turn.apply([1.0, 0.0, 0.0])
    starboard = turn.apply([0.0, -1.0 if axes == "enu" else 1.0, 0.0])
    north, east, up = (1, 0, 2) if axes == "enu" else (0, 1, 2)
    sense = 1 if axes == "enu" else -1
    heading = np.arctan2(bow[:, east], bow[:, north]) % (2 * np.pi)
    np.testing.assert_allclose(heading, orientation_angle("heading", turn.as_quat(), axes))
    pitch = orientation_angle("pitch", turn.as_quat(), axes)
    np.testing.assert_allclose(np.sin(pitch), sense * bow[:, up], atol=1e-12)
    roll = orientation_angle("roll", turn.as_quat(), axes)
    assert (np.sign(roll) * np.sign(-sense * starboard[:, up]) >= 0)[np.abs(roll) > 0.01].all()


def test_what_is_no_unit_quaternion_was_not_measured() -> None:
    rows = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0], [np.nan, 0.0, 0.0, 1.0]])
    assert np.isnan(orientation_angle("heading", rows, "enu")).all()
    assert orientation_angle("heading", np.array([[0, 0, 0, 0.99]]), "enu") == np.pi / 2


def _channel(name: str, units: tuple[str, ...], **more: object) -> FieldChannel:
    paths = tuple(f"field{i}" for i in range(len(units)))
    signs = (1,) * len(units)
    return FieldChannel(name, "", TopicChoice("/t"), paths, units, **{"signs": signs} | more)


def test_an_angle_counter_clockwise_from_east_becomes_one_from_north() -> None:
    channel = _channel("heading", ("deg",), axes="enu")
    (heading,) = convert_fields(channel, np.array([[90.0], [0.0], [-90.0]]))
    np.testing.assert_allclose(np.degrees(heading.values[:, 0]), [0, 90, 180], atol=1e-9)


def test_unit_and_sign_are_applied() -> None:
    (rate,) = convert_fields(_channel("yaw_rate", ("deg/s",), signs=(-1,)), np.array([[2.0]]))
    assert rate.values[0, 0] == pytest.approx(-np.radians(2))
    assert rate.unit == "rad/s"
    (flow,) = convert_fields(_channel("fuel_flow", ("kg/h",)), np.array([[2.0]]))
    assert (flow.unit, flow.values[0, 0]) == ("kg/h", 2.0)


def test_a_geographic_position_in_radians_is_in_degrees_and_its_altitude_in_metres() -> None:
    components = ("latitude", "longitude", "altitude")
    channel = _channel("position", ("rad", "rad", "m"), components=components)
    (position,) = convert_fields(channel, np.array([[np.pi / 4, 0.1, 12.0]]))
    np.testing.assert_allclose(position.values, [[45.0, np.degrees(0.1), 12.0]])
    channel = _channel("position", ("deg", "deg"), components=components[:2])
    (position,) = convert_fields(channel, np.array([[54.0, 10.0]]))
    assert position.components == components
    assert np.isnan(position.values[0, 2])


def test_a_velocity_gives_speed_and_course_and_a_stopped_ship_has_no_course() -> None:
    channel = _channel("velocity", ("m/s", "m/s"), components=("north", "east"))
    speed, course = convert_fields(channel, np.array([[0.0, -3.0], [3.0, 4.0], [0.01, 0.0]]))
    np.testing.assert_allclose(speed.values[:, 0], [3.0, 5.0, 0.01])
    np.testing.assert_allclose(course.values[:2, 0], [1.5 * np.pi, np.arctan2(4, 3)])
    assert np.isnan(course.values[2, 0])


def test_an_orientation_is_read_from_the_four_parts_of_its_quaternion() -> None:
    assert read_paths(_channel("heading", ("quaternion",), axes="enu")) == (
        "field0.x",
        "field0.y",
        "field0.z",
        "field0.w",
    )
