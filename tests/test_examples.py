"""The pages of the docs that scripts print are up to date."""

import re
import sys
import warnings
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
from places import KVLCC2, PROJECT

EXAMPLES = PROJECT / "examples"
PAPERS = sorted(path for path in (EXAMPLES / "papers").glob("*.py") if path.stem != "markdown_page")
MODEL_TESTS = "## The KVLCC2"  # this section needs data that may be missing


def page_skeleton(page: str) -> list[str]:
    """Return the prose of a page and the first cells of its tables, with numbers replaced by #.

    The last digits of the numbers depend on the processor.
    """
    lines = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    kept = (line for line in lines if not line.startswith("!") and line.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", line) for line in kept]


class Printed:
    """Scripts of the examples, run in this process, which has imported their libraries."""

    def __init__(
        self, figures: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        self.figures, self._monkeypatch, self._capsys = figures, monkeypatch, capsys
        figures.mkdir()

    def by(self, script: Path, **constants: object) -> str:
        """Return what a script prints with other values of some of its constants."""
        patch = self._monkeypatch
        patch.chdir(EXAMPLES)
        patch.syspath_prepend(script.parent)
        patch.setattr(sys, "argv", [script.name, "--figures", str(self.figures)])
        for name in ("markdown_page", "papers.markdown_page"):  # it reads the arguments once
            patch.delitem(sys.modules, name, raising=False)
        spec = spec_from_file_location(script.stem, script)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        patch.setitem(sys.modules, script.stem, module)
        spec.loader.exec_module(module)
        for name, value in constants.items():
            patch.setattr(module, name, value)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            module.main()
        return self._capsys.readouterr().out


@pytest.fixture
def printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Printed:
    pytest.importorskip("matplotlib", reason="the examples' pictures need matplotlib")
    return Printed(tmp_path / "figures", monkeypatch, capsys)


@pytest.mark.parametrize("script", PAPERS, ids=lambda script: script.stem)
def test_a_page_of_a_paper_is_the_output_of_its_script(script: Path, printed: Printed) -> None:
    page = printed.by(script)
    assert_same_page(page, f"papers_{script.stem}.md", "papers", printed.figures)


def test_the_page_of_all_methods_is_the_output_of_its_script(
    printed: Printed, tmp_path: Path
) -> None:
    """A sample log, two simulated trials and two model tests print the lines of all of them."""
    runs = tmp_path / "kvlcc2"
    for tank in KVLCC2.glob("*/"):
        first = min(tank.glob("*.dat"), default=None)
        if first:
            (runs / tank.name).mkdir(parents=True)
            (runs / tank.name / first.name).symlink_to(first)
    fewer = {"SAMPLES": ("zigzag_20_20",), "SEEDS": range(2), "KVLCC2": runs}
    page = printed.by(EXAMPLES / "methods.py", **fewer)
    assert_same_page(page, "methods.md", "methods", printed.figures)


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
