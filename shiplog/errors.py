"""The errors a user can meet; each message names the thing and the remedy, the path last."""


class ShiplogError(Exception):
    """Something in the user's files or request cannot be used as it is (exit code 1)."""


class UsageError(ShiplogError):
    """The request itself is wrong: an unknown name, a number out of range (exit code 2)."""


class LogError(ShiplogError):
    """A log that cannot be read, or that does not hold what was asked of it."""


class VesselError(ShiplogError):
    """A vessel file with faults; the message lists all of them."""


class LayoutError(ShiplogError):
    """A table's layout file with faults, or a table that does not fit its layout."""
