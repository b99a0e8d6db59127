"""Cause for which no sample could be decoded from a stream, with its remedy."""

from recorders.streams.counts import StreamCounts

_MAX_NAMED = 4  # kinds of packets


def why_undecoded(counts: StreamCounts) -> str:
    """Return why a stream without any decoded packet has none, and what to do.

    Parameters
    ----------
    counts
        What was received.

    Examples
    --------
    >>> counts = StreamCounts()
    >>> counts.skip("GPGSV", 3)
    >>> why_undecoded(counts)
    'all 3 packets read are of kinds that are not used (GPGSV); let the device send others'
    """
    unused, rejected = sum(counts.unused.values()), sum(counts.rejected.values())
    if not unused and not rejected:
        return "nothing was received; check the address, the cable and the device"
    if rejected > unused:
        most = max(counts.rejected, key=lambda reason: counts.rejected[reason])
        return (
            f"{rejected} of {rejected + unused} packets cannot be read (most: {most}); the format "
            "is another one, or its options are: without a format `shiplog record` detects it, "
            "except csv-lines"
        )
    named = ", ".join(sorted(counts.unused, key=lambda kind: -counts.unused[kind])[:_MAX_NAMED])
    more = ", ..." if len(counts.unused) > _MAX_NAMED else ""
    return (
        f"all {unused} packets read are of kinds that are not used ({named}{more}); let the device "
        "send others"
    )
