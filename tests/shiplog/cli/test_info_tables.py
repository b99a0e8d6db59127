"""Tables that `shiplog info` prints."""

import pytest

from shiplog.checks.log_content import ChannelInfo, LogInfo, ValueRange
from shiplog.cli.info_tables import info_tables


@pytest.mark.parametrize(
    ("lowest", "highest", "shown"),
    [
        (
            1406851200.0,
            1406937599.9,
            {
                "  date": ("2014-08-01", "2014-08-01", "UTC"),
                "  time of day": ("00:00:00", "23:59:59", "UTC"),
            },
        ),
        (1e300, 1e300, {"  date": ("1e+300", "1e+300", "UTC")}),  # no receiver sends it
    ],
)
def test_gnss_time_is_a_date_and_a_time_of_day(
    lowest: float, highest: float, shown: dict[str, tuple[str, ...]]
) -> None:
    values = ValueRange("", "s", lowest, highest)
    channel = ChannelInfo("/gnss_time/GP", "GP", "s", "", 2, ranges=(values,))
    [table] = info_tables(LogInfo("a.mcap", 0, 1, (channel,), (), {}, has_vessel=False))
    rows = {row[0]: row[3:6] for row in table.rows}
    assert rows["/gnss_time/GP"] == ("", "", "")
    assert {name: rows[name] for name in shown} == shown
