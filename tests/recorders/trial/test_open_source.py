"""Tests of recorders.trial.open_source: the streams of a trial file, for each built-in format."""

from pathlib import Path

import pytest

from recorders.trial.open_source import trial_requests
from recorders.trial.trial_file import load_trial_file


@pytest.mark.parametrize(
    ("format_name", "options", "expected"),
    [
        ("nmea0183", 'time = "gnss"\nno_checksum = true', {"time": "gnss", "no_checksum": True}),
        ("nmea2000", 'line_format = "candump"', {"line_format": "candump", "time": "received"}),
        ("signalk", 'self = "vessels.urn:mrn:1"', {"self": "vessels.urn:mrn:1"}),
        ("signalk", "", {"self": None, "time": "received"}),
    ],
)
def test_the_options_of_a_source_are_those_of_its_format(
    tmp_path: Path, format_name: str, options: str, expected: dict[str, object]
) -> None:
    file = tmp_path / "trial.toml"
    source = f'name = "bridge"\nformat = "{format_name}"\naddress = "udp://127.0.0.1:10110"'
    file.write_text(f"[[source]]\n{source}\n{options}\n", encoding="utf-8")
    [request] = trial_requests(load_trial_file(file))
    assert request.prefix == "bridge."
    assert expected.items() <= vars(request.options).items()


def test_the_paths_of_a_source_are_relative_to_the_trial_file(tmp_path: Path) -> None:
    file = tmp_path / "trial.toml"
    file.write_text(
        '[[source]]\nname = "mast"\nformat = "csv-lines"\naddress = "mast.txt"\n'
        'layout = "mast.toml"\n',
        encoding="utf-8",
    )
    [request] = trial_requests(load_trial_file(file))
    assert request.address == str(tmp_path / "mast.txt")
    assert request.options.layout == tmp_path / "mast.toml"
