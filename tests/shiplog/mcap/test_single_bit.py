"""A wrong bit is located wherever it is."""

import zlib

import numpy as np
import pytest

from shiplog.mcap.single_bit import wrong_bit


@pytest.mark.parametrize("size", [1, 2, 7, 300, 30_000])
def test_an_inverted_bit_is_located(size: int) -> None:
    rng = np.random.default_rng(size)
    data = bytearray(rng.bytes(size))
    recorded = zlib.crc32(data)
    for bit in {0, 8 * size - 1, *rng.integers(0, 8 * size, 20).tolist()}:
        data[bit // 8] ^= 1 << bit % 8
        assert wrong_bit(recorded ^ zlib.crc32(data), size) == (bit // 8, 1 << bit % 8)
        data[bit // 8] ^= 1 << bit % 8


def test_several_wrong_bits_are_not_taken_for_one() -> None:
    data = bytes(1000)
    for bits in (0b11, 0b101, 0xFF):
        changed = data[:500] + bytes([bits]) + data[501:]
        assert wrong_bit(zlib.crc32(data) ^ zlib.crc32(changed), 1000) is None


def test_equal_checksums_have_no_wrong_bit() -> None:
    assert wrong_bit(0, 1000) is None
