"""The pages of the docs that scripts print are up to date."""

import re
import sys
import warnings
from decimal import Decimal
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
from places import KVLCC2, PROJECT

EXAMPLES = PROJECT / "examples"
PAPERS = sorted(path for path in (EXAMPLES / "papers").glob("*.py") if path.stem != "markdown_page")
MODEL_TESTS = "## The KVLCC2"  # this section needs data that may be missing
OF_MANY_RUNS = ("## Random forcing", MODEL_TESTS)  # the tests print them for fewer runs
NUMBER = re.compile(r"[−+-]?\d[\d.,]*\d(?:e[−+-]?\d+)?|[−+-]?\d(?:e[−+-]?\d+)?")
LEAST_NUMBER = 1e-5  # smaller ones may be rounding errors
RELATIVE_TOLERANCE = 0.05


def page_skeleton(page: str) -> list[str]:
    """Return the prose of a page and the first cells of its tables, with numbers replaced by #.

    The last digits of the numbers depend on the processor.
    """
    lines = (line.split("|")[1] if line.startswith("|") else line for line in page.splitlines())
    kept = (line for line in lines if not line.startswith("!") and line.strip())
    return [re.sub(r"[−+-]?\d[\d.,]*(e[−+-]?\d+)?", "#", line) for line in kept]


def page_numbers(page: str) -> list[tuple[str, str]]:
    """Return each number of a page with its line, the pictures' lines excepted."""
    lines = [line for line in page.splitlines() if not line.startswith("!")]
    return [(line, text) for line in lines for text in NUMBER.findall(line)]


def table_numbers(page: str) -> dict[tuple[str, str, str, int], tuple[str, str]]:
    """Return the numbers of a page's tables with their lines, by heading, row, column and place.

    Sections that the tests print for fewer runs are omitted.
    """
    numbers, heading, section, columns = {}, "", "", None
    for line in page.splitlines():
        if line.startswith(("## ", "**")):
            heading = line
            section = line if line.startswith("#") else section
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if not cells:
            columns = None
        elif columns is None:
            columns = cells
        elif not section.startswith(OF_MANY_RUNS):
            for column, cell in zip(columns[1:], cells[1:], strict=True):
                for k, text in enumerate(NUMBER.findall(cell)):
                    numbers[heading, cells[0], column, k] = (line, text)
    return numbers


def same_number(printed: str, stated: str) -> bool:
    """Return whether two numbers agree but for their last digits, or for rounding errors."""
    ours, theirs = (Decimal(text.replace("−", "-").replace(",", "")) for text in (printed, stated))
    unit = Decimal(1).scaleb(int(theirs.as_tuple().exponent))
    tolerance = max(RELATIVE_TOLERANCE * abs(float(theirs)), 1.01 * float(unit))
    return abs(float(ours - theirs)) <= tolerance or max(abs(ours), abs(theirs)) < LEAST_NUMBER


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
    return Printed(tmp_path / "figures", monkeypatch, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("script", PAPERS, ids=lambda script: script.stem)
def test_a_page_of_a_paper_is_the_output_of_its_script(script: Path, printed: Printed) -> None:
    page = printed.by(script)
    stated = assert_same_page(page, f"papers_{script.stem}.md", "papers", printed.figures)
    for (line, ours), (_, theirs) in zip(page_numbers(page), page_numbers(stated), strict=True):
        assert same_number(ours, theirs), (line, theirs)


@pytest.mark.slow
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
    stated = table_numbers(assert_same_page(page, "methods.md", "methods", printed.figures))
    for place, (line, number) in table_numbers(page).items():
        assert same_number(number, stated[place][1]), (line, stated[place][1])


def assert_same_page(printed: str, name: str, kind: str, figures: Path) -> str:
    """Compare what a script prints and draws with a page of the docs; return the page."""
    page = (PROJECT / "docs" / name).read_text(encoding="utf-8")
    pictures = re.findall(rf"images/{kind}/([\w.]+)\)", page)
    assert sorted(pictures) == sorted(path.name for path in figures.iterdir())
    assert all((PROJECT / "docs" / "images" / kind / name).is_file() for name in pictures)
    if MODEL_TESTS not in printed:
        page = page.split(MODEL_TESTS)[0]
    assert page_skeleton(printed) == page_skeleton(page)
    return page


def test_every_paper_has_its_page_in_the_index() -> None:
    index = (PROJECT / "docs" / "papers.md").read_text(encoding="utf-8")
    for script in PAPERS:
        assert f"papers_{script.stem}.md" in index
