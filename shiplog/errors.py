"""Exceptions and warnings that a user's files, requests or disks can cause.

Each message is one line that names the object, the place and the remedy, the path last. Only the
command line catches them.
"""


class ShiplogError(Exception):
    """A file or a request that cannot be used as it is (exit code 1)."""


class UsageError(ShiplogError):
    """A wrong request, such as an unknown name or a number out of range (exit code 2)."""


class LogError(ShiplogError):
    """A log that cannot be read, or that does not hold the requested data."""


class VesselError(ShiplogError):
    """A vessel file with errors; the message lists all of them."""


class LayoutError(ShiplogError):
    """A layout file with errors, or a table that does not match its layout."""


class SystemFileError(ShiplogError):
    """A system file with errors; the message lists all of them."""


class CacheWarning(UserWarning):
    """The cache of compiled loops cannot be used; results are the same, and take longer."""
