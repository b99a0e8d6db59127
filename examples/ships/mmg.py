"""Ships by the MMG standard method: the tanker KVLCC2 and the training ship Seiun Maru.

H. Yasukawa and Y. Yoshimura, "Introduction of MMG standard method for ship maneuvering
predictions", Journal of Marine Science and Technology 20, 2015: equations (4) to (34), and the
KVLCC2 in its Tables 1 to 3. The propeller astern: K. Hasegawa and T. Kitera, "Mathematical model of
manoeuvrability at low advance velocity and its application to berthing control", 1993, with the
coefficients of the Esso Osaka, as a model of any tanker's propeller; the rudder is then in the
wake without a jet. Y. Yoshimura and Y. Masumoto, "Hydrodynamic database and manoeuvring
prediction method with medium high-speed merchant ships and fishing vessels", MARSIM 2012: the
Seiun Maru.
"""

from dataclasses import dataclass
from math import atan2, cos, exp, hypot, pi, sin, sqrt

DENSITY = 1025.0
# astern, by Js = u / (n D): thrust C6 + C7 Js, beyond C10 it is C3; side force and moment
# A1 + A2 Js and B1 + B2 Js within -0.35 to -0.06, A3 + A4 Js beyond, A5 and B5 below
C3, C6, C7, C10 = -0.251, -0.175, 0.330, -0.233
ASTERN_FORCE = (-7.90e-5, 7.99e-3, -4.93e-3, -5.87e-3, -5.58e-4)
ASTERN_MOMENT = (3.5e-5, -3.17e-3, 1.96e-3, 2.33e-3, 2.25e-4)
ASTERN_RANGE = (-0.35, -0.06)


@dataclass(frozen=True)
class MmgShip:
    """A ship of the MMG standard method; derivatives are nondimensional by ½ρL d U² and L."""

    length: float
    draught: float
    displacement: float  # m³
    centre: float  # of gravity ahead of midship, m
    added: tuple[float, float, float]  # m'x, m'y, J'z
    x: dict[str, float]
    y: dict[str, float]
    n: dict[str, float]
    propeller: float  # diameter, m
    open_water: tuple[float, float, float]  # KT = k0 + k1 J + k2 J²
    thrust_deduction: float
    wake: float
    wake_change: tuple[float, float, float, float]  # C1, C2 for β >= 0 and below, x'P
    rudder_area: float
    rudder_slope: float  # fα
    rudder_interaction: tuple[float, float, float]  # tR, aH, x'H
    rudder_flow: tuple[float, float, float]  # ε, κ, η
    straightening: tuple[float, float, float]  # γR for β < 0 and above, l'R
    speed: float
    rpm: float
    rudder_rate_deg: float

    def rates(self, motion: tuple[float, ...], rudder: float, rpm: float) -> tuple[float, ...]:
        """Return the rates of speed ahead, sway (m/s²) and yaw rate (rad/s²) of midship."""
        u, v, r = motion
        speed = max(hypot(u, v), 0.05)
        area = self.length * self.draught
        pressure = 0.5 * DENSITY * area * speed**2
        vp, rp = v / speed, r * self.length / speed
        drift = atan2(-v, u)
        thrust, slip = self._thrust(u, drift, rp, rpm)
        astern = self._astern(u, rpm)
        fx, fy, fn = self._rudder(speed, drift, rp, rudder, slip)
        x, y, n = self.x, self.y, self.n
        surge = -x["0"] + x["vv"] * vp**2 + x["vr"] * vp * rp + x["rr"] * rp**2 + x["vvvv"] * vp**4
        sway, yaw = (
            c["v"] * vp + c["r"] * rp + c["vvv"] * vp**3 + c["vvr"] * vp**2 * rp
            + c["vrr"] * vp * rp**2 + c["rrr"] * rp**3
            for c in (y, n)
        )  # fmt: skip
        return self._accelerations(
            motion,
            pressure * surge + (1 - self.thrust_deduction) * thrust + astern[0] + fx,
            pressure * sway + astern[1] + fy,
            pressure * self.length * yaw + astern[2] + fn,
        )

    def _thrust(self, u: float, drift: float, rp: float, rpm: float) -> tuple[float, float]:
        """Return the thrust, N, and the speed behind the propeller, m/s, over the inflow's."""
        c1, ahead, behind, xp = self.wake_change
        at_propeller = drift - xp * rp
        c2 = ahead if at_propeller >= 0 else behind
        inflow = u * (1 - self.wake) * (1 + (1 - exp(-c1 * abs(at_propeller))) * (c2 - 1))
        turns = rpm / 60.0
        if turns <= 0 or u <= 0:  # outside the polynomial
            return 0.0, max(u, 0.0) * self.rudder_flow[0] * (1 - self.wake)
        advance = inflow / (turns * self.propeller)
        k0, k1, k2 = self.open_water
        coefficient = k0 + k1 * advance + k2 * advance**2
        thrust = DENSITY * turns**2 * self.propeller**4 * coefficient
        epsilon, kappa, eta = self.rudder_flow
        jet = 1 + kappa * (sqrt(max(0.0, 1 + 8 * coefficient / (pi * advance**2))) - 1)
        return thrust, epsilon * inflow * sqrt(eta * jet**2 + 1 - eta)

    def _astern(self, u: float, rpm: float) -> tuple[float, float, float]:
        """Return the forces of the propeller astern, N and Nm; zero where it turns ahead."""
        if rpm >= 0:
            return 0.0, 0.0, 0.0
        tip = rpm / 60.0 * self.propeller
        js = u / tip
        thrust = C6 + C7 * js if js >= C10 else C3

        def lateral(c: tuple[float, float, float, float, float]) -> float:
            if js > ASTERN_RANGE[1]:
                return c[4]
            return c[0] + c[1] * js if js >= ASTERN_RANGE[0] else c[2] + c[3] * js

        side = 0.5 * DENSITY * self.length * self.draught * tip**2
        return (
            DENSITY * tip**2 * self.propeller**2 * thrust,
            side * lateral(ASTERN_FORCE),
            side * self.length * lateral(ASTERN_MOMENT),
        )

    def _rudder(
        self, speed: float, drift: float, rp: float, rudder: float, flow: float
    ) -> tuple[float, float, float]:
        """Return the rudder's forces ahead and to starboard, N, and its moment, Nm."""
        low, high, lever = self.straightening
        at_rudder = drift - lever * rp
        across = speed * (low if at_rudder < 0 else high) * at_rudder
        angle = rudder - atan2(across, flow)
        normal = (
            0.5 * DENSITY * self.rudder_area * (flow**2 + across**2)
            * self.rudder_slope * sin(angle)
        )  # fmt: skip
        deduction, increase, point = self.rudder_interaction
        arm = (-0.5 + increase * point) * self.length
        return (
            -(1 - deduction) * normal * sin(rudder),
            -(1 + increase) * normal * cos(rudder),
            -arm * normal * cos(rudder),
        )

    def _accelerations(
        self, motion: tuple[float, ...], x: float, y: float, n: float
    ) -> tuple[float, float, float]:
        u, v, r = motion
        unit = 0.5 * DENSITY * self.length**2 * self.draught
        mass = DENSITY * self.displacement
        mx, my = (unit * added for added in self.added[:2])
        jz = unit * self.length**2 * self.added[2]
        inertia = mass * (0.25 * self.length) ** 2 + self.centre**2 * mass + jz
        arm = self.centre * mass
        surge = (x + (mass + my) * v * r + arm * r**2) / (mass + mx)
        sway_force = y - (mass + mx) * u * r
        moment = n - arm * u * r
        determinant = (mass + my) * inertia - arm**2
        sway = (inertia * sway_force - arm * moment) / determinant
        yaw = ((mass + my) * moment - arm * sway_force) / determinant
        return surge, sway, yaw


KVLCC2 = MmgShip(
    length=320.0, draught=20.8, displacement=312_600.0, centre=11.2, added=(0.022, 0.223, 0.011),
    x={"0": 0.022, "vv": -0.040, "vr": 0.002, "rr": 0.011, "vvvv": 0.771},
    y={"v": -0.315, "r": 0.083, "vvv": -1.607, "vvr": 0.379, "vrr": -0.391, "rrr": 0.008},
    n={"v": -0.137, "r": -0.049, "vvv": -0.030, "vvr": -0.294, "vrr": 0.055, "rrr": -0.013},
    propeller=9.86, open_water=(0.2931, -0.2753, -0.1359), thrust_deduction=0.220, wake=0.35,
    wake_change=(2.0, 1.6, 1.1, -0.48), rudder_area=112.5, rudder_slope=2.747,
    rudder_interaction=(0.387, 0.312, -0.464), rudder_flow=(1.09, 0.50, 0.626),
    straightening=(0.395, 0.640, -0.710), speed=7.97, rpm=108.0, rudder_rate_deg=2.34,
)  # fmt: skip

SEIUN_MARU = MmgShip(
    length=105.0, draught=5.966, displacement=5702.0, centre=-2.249, added=(0.0167, 0.1576, 0.009),
    x={"0": 0.016, "vv": -0.0804, "vr": 0.072, "rr": 0.022, "vvvv": 0.439},
    y={"v": -0.317, "r": 0.052, "vvv": -1.604, "vvr": -0.75, "vrr": -0.8599, "rrr": -0.051},
    n={"v": -0.1136, "r": -0.0795, "vvv": -0.3095, "vvr": -0.6257, "vrr": -0.3143, "rrr": -0.0502},
    propeller=4.7, open_water=(0.4, -0.4, 0.0), thrust_deduction=0.21, wake=0.204,
    wake_change=(0.0, 1.0, 1.0, -0.5), rudder_area=13.405, rudder_slope=2.88,
    rudder_interaction=(0.341, 0.236, -0.4), rudder_flow=(1.033, 0.676, 0.960),
    straightening=(0.312, 0.394, -0.947), speed=8.64, rpm=150.0, rudder_rate_deg=3.0,
)  # fmt: skip
