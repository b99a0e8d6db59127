"""Addresses of devices with a bit rate, such as ``slcan:///dev/ttyACM0?bitrate=250000``."""

from urllib.parse import parse_qsl, urlsplit

from recorders.transports.serial_line import is_bit_rate


def parse_device_address(address: str, option: str) -> tuple[str, int | None]:
    """Return the device of an address, and its bit rate; None where it states none.

    Parameters
    ----------
    address
        The address.
    option
        The name of the bit rate, the only option that is possible.

    Raises
    ------
    ValueError
        The address has errors.

    Examples
    --------
    >>> parse_device_address("ngt1:///dev/ttyUSB0?baud=230400", "baud")
    ('/dev/ttyUSB0', 230400)
    """
    parts = urlsplit(address)
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    rate, device = options.pop(option, None), parts.netloc + parts.path
    if not device or options or (rate is not None and not is_bit_rate(rate)):
        raise ValueError(address)
    return device, None if rate is None else int(rate)
