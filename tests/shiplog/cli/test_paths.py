"""Bad paths are rejected before any work, each in one line with its remedy."""

from pathlib import Path

import pytest

from shiplog.cli.paths import require_distinct, require_inputs, require_outputs, require_suffix
from shiplog.errors import LogError, ShiplogError, UsageError


def test_a_missing_log_and_a_folder_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"no such file: .*a\.mcap"):
        require_inputs(tmp_path / "a.mcap")
    with pytest.raises(LogError, match="name one file in it"):
        require_inputs(tmp_path)
    (tmp_path / "a.mcap").touch()
    require_inputs(tmp_path / "a.mcap", None)


def test_an_output_in_a_missing_folder_and_a_folder_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(ShiplogError, match="there is no folder"):
        require_outputs(tmp_path / "no" / "a.rrd")
    with pytest.raises(ShiplogError, match="it is a folder"):
        require_outputs(tmp_path)
    require_outputs(tmp_path / "a.rrd", None, "-")


def test_an_output_over_an_input_or_another_output_is_rejected(tmp_path: Path) -> None:
    log, review = tmp_path / "a.mcap", tmp_path / "a.rrd"
    for outputs in ([log], [review, review]):
        with pytest.raises(UsageError, match="named twice"):
            require_distinct(outputs, [log])
    (tmp_path / "a.001.mcap").touch()
    with pytest.raises(UsageError, match="named twice"):
        require_distinct([tmp_path / "a.001.mcap"], [log])  # a part of it
    require_distinct([review, None, "-", "-", "/dev/null", "/dev/null"], [log, None])


def test_an_output_is_named_as_its_kind_of_file() -> None:
    with pytest.raises(UsageError, match=r"a \.rrd file"):
        require_suffix(".rrd", "review.txt")
    require_suffix(".rrd", "review.RRD", None, "/dev/null")
