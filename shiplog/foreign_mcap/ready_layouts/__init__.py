"""Layouts of well-known types of messages, as TOML files that begin each draft."""

from collections.abc import Mapping
from importlib.resources import files

_FILES = {
    "sensor_msgs/Imu": "Imu",
    "geometry_msgs/TwistStamped": "TwistStamped",
    "nav_msgs/Odometry": "Odometry",
    "sensor_msgs/NavSatFix": "NavSatFix",
    "std_msgs/Float64": "Float64",
    "foxglove.LocationFix": "LocationFix",
    "vehicle_angular_velocity": "vehicle_angular_velocity",
    "vehicle_attitude": "vehicle_attitude",
    "vehicle_global_position": "vehicle_global_position",
    "vehicle_local_position": "vehicle_local_position",
}


def ready_layouts() -> Mapping[str, str]:
    """Return the texts of the layouts by the type of the messages, without `msg` in its middle.

    Examples
    --------
    >>> "latitude" in ready_layouts()["sensor_msgs/NavSatFix"]
    True
    """
    folder = files(__name__)
    return {
        name: folder.joinpath(f"{file}.toml").read_text(encoding="utf-8")
        for name, file in _FILES.items()
    }
