"""The pages of the docs that scripts print are what they print."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from places import PROJECT

PAPERS = sorted(
    path for path in (PROJECT / "examples" / "papers").glob("*.py") if path.stem != "printed"
)
METHODS = PROJECT / "examples" / "methods.py"
RECORDED = "## The KVLCC2"  # what follows needs the model tests, which may not be here


def skeleton(page: str) -> list[str]:
    """The words, and what each row of a table is about; the last digits are the processor's."""
    rows = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    told = (row for row in rows if not row.startswith("!") and row.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", row) for row in told]


@pytest.mark.parametrize("script", [*PAPERS, METHODS], ids=lambda script: script.stem)
def test_a_page_is_what_its_script_prints(script: Path, tmp_path: Path) -> None:
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
    kind = "methods" if script == METHODS else "papers"
    page = PROJECT / "docs" / f"{'' if script == METHODS else 'papers_'}{script.stem}.md"
    printed = page.read_text(encoding="utf-8")
    pictures = re.findall(rf"images/{kind}/([\w.]+)\)", printed)
    assert sorted(pictures) == sorted(path.name for path in tmp_path.iterdir())
    assert all((PROJECT / "docs" / "images" / kind / name).is_file() for name in pictures)
    if RECORDED not in done.stdout:
        printed = printed.split(RECORDED)[0]
    assert skeleton(done.stdout) == skeleton(printed)


def test_every_paper_has_its_page_in_the_index() -> None:
    index = (PROJECT / "docs" / "papers.md").read_text(encoding="utf-8")
    for script in PAPERS:
        assert f"papers_{script.stem}.md" in index
