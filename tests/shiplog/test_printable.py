"""Nothing that came from the wire controls the terminal."""

import json
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from shiplog import Channel, LogWriter
from shiplog.cli.main import main
from shiplog.printable import printable
from shiplog.types import Event, RawPackets

HOSTILE = "a\x1b[2J\x9b1m\u202e\x07\r\nb"


def controls(text: str) -> set[str]:
    return {c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs")} - {"\n"}


def test_control_characters_are_escaped_and_other_text_is_unchanged() -> None:
    assert controls(printable(HOSTILE)) == set()
    assert "\n" not in printable(HOSTILE)
    assert printable("Нева, 20° стб [deg]") == "Нева, 20° стб [deg]"


@pytest.mark.parametrize("options", [[], ["--json", "-"]])
def test_info_prints_no_control_characters_of_a_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    path, at = tmp_path / "a.mcap", np.arange(20) * 10**8
    with LogWriter(path, metadata={HOSTILE: HOSTILE}) as writer:
        writer.write(
            Channel("speed", HOSTILE, "m/s", at, at, at * 1e-9),
            RawPackets(HOSTILE, HOSTILE, at[:1], (b"$",)),
            Event(0, HOSTILE, HOSTILE),
        )
    assert main(["info", str(path), *options]) == 0
    output = capsys.readouterr()
    assert controls(output.out + output.err) == set()
    if options:
        assert json.loads(output.out)["events"][0]["text"] == HOSTILE


def test_warnings_and_errors_are_escaped_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(tmp_path / "x\x1b[2J.mcap")]) != 0
    assert controls(capsys.readouterr().err) == set()
