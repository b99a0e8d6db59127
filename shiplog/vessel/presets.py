"""Vessel files that come with shiplog, as texts: the ship of the identification paper.

`table1` reads the angles of the paper's Table 1 in degrees, `table1-rad` in radians. The same files
are in `sample_data/vessels`. A log carries its vessel file, so that a change of these texts would
change recorded logs.
"""

from math import pi

_PAPER = """\
name = "{name}"
angle_unit = "{angle_unit}"     # of c2, c3, f and the rudder
approach_rpm = 80.0

[yaw]                    # Burylin's Table 1
T1 = 150.0               # s
T2 = 50.0                # s
T3 = 0.5                 # s
c2 = 10.0
c3 = 20.0

[rudder]
alpha1 = 0.0171          # s/m
alpha2 = 0.0015          # 1/rpm
alpha3 = 0.0654          # s/m
max = {rudder_max}
rate = {rudder_rate}

[surge]
f = -0.1
g = -0.0003
h = 0.0004

[filter]
process_ratio = 2.5e-5   # the paper's Q = 0.01 over its R = 400
"""

PRESETS = {
    "table1": _PAPER.format(
        name="Burylin's Table 1, angles in degrees",
        angle_unit="deg",
        rudder_max="35.0",
        rudder_rate="2.5",
    ),
    "table1-rad": _PAPER.format(
        name="Burylin's Table 1, angles in radians",
        angle_unit="rad",
        rudder_max=repr(35 * pi / 180),
        rudder_rate=repr(2.5 * pi / 180),
    ),
}
