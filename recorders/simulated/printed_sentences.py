"""A simulated trial as the NMEA 0183 sentences that a ship's instruments would send."""

from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from functools import reduce
from heapq import merge
from math import atan2, degrees, hypot
from operator import xor

import numpy as np

from shiplog.geodesy.local_frame import LocalFrame
from shiplog.geodesy.positions import LocalPositions
from shiplog.types import Channel
from shiplog.units import conversion_factor

from .simulate import SimulatedTrial

DATUM = 59.5, 24.25  # deg: in the Gulf of Finland
RATES = {"yaw_rate": 4.0, "speed": 1.0, "rudder": 2.0, "rpm": 1.0, "heading": 2.0, "position": 1.0}
"""Rates of such instruments, Hz, by the channel of the simulated sensor."""

_KNOT = conversion_factor("kn", "m/s")
_KMH = conversion_factor("km/h", "m/s")
_TURN = conversion_factor("deg/min", "rad/s")
_Line = tuple[int, str]


def printed_sentences(trial: SimulatedTrial) -> Iterator[_Line]:
    """Yield the times of reception (ns) and sentences of a trial, without line ends.

    A gyro (``HEHDT``), a rate-of-turn sensor (``TIROT``), a log (``VDVHW``), a rudder sensor
    (``AGRSA``), a shaft tachometer (``RCRPM``), and a GNSS receiver (``GPGGA``, ``GPRMC``,
    ``GPZDA``).

    Parameters
    ----------
    trial
        A trial with sensors of all these quantities.
    """
    channels = {channel.name: channel for channel in trial.channels}
    streams = [
        _each(channels["yaw_rate"], lambda v: f"TIROT,{v / _TURN:.1f},A"),
        _each(channels["rudder"], lambda v: f"AGRSA,{degrees(v):.1f},A,,V"),
        _each(channels["rpm"], lambda v: f"RCRPM,S,0,{v:.1f},,A"),
        _each(channels["speed"], lambda v: f"VDVHW,,T,,M,{v / _KNOT:.2f},N,{v / _KMH:.2f},K"),
        _each(channels["heading"], lambda v: f"HEHDT,{degrees(v) % 360:.2f},T"),
        iter(_fixes(channels["position"])),
    ]
    for received_ns, body in merge(*streams, key=lambda line: line[0]):
        yield received_ns, f"${body}*{reduce(xor, body.encode()):02X}"


def _each(channel: Channel, body: Callable[[float], str]) -> Iterator[_Line]:
    for time_ns, value in zip(channel.received_ns.tolist(), channel.values.tolist(), strict=True):
        yield time_ns, body(value)


def _fixes(channel: Channel) -> Sequence[_Line]:
    """Return the sentences of the receiver, one burst for each fix, with its own time."""
    north, east = channel.values.T
    fixes = LocalFrame(DATUM, geographic=True).to_geographic(LocalPositions(north, east))
    secs = channel.measured_ns * 1e-9
    velocities = np.column_stack([np.gradient(north, secs), np.gradient(east, secs)]).tolist()
    lines = []
    for i, (north_speed, east_speed) in enumerate(velocities):
        time = datetime.fromtimestamp(round(secs[i], 2), UTC)
        clock = f"{time:%H%M%S}.{time.microsecond // 10_000:02d}"
        latitude = _degrees_minutes(float(fixes.latitude[i]), 2, "NS")
        longitude = _degrees_minutes(float(fixes.longitude[i]), 3, "EW")
        place = f"{latitude},{longitude}"
        course = degrees(atan2(east_speed, north_speed)) % 360
        speed = hypot(north_speed, east_speed) / _KNOT
        bodies = (
            f"GPGGA,{clock},{place},1,12,0.7,25.0,M,18.0,M,,",
            f"GPRMC,{clock},A,{place},{speed:.2f},{course:.2f},{time:%d%m%y},,,A",
            f"GPZDA,{clock},{time:%d,%m,%Y},00,00",
        )
        lines += [(int(channel.received_ns[i]), body) for body in bodies]
    return lines


def _degrees_minutes(angle_deg: float, digits: int, hemispheres: str) -> str:
    """Return an angle as ``ddmm.mmmmm,N`` with `digits` digits of degrees."""
    whole, rest = divmod(round(abs(angle_deg) * 60e5), 60 * 10**5)
    return f"{whole:0{digits}d}{rest / 1e5:08.5f},{hemispheres[angle_deg < 0]}"
