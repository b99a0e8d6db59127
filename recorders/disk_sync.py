"""Synchronisation of a growing file with its disk, in a thread: a disk may take seconds for it."""

import threading
from pathlib import Path
from types import TracebackType
from typing import Self

from shiplog.files import is_device, sync_file

SYNC_SECS = 2.0


class DiskSync:
    """Forces what is written to a file to the disk, every few seconds within a block.

    Reception and writing go on meanwhile. A power failure then loses what was written since the
    last synchronisation, instead of what the system has kept in memory for up to half a minute.

    Parameters
    ----------
    path
        The file; a device is not synchronised.
    every_secs
        The interval, s.
    """

    def __init__(self, path: Path, every_secs: float) -> None:
        self._path, self._every_secs = path, every_secs
        self._stop = threading.Event()
        self._error: OSError | None = None
        self._thread = threading.Thread(target=self._run, name=f"sync of {path.name}", daemon=True)

    def __enter__(self) -> Self:
        if not is_device(self._path):
            self._thread.start()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def check(self) -> None:
        """Raise the OSError of a synchronisation that has failed: the disk is full or gone."""
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while self._error is None and not self._stop.wait(self._every_secs):
            try:
                sync_file(self._path)
            except OSError as error:
                self._error = error
