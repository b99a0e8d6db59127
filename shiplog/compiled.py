"""Compilation of numerical loops by numba, with a cache of machine code on disk.

`compiled` is numba's `njit` with a type. Its cache folder is named after all of our sources that
the machine code depends on, so that a change in any of them compiles everything anew. What is
compiled for types of other packages, such as a ship model's, is in a folder within it, named after
their sources too: such a package is compiled anew when it changes, and our own loops are not.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba import types
from numba.core.sigutils import normalize_signature
from numba.extending import overload
from numba.np.unsafe.ndarray import to_fixed_tuple

from .extensions import extension_sources
from .machine_code import SUFFIX, CheckedCache, delete_outdated, usable_folder

F = TypeVar("F", bound=Callable[..., object])

PROJECT_FOLDER = Path(__file__).parents[1]
OWN_PACKAGES = ("shiplog", "recorders", "analysis")
# no function is passed as a C pointer: the wrapper for it takes a twelfth of the compilation
OPTIONS = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
# Folders and files with compiled functions, or with what these call and read; a test checks it.
COMPILED_SOURCES = (
    "shiplog/compiled.py",
    "shiplog/machine_code.py",
    "shiplog/ships",
    "recorders/simulated",
    "analysis/disturbance",
    "analysis/filters",
    "analysis/linear",
    "analysis/regression",
    "analysis/signals",
    "analysis/replay/residuals.py",
    "analysis/view/decimation.py",
)


def compiled_sources() -> list[Path]:
    """Return the files of the three packages that the machine code depends on."""
    places = [PROJECT_FOLDER / place for place in COMPILED_SOURCES]
    return [path for p in places for path in (p.rglob("*.py") if p.is_dir() else [p])]


def _cache_name() -> str:
    """Return the name of the cache's folder, with a hash of our sources it depends on.

    Numba's own cache checks only the file of a compiled function. The machine code also contains
    the functions it calls, the constants it reads and the layout of the NamedTuples it takes;
    after a change in another file, outdated machine code would run.
    """
    return f"shiplog-{_digest(compiled_sources(), numba.__version__, np.__version__)}"


@cache
def _extension_folder() -> Path:
    """Return the folder of the machine code that the installed ship models are a part of."""
    sources = extension_sources("shiplog.ship_models")
    folder = CACHE_FOLDER / f"extensions-{_digest(sources)}"
    delete_outdated(folder)
    return folder


def _digest(paths: list[Path], *versions: str) -> str:
    digest = sha256(" ".join(versions).encode())
    for path in sorted(set(paths)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_parents() -> Iterator[Path]:
    """Yield the folder that the user chose, or that beside the package and the user's cache.

    They are never folders where another user could place files, since their code would be executed.
    """
    if numba.config.CACHE_DIR:
        yield Path(numba.config.CACHE_DIR)
        return
    beside = Path(__file__).parent / "__pycache__"
    if os.access(beside.parent, os.W_OK):
        yield beside
    try:
        own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"
    except RuntimeError:  # a user without a home
        yield beside
        return
    with suppress(OSError):
        own.mkdir(mode=0o700, parents=True, exist_ok=True)
    yield own


CACHE_FOLDER = usable_folder(_cache_parents(), _cache_name())
numba.config.CACHE_DIR = str(CACHE_FOLDER)
delete_outdated(CACHE_FOLDER)


class _CacheByTypes(CheckedCache):
    """Cache of a function, which for types of other packages is in the folder of these."""

    def load_overload(self, signature: Any, context: Any) -> Any:  # noqa: ANN401
        if self._is_own(signature):
            return super().load_overload(signature, context)
        return self._of_extensions.load_overload(signature, context)

    def save_overload(self, signature: Any, result: Any) -> None:  # noqa: ANN401
        if self._is_own(signature):
            super().save_overload(signature, result)
        else:
            self._of_extensions.save_overload(signature, result)

    def _is_own(self, signature: Any) -> bool:  # noqa: ANN401
        arguments, _ = normalize_signature(signature)
        return _is_of_own_package(self._py_func) and all(map(_is_own_type, arguments))

    @cached_property
    def _of_extensions(self) -> CheckedCache:
        numba.config.CACHE_DIR = str(_extension_folder())
        try:
            return CheckedCache(self._py_func)
        finally:
            numba.config.CACHE_DIR = str(CACHE_FOLDER)


def _is_own_type(kind: types.Type) -> bool:
    """Whether no other package has a part in what is compiled for a type of argument."""
    if isinstance(kind, types.BaseNamedTuple) and not _is_of_own_package(kind.instance_class):
        return False
    if isinstance(kind, types.BaseTuple):
        return all(map(_is_own_type, kind))
    plain = types.Number, types.Boolean, types.Array, types.NoneType, types.Omitted
    return isinstance(kind, plain)


def _is_of_own_package(thing: Callable[..., object]) -> bool:
    return thing.__module__.partition(".")[0] in OWN_PACKAGES


def compiled(function: F) -> F:
    """Compile `function` on its first call, and keep the machine code for later runs.

    It releases the GIL, so that threads run it at the same time.
    """
    dispatcher = numba.njit(**OPTIONS)(function)
    if Path(function.__code__.co_filename).is_file():  # not at a prompt
        dispatcher._cache = _CacheByTypes(function)  # noqa: SLF001, what its enable_caching() does
    return cast("F", dispatcher)


def is_compiled(package: str) -> bool:
    """Whether the cache has machine code of a package, such as "analysis", from an earlier run."""
    own = (path for path in compiled_sources() if path.is_relative_to(PROJECT_FOLDER / package))
    folders = {path.parent.name for path in own}
    return any(next(CACHE_FOLDER.glob(f"{folder}_*/*{SUFFIX}"), None) for folder in folders)


def compiled_in_caller(function: F) -> F:
    """Compile a function as part of each compiled function that calls it.

    For functions that several modules share and each compiles differently, by `overload_for`. With
    a cache entry of its own, the machine code would outlive a change of the module for which it
    was compiled.
    """
    return cast("F", numba.njit(**OPTIONS)(function))


def inlined(function: F) -> F:
    """Insert the body of a function into each compiled function that calls it.

    For a part of a long loop that is called in one place. A compiled function is optimised anew in
    each compiled function that calls it, directly or through others; an inlined one only once.
    """
    return cast("F", numba.njit(**OPTIONS, inline="always")(function))


def overload_for(generic: Callable[..., object], kind: type) -> Callable[[F], F]:
    """Register a function as the implementation of `generic` for one type of first argument.

    Compiled code that calls `generic` with a first argument of type `kind` calls the registered
    function instead. This replaces functions as arguments, which numba would compile anew in each
    process; types it finds in its cache.

    Parameters
    ----------
    generic
        The function that compiled code calls. Its own body is for Python.
    kind
        A class of NamedTuple, float or complex.

    Returns
    -------
    decorator
        Registers the function it is given, and returns it unchanged.
    """
    number = {float: types.Float, complex: types.Complex}.get(kind)

    def registered(function: F) -> F:
        def choose(first: object, *_: object) -> F | None:
            named = getattr(first, "instance_class", None) is kind
            return function if named or (number and isinstance(first, number)) else None

        overload(generic, strict=False)(choose)
        return function

    return registered


@compiled
def copy_vector(target: Any, source: Any) -> None:  # noqa: ANN401
    """Copy an array or a tuple of numbers (n,) into an array, element by element.

    The assignment ``target[:] = source`` compiles for two seconds longer: numba compiles the text
    of its error with it.
    """
    for i in range(len(source)):
        target[i] = source[i]


def element(arrays: Any, i: int) -> Any:  # noqa: ANN401
    """Return the NamedTuple of the i-th value of each array of a NamedTuple, of the same type.

    In compiled code the arrays are complex.
    """
    return type(arrays)(*(array[i] for array in arrays))


def _compiled_element(arrays: Any, _: object) -> Callable[..., object]:  # noqa: ANN401
    kind, count = arrays.instance_class, len(arrays)

    def chosen(arrays: Any, i: int) -> Any:  # noqa: ANN401
        values = np.empty(count, np.complex128)
        for field in range(count):
            values[field] = arrays[field][i]
        return kind(*to_fixed_tuple(values, count))

    return chosen


overload(element, strict=False)(_compiled_element)
