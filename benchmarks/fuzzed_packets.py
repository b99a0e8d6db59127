"""Packets with random errors, for every format of streams: valid ones, and ones distorted.

Each generator makes packets of which about a half are changed in some bytes or cut. The others are
valid in form, but have random fields, names, addresses and message numbers from everywhere: floods
of new kinds, talkers and sources.
"""

import json
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from operator import xor
from pathlib import Path
from random import Random

from recorders.nmea0183.framing import DATAGRAM_HEADER, split_packet
from recorders.streams.packets import MAX_PACKET_BYTES, packet_lines

LAYOUT = Path(__file__).parents[1] / "sample_data" / "layouts" / "weather_lines.toml"

BODIES = (
    "TIROT,-6.0,A",
    "AGRSA,1.26,A,,V",
    "ECRPM,E,2,1500.0,50,A",
    "VWVHW,205.5,T,203.0,M,6.11,N,11.31,K",
    "VDVBW,12.3,-0.5,A,12.0,-0.9,A,,V,,V",
    "HETHS,77.52,A",
    "HCHDG,359.80,1.0,W,0.55,E",
    "INGGA,000000.16,2200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,",
    "GPGLL,6005.071,N,02332.346,E,095559,A,D",
    "INRMC,000000.16,A,2200.110899,S,01756.359432,W,9.1,215.11,010814,24.7,W,A",
    "GNGNS,014035.00,4332.69262,S,17235.48549,E,RR,13,0.9,25.63,11.24,,",
    "INVTG,215.11,T,239.79,M,9.1,N,16.9,K,A",
    "INZDA,000000.17,01,08,2014,,",
    "IIMWV,142.0,R,006.1,N,A",
    "IIVWR,039,L,08.10,N,04.17,M,,",
    "SDDPT,10.0,1.5,100",
    "YXXDR,A,0.19,D,Pitch,A,-0.34,D,Roll",
    "PSXN,23,0.35,-1.74,218.26,0.58",
    "AGHTD,V,5.0,R,M,,,,,,,,T,A,A,A,1",
)
"""One sentence of each kind, without start and checksum."""

_FIELDS = ("", "-", "9" * 40, "1e308", "nan", "\x7f", "A", "V", "é", "$", "0x1", "\x1b[2J", "1_0")
_PGNS = (126992, 127245, 127250, 127251, 127257, 127488, 128259, 128267, 129025, 129026, 130306)
_FIX_PGN = 129029  # a fast packet
_PATHS = (
    "navigation.headingTrue",
    "navigation.position",
    "navigation.datetime",
    "navigation.attitude",
    "steering.rudderAngle",
    "propulsion.port.revolutions",
)
_JSON_VALUES: tuple[object, ...] = (
    *(None, 1.5, -7, 1e308, 10**400, True, "x", "2026-11-29T08:00:00Z", [], {}),
    *({"roll": 0.1, "pitch": "x"}, {"latitude": 54.0, "longitude": 10.0}),
    *({"latitude": 91, "longitude": 10}, {"latitude": "\ud800", "longitude": 1}),
)


def distorted(packet: bytes, rng: Random) -> bytes:
    """Return a packet, in half of the cases with bytes changed and the end cut."""
    if not packet or rng.random() < 0.5:
        return packet
    changed = bytearray(packet)
    for _ in range(rng.randrange(1, 4)):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    if rng.random() < 0.005:
        changed = changed * (1 + MAX_PACKET_BYTES // len(changed))
        return bytes(changed[:MAX_PACKET_BYTES])
    return bytes(changed[: rng.randrange(len(changed) + 1)])


# ---- NMEA 0183


def sentence_packet(rng: Random) -> bytes:
    """Return a sentence with its checksum, at times in a datagram, of any talker or any kind."""
    fields = rng.choice(BODIES).split(",")
    for _ in range(rng.randrange(3)):
        fields[rng.randrange(1, len(fields))] = rng.choice(_FIELDS)
    if rng.random() < 0.2:
        letters = "".join(rng.choices("ABCDEFGHIJKLMNOPQRSTUVWXYZ", k=5))
        fields[0] = letters[:2] + fields[0][2:] if rng.random() < 0.5 else letters
    body = ",".join(fields).encode()
    line = b"$%b*%02X" % (body, reduce(xor, body, 0))
    if rng.random() < 0.2:
        tag = b"s:G%04d,n:%d" % (rng.randrange(10_000), rng.randrange(1, 1000))
        line = b"%b\\%b*%02X\\%b\r\n" % (DATAGRAM_HEADER, tag, reduce(xor, tag, 0), line)
    return line


# ---- NMEA 2000


@dataclass(frozen=True)
class BusMessage:
    """A frame or message of a CAN bus."""

    pgn: int
    source: int
    data: bytes
    secs: float

    @property
    def identifier(self) -> int:
        """The 29-bit identifier of its frames, sent to all."""
        return 2 << 26 | self.pgn << 8 | self.source


def bus_message(rng: Random, *, assembled: bool) -> BusMessage:
    """Return a message with random data: of a known PGN, of any, or a frame of a fast packet."""
    kind, source = rng.random(), rng.randrange(256) if rng.random() < 0.2 else rng.randrange(4)
    secs = rng.random() * 50_000
    if kind < 0.1:
        return BusMessage(rng.randrange(1 << 17), source, rng.randbytes(rng.randrange(9)), secs)
    if kind < 0.6:
        return BusMessage(rng.choice(_PGNS), source, rng.randbytes(8), secs)
    if assembled:
        return BusMessage(_FIX_PGN, source, rng.randbytes(rng.choice((8, 43, 51, 223))), secs)
    number = rng.randrange(7) if rng.random() < 0.9 else rng.randrange(32)
    first = rng.randrange(8) << 5 | number
    length = rng.choice((7, 13, 43)) if rng.random() < 0.9 else rng.randrange(256)
    return BusMessage(_FIX_PGN, source, bytes((first, length)) + rng.randbytes(6), secs)


def _clock(secs: float, separator: str) -> str:
    return separator.join((f"{int(secs) // 3600:02d}", f"{int(secs) // 60 % 60:02d}",
                           f"{secs % 60:06.3f}"))  # fmt: skip


def _canboat(m: BusMessage) -> str:
    stamp = f"2026-11-29T{_clock(m.secs, ':')}Z"
    data = "".join(f",{byte:02x}" for byte in m.data)
    return f"{stamp},2,{m.pgn},{m.source},255,{len(m.data)}{data}"


def _candump(m: BusMessage) -> str:
    return f"({1.7e9 + m.secs:.6f}) can0 {m.identifier:08X}#{m.data.hex().upper()}"


def _candump_elapsed(m: BusMessage) -> str:
    return f" ({m.secs:.6f})  can0  {m.identifier:08X}   [{len(m.data)}]  {m.data.hex(' ')}"


def _yacht_devices(m: BusMessage) -> str:
    return f"{_clock(m.secs, ':')} R {m.identifier:08X} {m.data.hex(' ')}"


def _actisense(m: BusMessage) -> str:
    return f"A{_clock(m.secs, '')} {m.source:02X}FF2 {m.pgn:05X} {m.data.hex().upper()}"


def _ikonvert(m: BusMessage) -> str:
    return f"!PDGY,{m.pgn},2,{m.source},255,{m.secs:.3f},{b64encode(m.data).decode()}"


def _can_frame(m: BusMessage) -> str:
    return f"can {m.identifier:08X}#{m.data.hex().upper()}"


def fast_frames(rng: Random, secs: float = 0.0) -> list[BusMessage]:
    """Return the frames of a whole fast packet."""
    number, source = rng.randrange(8) << 5, rng.randrange(256)
    length = rng.choice((43, 51, 223))
    frames = [bytes((number, length)) + rng.randbytes(6)]
    frames += [bytes((number + n,)) + rng.randbytes(7) for n in range(1, 1 + length // 7)]
    return [BusMessage(_FIX_PGN, source, frame, secs) for frame in frames]


def _of_bus(line: Callable[[BusMessage], str], *, assembled: bool) -> Callable[[Random], bytes]:
    """Return a generator of packets of a line, at times of several or none."""

    def packet(rng: Random) -> bytes:
        kind = rng.random()
        if kind < 0.02 and not assembled:
            messages = fast_frames(rng)
        else:
            count = 1 if kind < 0.95 else rng.randrange(4)
            messages = [bus_message(rng, assembled=assembled) for _ in range(count)]
        return "\n".join(map(line, messages)).encode()

    return packet


# ---- Signal K, and lines of values


def delta_packet(rng: Random) -> bytes:
    """Return a delta, a greeting, or another JSON text, with random paths, sources and values."""
    kind = rng.random()
    if kind < 0.02:
        return json.dumps({"self": f"urn:mrn:imo:mmsi:{rng.randrange(10**9)}"}).encode()
    if kind < 0.06:
        value: object = rng.choice((*_JSON_VALUES, {"updates": rng.choice(_JSON_VALUES)}, [[[]]]))
        return json.dumps(value).encode() + rng.choice((b"", b"[" * 3000, b"\n", b"\n{}"))
    delta = {"updates": [_update(rng) for _ in range(rng.randrange(3))]}
    if rng.random() < 0.1:
        delta["context"] = rng.choice(
            ("vessels.self", f"vessels.{rng.random()}", *_JSON_VALUES)  # type: ignore[arg-type]
        )
    return json.dumps(delta).encode()


def _update(rng: Random) -> object:
    if rng.random() < 0.05:
        return rng.choice(_JSON_VALUES)
    names = ("gyro", "n2k.204", f"s{rng.random()}", *_JSON_VALUES)
    values: object = [_path_value(rng) for _ in range(rng.randrange(4))]
    if rng.random() < 0.05:
        values = rng.choice(_JSON_VALUES)
    time = rng.choice(("2026-11-29T08:00:00Z", "9999-12-31T23:59:59-12:00", "", 5))
    source = rng.choice(("$source", "source"))
    name = rng.choice(names)
    named = name if source == "$source" else {"label": name, "src": rng.randrange(300)}
    return {source: named, "timestamp": time, "values": values}


def _path_value(rng: Random) -> object:
    if rng.random() < 0.03:
        return rng.choice(_JSON_VALUES)
    path = rng.choice(_PATHS) if rng.random() < 0.9 else f"propulsion.{rng.random()}.revolutions"
    if rng.random() < 0.02:
        path = f"\x1b[2J\ud800{rng.random()}"
    return {"path": path, "value": rng.choice(_JSON_VALUES)}


def count_values(data: bytes) -> int:
    """Count the values of a packet of deltas, a line or an update without any as one."""
    return sum(map(_count_in_delta, packet_lines(data)))


def _count_in_delta(line: bytes) -> int:
    try:
        delta = json.loads(line) if len(line) < MAX_PACKET_BYTES else None
    except (ValueError, RecursionError):
        return 1
    if not isinstance(delta, dict) or delta.get("context", "vessels.self") != "vessels.self":
        return 1
    updates = delta.get("updates")
    if not isinstance(updates, list):
        return 1
    values = [update.get("values", []) if isinstance(update, dict) else [] for update in updates]
    return sum(len(v) or 1 if isinstance(v, list) else 1 for v in values) or 1


def values_packet(rng: Random) -> bytes:
    """Return a line of the wind sensor, of the weather station, or of a device not described."""
    wind = f"A,{rng.uniform(0, 360):.0f},{rng.uniform(0, 40):06.2f},M,60,"
    air = f"AIR,{rng.uniform(-20, 40):.1f},{rng.uniform(0, 100):.1f},{rng.gauss(1013, 9):.1f}"
    kind = rng.random()
    if kind < 0.4:
        return f"\x02WIND,{wind}\x03{reduce(xor, wind.encode(), 0):02X}".encode()
    fields = air.split(",")
    for _ in range(rng.randrange(3)):
        fields[rng.randrange(kind > 0.9, 4)] = rng.choice(_FIELDS)
    if kind > 0.8:
        fields[0] = f"K{rng.randrange(10_000)}"
    return "\n".join([",".join(fields)] * rng.choice((0, 1, 1, 1, 2))).encode()


# ---- all of them


@dataclass(frozen=True)
class FuzzedStream:
    """A stream of fuzzed packets.

    Attributes
    ----------
    name
        Its name in the table of results.
    format
        The format of streams.
    packet
        Makes a packet without errors of transmission.
    options
        The options of the format.
    count
        Counts what the decoder must count of a packet: its lines, or its values.
    """

    name: str
    format: str
    packet: Callable[[Random], bytes]
    options: tuple[str, ...] = ()
    count: Callable[[bytes], int] = lambda data: len(packet_lines(data))


def _bus(
    name: str,
    line: Callable[[BusMessage], str],
    options: tuple[str, ...] = (),
    *,
    assembled: bool = False,
) -> FuzzedStream:
    packet = _of_bus(line, assembled=assembled)
    return FuzzedStream(f"nmea2000 {name}", "nmea2000", packet, options)


STREAMS = (
    FuzzedStream(
        "nmea0183", "nmea0183", sentence_packet, count=lambda data: len(split_packet(data)) or 1
    ),
    FuzzedStream(
        "nmea0183 --time gnss",
        "nmea0183",
        sentence_packet,
        ("--time", "gnss", "--no-checksum"),
        count=lambda data: len(split_packet(data)) or 1,
    ),
    _bus("CAN frames", _can_frame),
    _bus("CAN frames --time gnss", _can_frame, ("--time", "gnss")),
    _bus("canboat", _canboat, assembled=True),
    _bus("canboat plain", _canboat),
    _bus("candump", _candump),
    _bus("candump-elapsed", _candump_elapsed),
    _bus("candump-intervals", _candump_elapsed, ("--line-format", "candump-intervals")),
    _bus("yacht-devices", _yacht_devices),
    _bus("actisense-ascii", _actisense, assembled=True),
    _bus("ikonvert", _ikonvert, assembled=True),
    FuzzedStream("signalk", "signalk", delta_packet, count=count_values),
    FuzzedStream(
        "signalk --time gnss", "signalk", delta_packet, ("--time", "gnss"), count=count_values
    ),
    FuzzedStream("csv-lines", "csv-lines", values_packet, ("--layout", str(LAYOUT))),
)
"""Streams of every built-in format."""
