"""Tracks as KML and GPX: parsed again, they are the positions of the log."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from geographic import geographic_log, with_fixes
from places import SAMPLE_DATA

import shiplog
from shiplog.errors import LogError
from shiplog.tables.track_files import geographic_tracks, write_track
from shiplog.types import Channel, Event, TrialLog
from shiplog.units import GEOGRAPHIC

GPX = "{http://www.topografix.com/GPX/1/1}"
KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
START = 1_767_225_600 * 10**9


def log_at(
    longitude: np.ndarray, secs: np.ndarray, altitude: float = np.nan, source: str = "gnss"
) -> TrialLog:
    times = START + np.round(secs * 1e9).astype(np.int64)
    values = np.column_stack((np.full(len(secs), 60.0), longitude, np.full(len(secs), altitude)))
    return TrialLog(
        "a.mcap", (Channel("position", source, "deg", times, times, values, GEOGRAPHIC),)
    )


def parsed(log: TrialLog, path: Path) -> ET.Element:
    write_track(log, path)
    return ET.parse(path).getroot()  # noqa: S314 - a file of ours


@pytest.fixture(scope="module")
def ship() -> TrialLog:
    log = geographic_log(shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap"))
    marks = Event(log.span_ns[0] + 10**9, "execute <20> & go\x07"), Event(0, "before")
    return replace(log, name="zig & zag.mcap", events=marks)


def test_gpx_has_the_positions_and_times_of_the_log(ship: TrialLog, tmp_path: Path) -> None:
    root = parsed(ship, tmp_path / "track.gpx")
    points = root.findall(f"{GPX}trk/{GPX}trkseg/{GPX}trkpt")
    position = ship["position"]
    found = np.array([[float(p.get("lat", "")), float(p.get("lon", ""))] for p in points])
    np.testing.assert_allclose(found, position.values[:, :2], rtol=0, atol=1e-9)
    times = [np.datetime64(p.findtext(f"{GPX}time", "").removesuffix("Z"), "ns") for p in points]
    assert np.abs(np.array(times).astype(np.int64) - position.measured_ns).max() <= 500_000
    assert root.tag == f"{GPX}gpx"
    assert root.get("version") == "1.1"
    assert [child.tag for child in root] == [f"{GPX}metadata", f"{GPX}wpt", f"{GPX}trk"]


def test_kml_has_the_positions_and_times_of_the_log(ship: TrialLog, tmp_path: Path) -> None:
    root = parsed(ship, tmp_path / "track.KML")
    (track,) = root.findall(f"{KML}Document/{KML}Placemark/{GX}MultiTrack/{GX}Track")
    coordinates = [element.text.split() for element in track.findall(f"{GX}coord")]
    found = np.array(coordinates, float)[:, [1, 0]]
    np.testing.assert_allclose(found, ship["position"].values[:, :2], rtol=0, atol=1e-9)
    whens = [element.text for element in track.findall(f"{KML}when")]
    assert whens[1] == "2026-01-01T00:00:01.000Z"
    assert len(whens) == len(coordinates)


@pytest.mark.parametrize(
    ("name", "path"), [("t.gpx", f"{GPX}wpt/{GPX}name"), ("t.kml", f".//{KML}Placemark/{KML}name")]
)
def test_marks_of_people_are_points_and_their_texts_are_escaped(
    ship: TrialLog, tmp_path: Path, name: str, path: str
) -> None:
    root = parsed(ship, tmp_path / name)
    assert next(element.text for element in root.findall(path)) == r"execute <20> & go\x07"
    names = [element.text for element in root.iter() if element.tag.endswith("name")]
    assert "zig & zag.mcap" in names
    assert "before" not in names  # a mark long before the first position


def test_a_gap_ends_a_segment(tmp_path: Path) -> None:
    secs = np.r_[0:20, 50:70].astype(float)
    log = log_at(20 + secs * 1e-4, secs, altitude=3.5)
    root = parsed(log, tmp_path / "t.gpx")
    segments = root.findall(f"{GPX}trk/{GPX}trkseg")
    assert [len(segment) for segment in segments] == [20, 20]
    assert [child.tag for child in segments[0][0]] == [f"{GPX}ele", f"{GPX}time"]
    assert segments[0][0].findtext(f"{GPX}ele") == "3.500"
    assert len(parsed(log, tmp_path / "t.kml").findall(f".//{GX}Track")) == 2


def test_longitudes_are_within_half_a_turn_across_the_antimeridian() -> None:
    secs = np.arange(20.0)
    ((track,), _) = geographic_tracks(log_at(180 - 1e-4 + 2e-5 * secs, secs))
    found = track.segments[0].longitude
    assert (found >= -180).all()
    assert (found < 180).all()
    np.testing.assert_allclose(found % 360, 180 - 1e-4 + 2e-5 * secs, atol=1e-9)


def test_impossible_positions_are_omitted_and_reported(ship: TrialLog) -> None:
    bad = with_fixes(ship, slice(100, 110), [0.0, 0.0])
    bad = with_fixes(bad, slice(200, 205), [91.0, 181.0])
    ((track,), warnings) = geographic_tracks(bad)
    assert sum(map(len, track.segments)) == 601 - 15
    assert any("10 fixes at latitude 0" in text for text in warnings)
    assert any("5 fixes at an impossible position" in text for text in warnings)


def test_each_receiver_is_a_track(tmp_path: Path) -> None:
    secs = np.arange(20.0)
    both = (*log_at(20 + secs * 1e-4, secs), *log_at(20 + secs * 1e-4, secs, source="spare"))
    root = parsed(TrialLog("a", both), tmp_path / "t.gpx")
    assert [element.text for element in root.iter(f"{GPX}src")] == ["gnss", "spare"]


def test_without_latitude_and_longitude_there_is_no_track(tmp_path: Path) -> None:
    local = shiplog.read(SAMPLE_DATA / "zigzag_20_20.mcap")
    with pytest.raises(LogError, match="north and east of a local origin: zigzag"):
        write_track(local, tmp_path / "t.gpx")
    bare = replace(local, channels=local.channels[:1])
    with pytest.raises(LogError, match="it has no channel 'position'"):
        write_track(bare, tmp_path / "t.gpx")
    secs = np.arange(5.0)
    with pytest.raises(LogError, match="impossible position"):
        write_track(log_at(np.full(5, 500.0), secs), tmp_path / "t.gpx")
    assert not list(tmp_path.iterdir())
