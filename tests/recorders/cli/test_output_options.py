import argparse
from pathlib import Path

import pytest

from recorders.cli.output_options import RecordingOutput, add_output_options, recording_output
from recorders.disk_sync import SYNC_SECS
from recorders.record import Rotation
from recorders.trial.trial_file import TrialFile
from shiplog import UsageError

TRIAL = TrialFile(
    Path("trial.toml"), (), Path("trial.mcap"), rotate_minutes=60.0, flush_secs=0.5, fsync_secs=5.0
)


def _parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_output_options(parser, required=False)
    return parser.parse_args(arguments)


def test_without_options_the_keys_of_the_trial_file_apply() -> None:
    expected = RecordingOutput(Path("trial.mcap"), Rotation(60.0, None), 0.5, 5.0)
    assert recording_output(_parsed(), TRIAL) == expected


def test_an_option_precedes_the_key_of_the_trial_file() -> None:
    given = _parsed("-o", "a.mcap", "--rotate-megabytes", "5", "--flush", "2", "--fsync", "1")
    expected = RecordingOutput(Path("a.mcap"), Rotation(60.0, 5.0), 2.0, 1.0)
    assert recording_output(given, TRIAL) == expected


def test_without_any_setting_a_log_is_one_file_made_safe_by_default() -> None:
    output = recording_output(_parsed("-o", "a.mcap"))
    assert output.rotation is None
    assert output.flush_secs <= 0.5
    assert output.sync_secs == SYNC_SECS


def test_a_recording_without_output_is_refused() -> None:
    with pytest.raises(UsageError, match=r"no output; add -o FILE$"):
        recording_output(_parsed())
    with pytest.raises(UsageError, match=r"or `file` in \[output\]: trial\.toml"):
        recording_output(_parsed(), TrialFile(Path("trial.toml"), ()))


@pytest.mark.parametrize("text", ["0", "-1", "inf", "nan", "x"])
def test_an_interval_that_is_no_positive_number_is_a_usage_error(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        _parsed("--fsync", text)
    assert f"{text} is no positive number" in capsys.readouterr().err
