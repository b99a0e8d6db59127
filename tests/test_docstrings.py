"""Examples in docstrings do what they show."""

import doctest
import pkgutil
from collections.abc import Iterator
from importlib import import_module

import pytest
from places import PROJECT

PACKAGES = ("shiplog", "recorders", "analysis")


def modules() -> Iterator[str]:
    for package in PACKAGES:
        paths = [str(PROJECT / package)]
        yield package
        yield from (m.name for m in pkgutil.walk_packages(paths, f"{package}."))


@pytest.mark.parametrize("name", [name for name in modules() if not name.endswith("__main__")])
def test_examples_of_a_module_give_what_they_show(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(PROJECT)
    failed, _ = doctest.testmod(import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert failed == 0
