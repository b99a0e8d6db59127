"""The pages of the docs that scripts print are up to date."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from places import PROJECT

PAPERS = sorted(
    path for path in (PROJECT / "examples" / "papers").glob("*.py") if path.stem != "markdown_page"
)
METHODS = PROJECT / "examples" / "methods.py"
MODEL_TESTS = "## The KVLCC2"  # this section needs data that may be missing


def page_skeleton(page: str) -> list[str]:
    """Return the prose of a page and the first cells of its tables, with numbers replaced by #.

    The last digits of the numbers depend on the processor.
    """
    lines = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    kept = (line for line in lines if not line.startswith("!") and line.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", line) for line in kept]


@pytest.mark.parametrize("script", [*PAPERS, METHODS], ids=lambda script: script.stem)
def test_a_page_is_the_output_of_its_script(script: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the examples' pictures need matplotlib")
    result = subprocess.run(
        [sys.executable, str(script), "--figures", str(tmp_path)],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert result.returncode == 0, result.stderr
    kind = "methods" if script == METHODS else "papers"
    name = f"{'' if script == METHODS else 'papers_'}{script.stem}.md"
    page = (PROJECT / "docs" / name).read_text(encoding="utf-8")
    pictures = re.findall(rf"images/{kind}/([\w.]+)\)", page)
    assert sorted(pictures) == sorted(path.name for path in tmp_path.iterdir())
    assert all((PROJECT / "docs" / "images" / kind / name).is_file() for name in pictures)
    if MODEL_TESTS not in result.stdout:
        page = page.split(MODEL_TESTS)[0]
    assert page_skeleton(result.stdout) == page_skeleton(page)


def test_every_paper_has_its_page_in_the_index() -> None:
    index = (PROJECT / "docs" / "papers.md").read_text(encoding="utf-8")
    for script in PAPERS:
        assert f"papers_{script.stem}.md" in index
