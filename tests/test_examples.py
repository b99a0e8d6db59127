"""The pages of the docs that scripts print are up to date."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from places import KVLCC2, PROJECT

PAPERS = sorted(
    path for path in (PROJECT / "examples" / "papers").glob("*.py") if path.stem != "markdown_page"
)
FEWER_METHODS = """
from pathlib import Path
import methods
methods.SEEDS = range(2)
methods.KVLCC2 = Path({runs!r})
methods.main()
"""
MODEL_TESTS = "## The KVLCC2"  # this section needs data that may be missing


def page_skeleton(page: str) -> list[str]:
    """Return the prose of a page and the first cells of its tables, with numbers replaced by #.

    The last digits of the numbers depend on the processor.
    """
    lines = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    kept = (line for line in lines if not line.startswith("!") and line.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", line) for line in kept]


@pytest.mark.parametrize("script", PAPERS, ids=lambda script: script.stem)
def test_a_page_of_a_paper_is_the_output_of_its_script(script: Path, tmp_path: Path) -> None:
    printed = output([str(script)], tmp_path)
    assert_same_page(printed, f"papers_{script.stem}.md", "papers", tmp_path)


def test_the_page_of_all_methods_is_the_output_of_its_script(tmp_path: Path) -> None:
    """Two simulated trials and two model tests print the same lines as all of them."""
    runs, figures = tmp_path / "kvlcc2", tmp_path / "figures"
    for tank in KVLCC2.glob("*/"):
        first = min(tank.glob("*.dat"), default=None)
        if first:
            (runs / tank.name).mkdir(parents=True)
            (runs / tank.name / first.name).symlink_to(first)
    printed = output(["-c", FEWER_METHODS.format(runs=str(runs))], figures)
    assert_same_page(printed, "methods.md", "methods", figures)


def output(script: list[str], figures: Path) -> str:
    """Run a script of the examples in Python; return what it prints."""
    pytest.importorskip("matplotlib", reason="the examples' pictures need matplotlib")
    figures.mkdir(exist_ok=True)
    result = subprocess.run(
        [sys.executable, *script, "--figures", str(figures)],
        cwd=PROJECT / "examples",
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def assert_same_page(printed: str, name: str, kind: str, figures: Path) -> None:
    """Compare what a script prints and draws with a page of the docs and its pictures."""
    page = (PROJECT / "docs" / name).read_text(encoding="utf-8")
    pictures = re.findall(rf"images/{kind}/([\w.]+)\)", page)
    assert sorted(pictures) == sorted(path.name for path in figures.iterdir())
    assert all((PROJECT / "docs" / "images" / kind / name).is_file() for name in pictures)
    if MODEL_TESTS not in printed:
        page = page.split(MODEL_TESTS)[0]
    assert page_skeleton(printed) == page_skeleton(page)


def test_every_paper_has_its_page_in_the_index() -> None:
    index = (PROJECT / "docs" / "papers.md").read_text(encoding="utf-8")
    for script in PAPERS:
        assert f"papers_{script.stem}.md" in index
