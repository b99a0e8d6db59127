"""Tracks of a log for maps, as KML or GPX: one for each receiver, divided where it has a gap."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from shiplog.checks.channel_stats import ChannelStats
from shiplog.checks.event_table import OPERATOR
from shiplog.checks.log_stats import compute_log_stats
from shiplog.errors import LogError
from shiplog.files import atomic_write
from shiplog.geodesy import GeographicPositions, positions_of
from shiplog.printable import printable
from shiplog.types import Channel, Event, FloatArray, TimeArray, TrialLog
from shiplog.version import __version__

ANGLE_DIGITS = 9  # of degrees: 0.1 mm
MAX_TIME_TO_FIX_SECS = 60.0  # from a mark to the nearest position: further away it has no place


@dataclass(frozen=True, eq=False)
class TrackSegment:
    """Positions of one receiver without a gap.

    Attributes
    ----------
    times_ns
        (n,) times of measurement, ns since 1970-01-01 UTC, in order.
    latitude, longitude
        (n,) deg on WGS-84; longitudes are at least -180 and less than 180.
    altitude
        (n,) m; NaN where not measured.
    """

    times_ns: TimeArray
    latitude: FloatArray
    longitude: FloatArray
    altitude: FloatArray

    def __len__(self) -> int:
        """Return the number of positions."""
        return len(self.times_ns)


@dataclass(frozen=True, eq=False)
class GeographicTrack:
    """The track of one receiver.

    Attributes
    ----------
    source
        The receiver.
    segments
        Its segments in the order of time; a gap is between two of them.
    """

    source: str
    segments: tuple[TrackSegment, ...]


def write_track(log: TrialLog, path: str | os.PathLike[str]) -> list[str]:
    """Write the tracks of a log, and the marks of people as points, as KML or GPX.

    Fixes that are impossible, or that the ship cannot have reached, are omitted. If writing fails,
    a file that was there before is kept.

    Parameters
    ----------
    log
        The trial.
    path
        File to write, KML for the suffix `.kml` and GPX for `.gpx`.

    Returns
    -------
    list of str
        Warnings about the positions.

    Raises
    ------
    LogError
        The log has no positions in latitude and longitude.

    References
    ----------
    OGC 12-007r2, KML 2.3, and Google's extension ``gx``; GPX 1.1 schema, topografix.com.
    """
    tracks, warnings = geographic_tracks(log)
    lines = (_kml_lines if Path(path).suffix.lower() == ".kml" else _gpx_lines)(log, tracks)
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="\n") as stream:
        stream.writelines(f"{line}\n" for line in lines)
    return warnings


def geographic_tracks(log: TrialLog) -> tuple[list[GeographicTrack], list[str]]:
    """Return the track of each receiver of a log, and the warnings about its positions.

    Raises
    ------
    LogError
        The log has no positions in latitude and longitude.
    """
    stats = compute_log_stats(log, strict=True)
    tracks, warnings = [], []
    for channel, its_stats in zip(log, stats, strict=True):
        if channel.name != "position" or "latitude" not in channel.fields:
            continue
        segments = _segments(channel, its_stats)
        if its_stats.fixes:
            warnings += [f"{channel.topic}: {text}" for text in its_stats.fixes.warnings()]
        if segments:
            tracks.append(GeographicTrack(channel.source, segments))
    if not tracks:
        reason = (
            "its positions are north and east of a local origin"
            if any(channel.name == "position" and len(channel) for channel in log) and not warnings
            else "; ".join(warnings) or "it has no channel 'position'"
        )
        raise LogError(f"no positions in latitude and longitude for a track, {reason}: {log.name}")
    return tracks, warnings


def _segments(channel: Channel, stats: ChannelStats) -> tuple[TrackSegment, ...]:
    """Return the usable fixes of a channel, divided at its gaps."""
    screened = stats.screened(channel)
    order = np.argsort(screened.measured_ns, kind="stable")
    values, times = screened.values[order], screened.measured_ns[order]
    positions = positions_of(channel.fields, values)
    if not isinstance(positions, GeographicPositions):
        return ()
    kept = positions.measured & ~positions.at_zero
    times, latitude = times[kept], positions.latitude[kept]
    longitude = np.round((positions.longitude[kept] + 180.0) % 360.0 - 180.0, ANGLE_DIGITS)
    longitude[longitude >= 180.0] = -180.0
    altitude = np.full(len(times), np.nan)
    if "altitude" in channel.fields:
        altitude = values[kept, channel.fields.index("altitude")]
    ends = np.flatnonzero(np.diff(times) > stats.gap_threshold_secs * 1e9) + 1
    columns = (np.split(each, ends) for each in (times, latitude, longitude, altitude))
    return tuple(TrackSegment(*each) for each in zip(*columns, strict=True) if len(each[0]))


def _marks(
    log: TrialLog, tracks: Sequence[GeographicTrack]
) -> Iterator[tuple[Event, float, float]]:
    """Yield the marks of people, each with latitude and longitude of the nearest fix in time."""
    segments = tracks[0].segments
    times, latitude, longitude = (
        np.concatenate([getattr(segment, name) for segment in segments])
        for name in ("times_ns", "latitude", "longitude")
    )
    for event in log.events:
        nearest = int(np.argmin(np.abs(times - event.time_ns)))
        near = abs(int(times[nearest]) - event.time_ns) <= MAX_TIME_TO_FIX_SECS * 1e9
        if event.source == OPERATOR and near:
            yield event, float(latitude[nearest]), float(longitude[nearest])


def _gpx_lines(log: TrialLog, tracks: Sequence[GeographicTrack]) -> Iterator[str]:
    """Yield the lines of a GPX file, its elements in the order of the schema."""
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<gpx version="1.1" creator="shiplog {__version__}" '
        'xmlns="http://www.topografix.com/GPX/1/1">'
    )
    first_ns = min(int(track.segments[0].times_ns[0]) for track in tracks)
    yield f"<metadata><name>{_text(log.name)}</name><time>{_utc(first_ns)}</time></metadata>"
    for event, latitude, longitude in _marks(log, tracks):
        yield (
            f'<wpt lat="{_angle(latitude)}" lon="{_angle(longitude)}">'
            f"<time>{_utc(event.time_ns)}</time><name>{_text(event.text)}</name></wpt>"
        )
    for track in tracks:
        yield f"<trk><name>{_text(log.name)}</name><src>{_text(track.source)}</src>"
        for segment in track.segments:
            yield "<trkseg>"
            for time, latitude, longitude, altitude in _rows(segment):
                elevation = "" if np.isnan(altitude) else f"<ele>{altitude:.3f}</ele>"
                yield (
                    f'<trkpt lat="{_angle(latitude)}" lon="{_angle(longitude)}">'
                    f"{elevation}<time>{time}</time></trkpt>"
                )
            yield "</trkseg>"
        yield "</trk>"
    yield "</gpx>"


def _kml_lines(log: TrialLog, tracks: Sequence[GeographicTrack]) -> Iterator[str]:
    """Yield the lines of a KML file: a placemark with times for each track and each mark.

    A track lies on the surface, so that its altitudes, zero where unknown, place nothing.
    """
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">'
    )
    yield f"<Document><name>{_text(log.name)}</name>"
    for event, latitude, longitude in _marks(log, tracks):
        yield (
            f"<Placemark><name>{_text(event.text)}</name>"
            f"<TimeStamp><when>{_utc(event.time_ns)}</when></TimeStamp>"
            f"<Point><coordinates>{_angle(longitude)},{_angle(latitude)}</coordinates></Point>"
            "</Placemark>"
        )
    for track in tracks:
        yield f"<Placemark><name>{_text(track.source)}</name><gx:MultiTrack>"
        yield "<gx:interpolate>0</gx:interpolate>"
        for segment in track.segments:
            yield "<gx:Track><altitudeMode>clampToGround</altitudeMode>"
            yield from (f"<when>{time}</when>" for time, *_ in _rows(segment))
            for _, latitude, longitude, altitude in _rows(segment):
                height = 0.0 if np.isnan(altitude) else altitude
                yield f"<gx:coord>{_angle(longitude)} {_angle(latitude)} {height:.3f}</gx:coord>"
            yield "</gx:Track>"
        yield "</gx:MultiTrack></Placemark>"
    yield "</Document></kml>"


def _rows(segment: TrackSegment) -> Iterator[tuple[str, float, float, float]]:
    """Yield the time, latitude, longitude and altitude of each position."""
    columns = (segment.latitude.tolist(), segment.longitude.tolist(), segment.altitude.tolist())
    yield from zip(map(_utc, segment.times_ns.tolist()), *columns, strict=True)


def _utc(time_ns: int) -> str:
    """Return a time in ISO 8601, rounded to milliseconds."""
    return f"{np.datetime64((time_ns + 500_000) // 1_000_000, 'ms')}Z"


def _angle(degrees: float) -> str:
    return f"{degrees:.{ANGLE_DIGITS}f}"


def _text(text: str) -> str:
    """Return a text for an element: XML has no control characters at all."""
    return escape(printable(text))
