"""numba's `njit` with a type: the compiled functions read like the equations they are."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

if "NUMBA_CACHE_DIR" not in os.environ and not os.access(Path(__file__).parent, os.W_OK):
    # installed where the user may not write: keep the compiled code beside their other caches
    _home_cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    _parent = _home_cache if os.access(_home_cache, os.W_OK) else Path(tempfile.gettempdir())
    os.environ["NUMBA_CACHE_DIR"] = str(_parent / f"shiplog-{os.getuid()}")

import numba

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile `function` on its first call, and keep the machine code for later runs."""
    return cast("F", numba.njit(cache=True, error_model="numpy")(function))


def is_compiled(package: str) -> bool:
    """Whether machine code of a package of ours is kept from an earlier run."""
    kept = os.environ.get("NUMBA_CACHE_DIR")
    place = Path(kept) if kept else Path(__file__).parents[1] / package
    return next(place.rglob("*.nbi"), None) is not None
