"""A source to a file: the one loop that every recorder runs in."""

import os
from collections.abc import Callable

from shiplog.files import replacing
from shiplog.writer import LogWriter

from .source import Source


def record(
    source: Source,
    path: str | os.PathLike[str],
    *,
    on_slab: Callable[[int], None] = lambda _: None,
) -> int:
    """Write all that `source` yields to `path`; return the number of samples.

    `on_slab` is told the samples written so far. Ctrl-C ends the recording, not the log: what was
    received until then is a finished file. After any other error nothing stands under `path`.
    """
    count = 0
    with (
        replacing(path) as part,
        LogWriter(part, metadata=source.metadata, vessel_toml=source.vessel_toml) as writer,
    ):
        try:
            for slab in source.slabs():
                writer.write(*slab)
                writer.flush()
                count += sum(map(len, slab))
                on_slab(count)
        except KeyboardInterrupt:
            pass
    return count
