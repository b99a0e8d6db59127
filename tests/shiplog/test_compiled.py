"""Machine code is cached for later runs, by the sources it was compiled from."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from extensions import declare

import shiplog
from shiplog.compiled import PROJECT_FOLDER, compiled_sources, element
from shiplog.ships.nomoto import Norrbin

SOURCES = [
    path.relative_to(PROJECT_FOLDER)
    for package in ("shiplog", "recorders", "analysis")
    for path in sorted((PROJECT_FOLDER / package).rglob("*.py"))
]

# prints which packages have machine code before and after a loop of shiplog is called
CODE = """
from shiplog.compiled import is_compiled
print(is_compiled("shiplog"), is_compiled("analysis"), end=" ")
from shiplog.ships.paper import Coefficients, rudder_effect, surge_acceleration
c = Coefficients(*[1.0] * 12)
print(rudder_effect(c, 0.0, 2.0), is_compiled("shiplog"), is_compiled("analysis"))
"""
# coefficients of a ship model of another package, with which our loops are compiled
FOREIGN = """
from typing import NamedTuple
class Foreign(NamedTuple):
    alpha1: float = 1.0
    alpha2: float = 0.0
    alpha3: float = 0.0
"""
# prints how often machine code of a loop is found, with our own coefficients and with the others
FOREIGN_CODE = """
from foreign import Foreign
from shiplog.ships.paper import Coefficients, rudder_effect
for c in Coefficients(*[1.0] * 12), Foreign():
    rudder_effect(c, 0.0, 2.0)
    print(sum(rudder_effect.stats.cache_hits.values()))
"""


def words_printed(cache: Path, cwd: Path, code: str = CODE) -> list[str]:
    """Run code with the given cache folder and return the words it prints."""
    path = os.pathsep.join((str(cwd), os.environ.get("PYTHONPATH", "")))
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": path},
        cwd=cwd,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def test_machine_code_is_cached_for_later_runs_and_a_first_run_is_detected(tmp_path: Path) -> None:
    first, second = words_printed(tmp_path, tmp_path), words_printed(tmp_path, tmp_path)
    assert first == ["False", "False", "2.0", "True", "False"]
    assert second == ["True", "False", "2.0", "True", "False"]


def test_machine_code_of_other_sources_is_not_used(tmp_path: Path) -> None:
    """A loop may call functions of another file, whose changes numba does not detect."""
    project = Path(shiplog.__file__).parents[1]
    for package in ("shiplog", "analysis", "recorders"):
        shutil.copytree(
            project / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    cache = tmp_path / "cache"
    assert words_printed(cache, tmp_path)[0] == "False"
    assert words_printed(cache, tmp_path)[0] == "True"
    changed = tmp_path / "analysis" / "signals" / "signal_stats.py"  # compiles nothing
    changed.write_text(changed.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert words_printed(cache, tmp_path)[0] == "False"


def test_a_change_of_another_package_compiles_our_loops_anew_for_its_types_alone(
    tmp_path: Path,
) -> None:
    source, cache = tmp_path / "foreign.py", tmp_path / "cache"
    source.write_text(FOREIGN, encoding="utf-8")
    assert words_printed(cache, tmp_path, FOREIGN_CODE) == ["0", "0"]
    declare(tmp_path, "foreign", "shiplog.ship_models", foreign="foreign:FOREIGN")
    assert words_printed(cache, tmp_path, FOREIGN_CODE) == ["1", "1"]
    assert words_printed(cache, tmp_path, FOREIGN_CODE) == ["1", "2"]
    source.write_text(FOREIGN + "\n", encoding="utf-8")
    assert words_printed(cache, tmp_path, FOREIGN_CODE) == ["1", "1"]


def test_machine_code_of_old_sources_is_deleted_after_a_day(tmp_path: Path) -> None:
    old, recent = tmp_path / "shiplog-0123", tmp_path / "shiplog-4567"
    for folder in (old, recent):
        folder.mkdir()
    os.utime(old, (0, 0))
    words_printed(tmp_path, tmp_path)
    assert not old.exists()
    assert recent.exists()


def test_an_element_of_a_named_tuple_of_arrays_is_of_its_type_in_python_and_compiled() -> None:
    arrays = Norrbin(*np.arange(12.0).reshape(6, 2).astype(complex))
    expected = Norrbin(1, 3, 5, 7, 9, 11)
    for got in (element(arrays, 1), numba.njit(lambda c: element(c, 1))(arrays)):
        assert isinstance(got, Norrbin)
        assert got == expected


def imported_names(tree: ast.Module, path: Path) -> dict[str, Path]:
    """Return the file of the project that each name of a module is imported from."""
    names = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            base = path.parent if node.level else Path()
            place = base.joinpath(*(node.module or "").split("."))
            for alias in node.names:
                files = (
                    place / f"{alias.name}.py",
                    place.with_suffix(".py"),
                    place / "__init__.py",
                )
                present = [file for file in files if (PROJECT_FOLDER / file).is_file()]
                if present:
                    names[alias.asname or alias.name] = present[0]
    return names


def is_compiled_function(node: ast.AST) -> bool:
    decorators = node.decorator_list if isinstance(node, ast.FunctionDef) else []
    return any("compiled" in ast.unparse(d) or "overload_for" in ast.unparse(d) for d in decorators)


def names_used(function: ast.FunctionDef) -> set[str]:
    """Return the names in a function's body; annotations do not affect its machine code."""
    body = ast.Module(function.body, [])
    within = [node.args for node in ast.walk(body) if isinstance(node, ast.FunctionDef)]
    types = {n for args in within for n in ast.walk(args)} | {
        n
        for node in ast.walk(body)
        if isinstance(node, ast.AnnAssign)
        for n in ast.walk(node.annotation)
    }
    return {n.id for n in ast.walk(body) if isinstance(n, ast.Name) and n not in types}


@pytest.fixture(scope="module")
def hashed() -> set[Path]:
    return {source.relative_to(PROJECT_FOLDER) for source in compiled_sources()}


@pytest.mark.parametrize("path", SOURCES, ids=str)
def test_the_cache_depends_on_all_that_compiled_functions_use(
    path: Path, hashed: set[Path]
) -> None:
    tree = ast.parse((PROJECT_FOLDER / path).read_text(encoding="utf-8"))
    imported = imported_names(tree, path)
    for function in filter(is_compiled_function, ast.walk(tree)):
        assert path in hashed
        assert {imported[name] for name in names_used(function) & set(imported)} <= hashed
