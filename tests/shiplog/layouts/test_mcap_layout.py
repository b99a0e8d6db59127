from pathlib import Path

import pytest

from shiplog import LayoutError
from shiplog.layouts.field_paths import parse_path
from shiplog.layouts.mcap_layout import load_mcap_layout
from shiplog.layouts.mcap_layout_parser import parse_mcap_layout

GOOD = """
[time]
stamp = "t"
unit = "ms"
[yaw_rate.gyro]
topic = "/imu"
field = "angular_velocity.z"
unit = "rad/s"
sign = -1
assumed = "sign, unit"
[heading]
type = "sensor_msgs/msg/Imu"
field = "orientation"
unit = "quaternion"
axes = "enu"
[position]
topic = "/fix"
latitude = "latitude"
longitude = "longitude"
unit = "deg"
[velocity_north]
topic = "/vel"
field = "twist.linear.y"
unit = "m/s"
[velocity_east]
topic = "/vel"
field = "twist.linear.x"
unit = "kn"
sign = -1
"""


def test_a_layout_names_topics_types_fields_units_senses_and_axes() -> None:
    layout = parse_mcap_layout(GOOD, "bag.toml")
    rate, heading, position, velocity = layout.channels
    assert (layout.name, layout.stamp, layout.stamp_unit) == ("bag", "t", "ms")
    assert (rate.name, rate.source, rate.choice.topic, rate.paths, rate.signs) == (
        "yaw_rate", "gyro", "/imu", ("angular_velocity.z",), (-1,)
    )  # fmt: skip
    assert (heading.choice.topic, heading.choice.type) == ("", "sensor_msgs/msg/Imu")
    assert (heading.units, heading.axes) == (("quaternion",), "enu")
    assert position.components == ("latitude", "longitude")
    assert velocity.name == "velocity"
    assert velocity.paths == ("twist.linear.y", "twist.linear.x")
    assert (velocity.units, velocity.signs) == (("m/s", "kn"), (1, -1))
    assert layout.assumed == ("sign of yaw_rate.gyro", "unit of yaw_rate.gyro")


def _section(**keys: object) -> str:
    keys = {"topic": "'/t'", "field": "'a.b'", "unit": "'rad/s'"} | keys
    lines = [f"{key} = {value}" for key, value in keys.items() if value is not None]
    return "\n".join(["[yaw_rate]", *lines])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (_section(topic=None), "lacks topic, or the type"),
        (_section(topic="5"), "yaw_rate.topic must be a text"),
        (_section(topic="''"), "yaw_rate.topic must be a text"),
        (_section(field=None), r"\[yaw_rate\] lacks field"),
        (_section(field="3"), "must be a path of fields"),
        (_section(field="'a..b'"), "must be a path of fields"),
        (_section(field="'a[x]'"), "must be a path of fields"),
        (_section(fild="'a'"), "unknown key 'yaw_rate.fild', did you mean 'field'"),
        (_section(unit="'rad'"), "yaw_rate.unit: cannot convert"),
        (_section(unit="'quaternion'", axes="'enu'"), "unknown unit 'quaternion'"),
        (_section(sign="2"), "sign must be 1 or -1"),
        (_section(axes="'enu'"), "axes is of a quaternion or an angle from north"),
        (_section(assumed="'luck'"), "assumed must be some of topic"),
        (_section(stamp="'a..b'"), "stamp must be a path of fields, 'publish_time'"),
        (_section() + "\nstamp = []", "stamp must be a text"),
        (_section() + "\n[heading]\ntopic='/t'\nfield='q'\nunit='quaternion'", "lacks axes"),
        (
            _section() + "\n[heading]\ntopic='/t'\nfield='q'\nunit='quaternion'\naxes='flu'",
            "axes must be 'enu' or 'ned'",
        ),
        (
            _section() + "\n[heading]\ntopic='/t'\nfield='q'\nunit='rad'\naxes='enu'\nsign=-1",
            "which determine its sign",
        ),
        (
            _section() + "\n[position]\ntopic='/t'\nlatitude='a'\nlongitude='b'\nunit='ddmm.mmmm'",
            "of tables; use deg or rad",
        ),
        (_section() + "\n[velocity_north]\ntopic='/t'\nfield='x'\nunit='m/s'", "other component"),
        (
            _section() + "\n[velocity_north]\ntopic='/t'\nfield='x'\nunit='m/s'"
            "\n[velocity_east]\ntopic='/u'\nfield='x'\nunit='m/s'",
            "must be of the same messages",
        ),
        ("", "no channel is given"),
        ("delimiter = ','", "unknown key 'delimiter'"),
        ("source = 'a/b'\n" + _section(), "source must be a string without '/'"),
        ("[time]\nunit = 's'\n" + _section(), r"\[time\] lacks stamp"),
        ("[time]\nstamp = 't'\nunit = 'm'\n" + _section(), "time.unit: cannot convert"),
        ("[ruder]\ntopic='/t'\nfield='x'\nunit='rad'", "did you mean 'rudder'"),
        ("[fuel]\ntopic='/t'\nfield='x'\nunit='kg/h'", "needs `positive`"),
        ("[rudder]\ntopic = [1", "not a TOML file"),
    ],
)
def test_an_error_of_a_layout_names_the_key_and_the_remedy(text: str, message: str) -> None:
    with pytest.raises(LayoutError, match=message) as error:
        parse_mcap_layout(text, "bag.toml")
    assert "bag.toml" in str(error.value)
    assert "\n" not in str(error.value)


def test_all_errors_of_a_layout_are_reported_at_once() -> None:
    with pytest.raises(LayoutError, match=r"3 errors.*lacks field.*sign must.*unknown unit"):
        parse_mcap_layout(_section(field=None, unit="'furlong'", sign="0"), "bag.toml")


def test_a_missing_layout_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match="no such layout file"):
        load_mcap_layout(tmp_path / "none.toml")


def test_a_path_has_names_and_numbers_of_elements() -> None:
    assert parse_path("a.b[2].c[0]") == ("a", "b", 2, "c", 0)
    assert parse_path('a."b.c[0]"[2]') == ("a", "b.c[0]", 2)
    for wrong in ("", ".a", "a.", "a[", "a[-1]", "a[0", "[0]", "a b[1]x", 'a"', '"', '""'):
        assert parse_path(wrong) is None, wrong
