"""An installed format of numbers for the tests of trials."""

from pathlib import Path

import pytest
from extensions import declare

from recorders.streams.format import GROUP


@pytest.fixture
def numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Declare the format `numbers`, and work in the folder of the test."""
    declare(tmp_path / "site", "numbers", GROUP, numbers="number_format:NUMBERS")
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
