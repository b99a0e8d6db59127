"""Names, units and digits of what is shown, and the width of every band."""

from math import degrees, floor, inf, isfinite, log10

NORMAL_95 = 1.96  # standard deviations: 95 % of a normal distribution lie within
MAX_DECIMALS = 9
NOT_KNOWN = "–"
DIGITS = 3  # significant ones, of a number without uncertainty
BAND_STDS = 2.0  # standard deviations of every band and every ± that is shown

# the name of a disturbance, the unit in which it is shown, and the factor from SI to that unit
DISTURBANCES = {
    "rudder": ("yaw, as rudder angle", "deg", degrees(1)),
    "yaw": ("yaw", "10⁻⁶ deg/s³", degrees(1) * 1e6),
    "yaw_wave": ("yaw, wave", "10⁻⁶ deg/s³", degrees(1) * 1e6),
    "surge": ("surge", "mm/s²", 1e3),
    "surge_wave": ("surge, wave", "mm/s²", 1e3),
    "yaw_wind": ("yaw, wind", "10⁻⁶ deg/s³", degrees(1) * 1e6),
    "surge_wind": ("surge, wind", "mm/s²", 1e3),
}


def decimals(std: float) -> int:
    """Return the number of decimals that shows two digits of a standard deviation.

    Examples
    --------
    >>> decimals(0.00321), decimals(12.0)
    (4, 0)
    """
    return min(max(1 - floor(log10(std)), 0), MAX_DECIMALS) if 0 < std < inf else MAX_DECIMALS


def number_text(value: float, std: float, most: int = 6) -> str:
    """Write a number with the digits that its standard uncertainty allows.

    Parameters
    ----------
    value
        NaN gives a dash.
    std
        In the same unit; where NaN or 0, three significant digits are written.
    most
        The greatest number of decimals.

    Examples
    --------
    >>> number_text(999.273, 8.1), number_text(15.114, float("nan")), number_text(-1e-9, 0.1)
    ('999.3', '15.1', '0.00')
    """
    if not isfinite(value):
        return NOT_KNOWN
    if isfinite(std) and std > 0:
        return f"{value:z.{min(decimals(std), most)}f}"
    if value == 0:
        return "0"
    return f"{value:z.{min(max(DIGITS - 1 - floor(log10(abs(value))), 0), most)}f}"
