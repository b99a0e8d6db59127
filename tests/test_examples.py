"""The papers' pages are what their scripts print."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
SCRIPTS = sorted(
    path for path in (PROJECT / "examples" / "papers").glob("*.py") if path.stem != "printed"
)


def skeleton(page: str) -> list[str]:
    """The words, and what each row of a table is about; the last digits are the processor's."""
    rows = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    told = (row for row in rows if not row.startswith("!") and row.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", row) for row in told]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_papers_page_is_what_its_script_prints(script: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the examples' pictures need matplotlib")
    done = subprocess.run(
        [sys.executable, str(script), "--figures", str(tmp_path)],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    page = (PROJECT / "docs" / f"papers_{script.stem}.md").read_text(encoding="utf-8")
    pictures = re.findall(r"images/papers/([\w.]+)\)", page)
    assert sorted(pictures) == sorted(path.name for path in tmp_path.iterdir())
    assert all((PROJECT / "docs" / "images" / "papers" / name).is_file() for name in pictures)
    assert skeleton(done.stdout) == skeleton(page)


def test_every_paper_has_its_page_in_the_index() -> None:
    index = (PROJECT / "docs" / "papers.md").read_text(encoding="utf-8")
    for script in SCRIPTS:
        assert f"papers_{script.stem}.md" in index
