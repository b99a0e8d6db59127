"""Options of replay and identification about the logs themselves: vessel, sources, strictness."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from shiplog.screening import StatedDelays
from shiplog.vessel.vessel import Vessel


@dataclass(frozen=True)
class ReadingOptions:
    """How logs are read: by default, all that they state holds.

    A part of a log is read with ``shiplog.open_log(path, 120, -30)`` or ``log.between(120, -30)``.

    Attributes
    ----------
    vessel
        The vessel, in place of the one that the logs carry.
    length
        The ship's length, m, in place of the vessel's.
    sources
        The source of a channel that has several, by its name, such as ``{"yaw_rate": "TI"}``; by
        default it is chosen by comparing them.
    strict
        Refuse a log whose channels contradict each other in unit or sign, instead of a warning.
    derive
        The channels that are derived where a log lacks them: ``yaw_rate`` from the heading,
        ``speed`` from the speed over ground. Warnings state their noise.
    sensor_delays
        By how much the times of a channel are late, s, by its name, such as ``{"heading": 1.2}``;
        or ``"auto"``, which estimates the delays of heading and speed from the log.
    antenna
        Place of the position's antenna ahead and to starboard of the midship point, m, for an
        identification.

    Examples
    --------
    >>> from analysis import analyse
    >>> options = ReadingOptions(length=150.0, strict=True)
    >>> analyse("sample_data/zigzag_20_20.mcap", options).findings.plan.vessel.length
    150.0
    """

    vessel: Vessel | None = None
    length: float | None = None
    sources: Mapping[str, str] = field(default_factory=dict)
    strict: bool = False
    derive: tuple[str, ...] = ()
    sensor_delays: StatedDelays = field(default_factory=dict)
    antenna: tuple[float, float] = (0.0, 0.0)


DEFAULT_OPTIONS = ReadingOptions()
