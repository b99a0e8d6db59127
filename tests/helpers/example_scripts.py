"""The scripts of the examples as modules."""

import importlib.util
from functools import cache
from types import ModuleType

from places import PROJECT

PAPER_SYSTEMS = PROJECT / "examples" / "papers" / "systems"


@cache
def example_script(name: str) -> ModuleType:
    """Return the script examples/NAME.py as a module."""
    spec = importlib.util.spec_from_file_location(name, PROJECT / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def paper_system(name: str) -> str:
    """Return the text of a system file of the papers' examples."""
    return (PAPER_SYSTEMS / f"{name}.toml").read_text(encoding="utf-8")
