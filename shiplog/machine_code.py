"""Cache of machine code on disk, whose files have checksums: rebuilt or bypassed where unusable.

Numba's own cache ends each run with an exception where one of its files is empty, and runs what it
reads without a check.
"""

import atexit
import os
import pickle
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator
from numba.core.serialize import dumps

from .errors import CacheWarning, ShiplogError
from .files import atomic_write

DIGEST_BYTES = 32
SUFFIX = ".nbc"  # of the files of the cache
MIN_AGE_TO_DELETE_SECS = 86_400.0  # a younger cache may belong to a running process
_warned: set[str] = set()  # texts of the warnings that were given


def usable_folder(parents: Iterable[Path], name: str) -> Path:
    """Create the folder of the cache in the first of several places where that succeeds.

    Where none does, it is in a temporary folder, which this process shares with those that it
    starts and deletes at its end; a `CacheWarning` names the last place.

    Parameters
    ----------
    parents
        The places in the order of preference, at least one.
    name
        Name of the folder, which states what the machine code depends on.
    """
    for parent in parents:
        folder = parent / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            failed, reason = folder, error
        else:
            return folder
    _warn_unwritable(failed.parent, reason)
    try:
        temporary = Path(tempfile.mkdtemp(prefix="shiplog-"))
    except OSError:  # nothing can be kept
        return failed
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(temporary)  # of the processes that this one starts
    return usable_folder([temporary], name)


def delete_outdated(current: Path) -> None:
    """Delete the folders of other versions of the sources that are older than a day."""
    for other in current.parent.glob(f"{current.name.partition('-')[0]}-*"):
        with suppress(OSError):  # another process deletes it, or it is another user's
            if other != current and time.time() - other.stat().st_mtime > MIN_AGE_TO_DELETE_SECS:
                shutil.rmtree(other, ignore_errors=True)


class _Locator(UserProvidedCacheLocator):  # type: ignore[misc]
    """Place of a function's machine code in the folder of the cache, writable or not."""

    @classmethod
    def from_function(cls, py_func: object, py_file: str) -> "_Locator":
        return cls(py_func, py_file)


class _Content(CompileResultCacheImpl):  # type: ignore[misc]
    """What is kept of a compiled function."""

    _locator_classes = (_Locator,)


class CheckedCache(FunctionCache):  # type: ignore[misc]
    """Cache of a function's machine code that never ends a run."""

    _impl_class = _Content

    def __init__(self, py_func: object) -> None:
        super().__init__(py_func)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _CodeFiles(Path(self.cache_path), self._impl.filename_base, stamp)

    def load_overload(self, sig: object, target_context: Any) -> object:  # noqa: ANN401
        """Return the machine code for a signature, or None where it must be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # noqa: BLE001 - whatever it is, the loop is compiled anew
            path = self._cache_file.path(self._index_key(sig, target_context.codegen()))
            _warn_unreadable(path, error)
            return None

    def save_overload(self, sig: object, data: object) -> None:
        """Keep the machine code for a signature, where that is possible."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_unwritable(self._cache_file.folder, error)
        except ShiplogError as error:
            if isinstance(error.__cause__, OSError):  # else another process is writing the file
                _warn_unwritable(self._cache_file.folder, error.__cause__)


class _CodeFiles:
    """The files of one function's machine code: one for each signature and processor.

    Each begins with the checksum of the rest: the key of its content and the content.
    """

    def __init__(self, folder: Path, stem: str, stamp: object) -> None:
        self.folder, self._stem, self._stamp = folder, stem, stamp

    def path(self, key: object) -> Path:
        """Return the file of a key."""
        name = sha256(repr((key, self._stamp)).encode()).hexdigest()[:16]
        return self.folder / f"{self._stem}.{name}{SUFFIX}"

    def load(self, key: object) -> object:
        """Return what is kept under a key, or None."""
        try:
            data = self.path(key).read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None
        if sha256(data[DIGEST_BYTES:]).digest() != data[:DIGEST_BYTES]:
            raise ValueError("its checksum is wrong")
        kept_key, content = pickle.loads(data[DIGEST_BYTES:])  # noqa: S301 - we wrote it
        return content if kept_key == key else None

    def save(self, key: object, content: object) -> None:
        """Keep the content under a key."""
        data = dumps((key, content))
        with atomic_write(self.path(key)) as part:
            part.write_bytes(sha256(data).digest() + data)


def _warn_unreadable(path: Path, error: Exception) -> None:
    reason = getattr(error, "strerror", None) or error
    _warn(
        f"a file of the cache of compiled loops cannot be read ({reason}), and is made anew; "
        "delete its folder if this is repeated",
        path,
    )


def _warn_unwritable(folder: Path, error: OSError) -> None:
    reason = error.strerror or error
    _warn(
        f"the cache of compiled loops cannot be written ({reason}), so that each run compiles "
        "them; make room for it there, or set NUMBA_CACHE_DIR to another folder",
        folder,
    )


def _warn(text: str, place: Path) -> None:
    """Warn of each trouble once a run, not for each loop."""
    if text not in _warned:
        _warned.add(text)
        warnings.warn(f"{text}: {place}", CacheWarning, stacklevel=2)
