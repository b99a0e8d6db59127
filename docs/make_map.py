"""Write the map of the modules in CONTRIBUTING.md from their docstrings.

python docs/make_map.py
"""

import ast
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
PAGE = PROJECT / "CONTRIBUTING.md"
BEGIN, END = "<!-- map: made by docs/make_map.py -->\n", "<!-- end of the map -->\n"
PACKAGES = ("shiplog", "recorders", "analysis")
COLUMN = 28  # where the descriptions begin


def module_map() -> str:
    """Return the map: a line for each folder and module, with its docstring's first line."""
    lines: list[str] = []
    for package in PACKAGES:
        lines += _folder(PROJECT / package, 0)
    return "\n".join(f"    {line}".rstrip() for line in lines) + "\n"


def _folder(folder: Path, depth: int) -> list[str]:
    lines = [_line(f"{folder.name}/", folder / "__init__.py", depth)]
    modules = (p for p in sorted(folder.glob("*.py")) if p.stem not in ("__init__", "__main__"))
    lines += [_line(path.stem, path, depth + 1) for path in modules]
    for inner in sorted(path.parent for path in folder.glob("*/__init__.py")):
        lines += _folder(inner, depth + 1)
    return lines


def _line(name: str, path: Path, depth: int) -> str:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    if not text:
        raise SystemExit(f"a module without a docstring: {path}")
    return f"{'  ' * depth + name:<{COLUMN}}{text.splitlines()[0].rstrip('.')}"


def updated(page: str) -> str:
    """Return the page with the map in it as it is now."""
    before, rest = page.split(BEGIN)
    return f"{before}{BEGIN}\n{module_map()}\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(updated(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
