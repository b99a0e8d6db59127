"""A minimal layout file, and a function that parses layouts from text."""

from shiplog.layouts.layout import Layout
from shiplog.layouts.layout_parser import parse_layout

MINIMAL = """
[time]
column = 1
unit = "s"
[yaw_rate]
column = 2
unit = "deg/s"
"""


def layout(text: str = MINIMAL, top: str = "") -> Layout:
    """Parse a layout from text, with further lines above it."""
    return parse_layout(f"{top}\n{text}", "gyro.toml")
