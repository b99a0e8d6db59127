"""The map in CONTRIBUTING.md, and names that occur once."""

import ast
import re
import runpy
from collections import Counter

import pytest
from places import PROJECT

PACKAGES = ("shiplog", "recorders", "analysis")
SOURCES = sorted(path for package in PACKAGES for path in (PROJECT / package).rglob("*.py"))
REPEATED = {"__init__", "__main__", "cli"}


def test_the_map_is_that_of_the_docstrings() -> None:
    maker = runpy.run_path(str(PROJECT / "docs" / "make_map.py"))
    page = (PROJECT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert maker["updated"](page) == page, "stale; run: python docs/make_map.py"


def test_the_places_that_contributing_names_exist() -> None:
    page = (PROJECT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = page.split("## Where to change what")[1].split("## Map")[0]
    paths = re.findall(r"`([\w/]+(?:\.py)?)`", table) + re.findall(r"\((docs/\w+\.md)\)", table)
    paths = [path for path in paths if "/" in path]
    assert len(paths) > 15
    assert [path for path in paths if not (PROJECT / path).exists()] == []


def test_a_basename_occurs_once() -> None:
    names = Counter(path.stem for path in SOURCES if path.stem not in REPEATED)
    assert [name for name, count in names.items() if count > 1] == []


@pytest.mark.parametrize("kind", [ast.ClassDef, ast.FunctionDef])
def test_a_public_class_or_function_name_occurs_once(kind: type) -> None:
    places: dict[str, list[str]] = {}
    for path in SOURCES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, kind) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(str(path.relative_to(PROJECT)))
    assert {name: found for name, found in places.items() if len(found) > 1} == {}
