"""numba's `njit` with a type: the compiled functions read like the equations they are."""

import os
import shutil
import tempfile
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import TypeVar, cast

import numba
from numba import types
from numba.extending import overload

from .extensions import extension_sources

F = TypeVar("F", bound=Callable[..., object])

HOME = Path(__file__).parents[1]
PACKAGES = ("shiplog", "recorders", "analysis")
OUTDATED_SECS = 86_400.0  # machine code of other sources may still be another process's


def _cache_folder() -> Path:
    """Return the folder of the machine code, named by a digest of all sources it depends on.

    Numba checks the file of a compiled function alone. Its machine code also holds the functions
    it calls, the constants it reads and the layout of the NamedTuples it takes; a change in
    another file would leave outdated machine code running. The equations of a ship model of
    another package become a part of our loops, too.
    """
    digest = sha256()
    own = (file for package in PACKAGES for file in (HOME / package).rglob("*.py"))
    for path in sorted({*own, *extension_sources("shiplog.ship_models")}):
        digest.update(path.read_bytes())
    where = Path(numba.config.CACHE_DIR) if numba.config.CACHE_DIR else _default_folder()
    return where / f"shiplog-{digest.hexdigest()[:16]}"


def _default_folder() -> Path:
    """The folder beside the package, or the user's cache folder where that is not writable.

    Never a folder in which another user could have placed files: their code would be run.
    """
    beside = Path(__file__).parent
    if os.access(beside, os.W_OK):
        return beside / "__pycache__"
    own = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"
    try:
        own.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="shiplog-"))  # for this run alone
    return own


def _forget_others(kept: Path) -> None:
    for other in kept.parent.glob("shiplog-*"):
        if other != kept and time.time() - other.stat().st_mtime > OUTDATED_SECS:
            shutil.rmtree(other, ignore_errors=True)


CACHE_FOLDER = _cache_folder()
numba.config.CACHE_DIR = str(CACHE_FOLDER)
_forget_others(CACHE_FOLDER)


def compiled(function: F) -> F:
    """Compile `function` on its first call, and keep the machine code for later runs."""
    return cast("F", numba.njit(cache=True, error_model="numpy")(function))


def is_compiled(package: str) -> bool:
    """Whether machine code of one of our packages is kept from an earlier run."""
    folders = {path.parent.name for path in (HOME / package).rglob("*.py")}
    return any(next(CACHE_FOLDER.rglob(f"{folder}_*/*.nbi"), None) for folder in folders)


def compiled_in_caller(function: F) -> F:
    """Compile `function` as a part of the compiled function that calls it, and keep it there.

    For what many modules share and each compiles in its own way: kept by itself, its machine code
    would outlive a change of the module that it was compiled for.
    """
    return cast("F", numba.njit(error_model="numpy")(function))


def overload_for(generic: Callable[..., object], kind: type) -> Callable[[F], F]:
    """Make a function what compiled code calls as `generic` when its first argument is a `kind`.

    `kind` is a NamedTuple, float or complex. Numba would have to compile anew in each process what
    takes a function as an argument; a type it knows again.
    """
    number = {float: types.Float, complex: types.Complex}.get(kind)

    def registered(function: F) -> F:
        def choose(first: object, *_: object) -> F | None:
            named = getattr(first, "instance_class", None) is kind
            return function if named or (number and isinstance(first, number)) else None

        overload(generic, strict=False)(choose)
        return function

    return registered
