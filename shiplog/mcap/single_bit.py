"""Location of a single wrong bit by a CRC-32.

The CRC-32 is linear: the difference of the checksums of two files of one length depends only on the
bits in which they differ. For a single bit that is followed by k others it is x^(32 + k) modulo the
polynomial of the checksum. That polynomial is primitive, so that k follows from the difference for
files of up to 512 MiB, by baby steps and giant steps.

References
----------
D. Shanks, Class number, a theory of factorization, and genera, Proc. Symp. Pure Math. 20, 1971.
"""

from math import isqrt

_POLYNOMIAL = 0xEDB88320  # x^32 modulo it, with the coefficient of x^31 in the lowest bit
_ONE = 0x80000000
_MAX_BYTES = (1 << 29) - 8  # beyond, several bits have the same difference


def wrong_bit(difference: int, size: int) -> tuple[int, int] | None:
    r"""Locate the single wrong bit of some bytes.

    Parameters
    ----------
    difference
        The exclusive or of the recorded and the computed CRC-32.
    size
        The number of bytes that the checksum covers.

    Returns
    -------
    offset, mask
        The byte and the bit in it. None if no single bit has this difference.

    Examples
    --------
    >>> import zlib
    >>> data = bytes(1000)
    >>> changed = data[:700] + b"\x10" + data[701:]
    >>> wrong_bit(zlib.crc32(data) ^ zlib.crc32(changed), 1000)
    (700, 16)
    """
    if not 0 < size <= _MAX_BYTES or not difference:
        return None
    bits = 8 * size
    steps = isqrt(bits) + 1
    baby: dict[int, int] = {}
    value = difference
    for step in range(steps):
        baby.setdefault(value, step)
        value = _times_x(value)
    giant, value = _power_of_x(steps), _POLYNOMIAL
    for multiple in range(steps + 1):
        following = multiple * steps - baby.get(value, -1)
        if value in baby and 0 <= following < bits:
            offset, bit = divmod(bits - 1 - following, 8)
            return offset, 1 << bit
        value = _product(value, giant)
    return None


def _times_x(value: int) -> int:
    return value >> 1 ^ (_POLYNOMIAL if value & 1 else 0)


def _product(a: int, b: int) -> int:
    """Return the product of two polynomials modulo that of the checksum."""
    product = 0
    while b:
        if b & _ONE:
            product ^= a
        a, b = _times_x(a), b << 1 & 0xFFFFFFFF
    return product


def _power_of_x(exponent: int) -> int:
    power, base = _ONE, _ONE >> 1
    while exponent:
        if exponent & 1:
            power = _product(power, base)
        base, exponent = _product(base, base), exponent >> 1
    return power
