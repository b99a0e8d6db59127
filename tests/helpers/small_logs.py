"""A small log with unusual values that a table must keep, and a comparison of two logs."""

import numpy as np

from shiplog.types import Channel, TrialLog

EXTREME_VALUES = np.array([np.nan, -0.0, 0.0, 5e-324, -1.7976931348623157e308])
LAYOUT = """
[time]
column = 1
unit = "s"
[yaw_rate]
column = 2
unit = "deg/s"
"""


def trial() -> TrialLog:
    """Return a log with extreme values, an empty channel, two fields and decreasing times."""
    stamps = 1_700_000_000_000_000_001 + 100_000_000 * np.arange(5)
    places = np.arange(10.0).reshape(5, 2) / 3
    empty = stamps[:0]
    return TrialLog(
        "trial.mcap",
        (
            Channel(
                "yaw_rate",
                "gyro, main",
                "rad/s",
                stamps,
                stamps + 7,
                EXTREME_VALUES,
                (),
                {"a": 'b,"\n'},
            ),
            Channel("position", "gps", "m", stamps, stamps, places, ("north", "east")),
            Channel("speed", "log", "m/s", empty, empty, empty.astype(float)),
            Channel("yaw_rate", "mems", "rad/s", stamps[::-1], stamps, np.arange(5) / 7),
        ),
        {"trial": "zig-zag 20/20 °", "format_version": "1"},
        'name = "Mariner"\r\n\n# end\n',
    )


def require_same(one: TrialLog, other: TrialLog) -> None:
    """Check that two logs are equal to the last bit: NaN, signs of zero, times, metadata."""
    assert dict(one.metadata) == dict(other.metadata)
    assert one.vessel_toml == other.vessel_toml
    assert len(one.channels) == len(other.channels)
    for a, b in zip(one, other, strict=True):
        assert (a.name, a.source, a.unit, a.fields) == (b.name, b.source, b.unit, b.fields)
        assert dict(a.metadata) == dict(b.metadata)
        assert a.measured_ns.tolist() == b.measured_ns.tolist()
        assert a.received_ns.tolist() == b.received_ns.tolist()
        assert a.values.shape == b.values.shape
        assert np.array_equal(a.values, b.values, equal_nan=True)
        finite = ~np.isnan(a.values)
        assert np.array_equal(np.signbit(a.values[finite]), np.signbit(b.values[finite]))
