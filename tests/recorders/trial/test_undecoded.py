"""Cause for which no sample could be decoded: a wrong format is not a device without sensors."""

from collections.abc import Mapping

import pytest

from recorders.streams.counts import StreamCounts
from recorders.trial.undecoded import why_undecoded


@pytest.mark.parametrize(
    ("unused", "rejected", "cause"),
    [
        ({}, {}, "nothing was received; check the address"),
        (
            {},
            {"no sentence": 90, "wrong checksum": 10},
            "100 of 100 packets cannot be read (most: no sentence); the format is another one",
        ),
        (
            {"GPGSV": 30, "GPGSA": 60},
            {"wrong checksum": 1},
            "all 90 packets read are of kinds that are not used (GPGSA, GPGSV); let the device",
        ),
        ({f"P{n}": 10 - n for n in range(9)}, {}, "(P0, P1, P2, P3, ...)"),
    ],
)
def test_unreadable_and_unused_packets_have_different_causes(
    unused: Mapping[str, int], rejected: Mapping[str, int], cause: str
) -> None:
    counts = StreamCounts()
    for kind, packets in unused.items():
        counts.skip(kind, packets)
    for reason, packets in rejected.items():
        counts.reject(reason, packets)
    assert cause in why_undecoded(counts)
