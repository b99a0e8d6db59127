"""Tables of what was received: packets by stream and kind, and why packets were rejected."""

from collections.abc import Iterable

from recorders.streams.stream_source import StreamSource
from shiplog.text_table import TextTable

MAX_ROWS = 40  # of one table; kinds come from the wire


def stream_tables(streams: Iterable[StreamSource]) -> list[TextTable]:
    """Return the tables of a recording's streams; those without rows are omitted."""
    listed = list(streams)
    kinds = TextTable(
        "Packets by kind",
        ("stream", "kind", "decoded", "per s", "marked\ninvalid", "not used"),
        _bounded(
            [
                (
                    stream.name,
                    kind,
                    str(counts.accepted.get(kind, 0)),
                    _rate(counts.accepted.get(kind, 0), stream.duration_secs),
                    str(counts.flagged.get(kind, 0)),
                    str(counts.unused.get(kind, 0)),
                )
                for stream in listed
                for counts in [stream.decoder.counts]
                for kind in sorted({*counts.accepted, *counts.unused})
            ]
        ),
    )
    rejected = TextTable(
        "Rejected packets",
        ("stream", "reason", "packets"),
        _bounded(
            [
                (stream.name, reason, str(count))
                for stream in listed
                for reason, count in sorted(stream.decoder.counts.rejected.items())
            ]
        ),
    )
    return [table for table in (kinds, rejected) if table.rows]


def _rate(packets: int, secs: float) -> str:
    return f"{packets / secs:.3g}" if packets and secs > 0 else ""


def _bounded(rows: list[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Return the first rows, and one that states how many more there are."""
    if len(rows) <= MAX_ROWS:
        return tuple(rows)
    more = ("", f"and {len(rows) - MAX_ROWS} more", *[""] * (len(rows[0]) - 2))
    return (*rows[:MAX_ROWS], more)
