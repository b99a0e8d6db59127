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

F = TypeVar("F", bound=Callable[..., object])

OUTDATED_SECS = 86_400.0  # machine code of other sources may still be another process's


def _kept() -> Path:
    """Where machine code is kept: a folder named after all our sources.

    Machine code holds what it calls and the shape of what it is given, and numba looks at the file
    of the caller alone: without this a change in one module would leave the old loops of another
    running.
    """
    ours, digest = Path(__file__).parents[1], sha256()
    for package in ("shiplog", "recorders", "analysis"):
        for path in sorted((ours / package).rglob("*.py")):
            digest.update(path.read_bytes())
    where = Path(numba.config.CACHE_DIR) if numba.config.CACHE_DIR else _usual_place()
    return where / f"shiplog-{digest.hexdigest()[:16]}"


def _usual_place() -> Path:
    """Beside the package, or, where the user may not write, beside their other caches.

    Never where another user could have laid something before: it will be run.
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


KEPT = _kept()
numba.config.CACHE_DIR = str(KEPT)
_forget_others(KEPT)


def compiled(function: F) -> F:
    """Compile `function` on its first call, and keep the machine code for later runs."""
    return cast("F", numba.njit(cache=True, error_model="numpy")(function))


def is_compiled(package: str) -> bool:
    """Whether machine code of a package of ours is kept from an earlier run."""
    return next(KEPT.rglob(f"{package}*/*.nbi"), None) is not None


def compiled_within(function: F) -> F:
    """Compile `function` as a part of the compiled function that calls it, and keep it there.

    For what many modules share and each compiles in its own way: kept by itself, its machine code
    would outlive a change of the module that it was compiled for.
    """
    return cast("F", numba.njit(error_model="numpy")(function))


def case_of(generic: Callable[..., object], kind: type) -> Callable[[F], F]:
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
