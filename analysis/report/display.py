"""Names and units in which disturbances are shown, and the width of every band."""

from math import degrees

BAND_STDS = 2.0  # standard deviations of every band and every ± that is shown

# the name of a disturbance, the unit in which it is shown, and the factor from SI to that unit
DISTURBANCES = {
    "rudder": ("yaw, as rudder angle", "deg", degrees(1)),
    "yaw": ("yaw", "10⁻⁶ deg/s³", degrees(1) * 1e6),
    "yaw_wave": ("yaw, wave", "10⁻⁶ deg/s³", degrees(1) * 1e6),
    "surge": ("surge", "mm/s²", 1e3),
    "surge_wave": ("surge, wave", "mm/s²", 1e3),
}
