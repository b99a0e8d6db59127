from itertools import pairwise

import numpy as np
import pytest
from geographiclib.geodesic import Geodesic

from shiplog.geodesy import GeographicPositions, LocalFrame, LocalPositions, positions_of

DATUMS = [
    (60.0, 20.0),
    (-17.0, 179.999),
    (-17.0, -179.999),
    (89.99, 30.0),
    (-90.0, 0.0),
    (0.0, 0.0),
]


def spiral(size: float) -> LocalPositions:
    turn = np.linspace(0, 12, 100)
    return LocalPositions(size * turn / 12 * np.cos(turn), size * turn / 12 * np.sin(turn))


@pytest.mark.parametrize("datum", DATUMS)
def test_positions_return_to_where_they_were(datum: tuple[float, float]) -> None:
    frame, track = LocalFrame(datum, geographic=True), spiral(50_000)
    again = frame.to_local(frame.to_geographic(track))
    assert again.north == pytest.approx(track.north, abs=1e-6)
    assert again.east == pytest.approx(track.east, abs=1e-6)


@pytest.mark.parametrize("datum", DATUMS)
@pytest.mark.parametrize("size", [10_000, 30_000])
def test_distances_along_a_track_are_those_of_the_ellipsoid(
    datum: tuple[float, float], size: float
) -> None:
    frame, track = LocalFrame(datum, geographic=True), spiral(size)
    globe = frame.to_geographic(track)
    ends = list(zip(globe.latitude, globe.longitude, strict=True))
    exact = np.array([Geodesic.WGS84.Inverse(*a, *b)["s12"] for a, b in pairwise(ends)])
    plane = np.hypot(np.diff(track.north), np.diff(track.east))
    largest = (size / 6.357e6) ** 2 / 6 * 1.02
    assert np.abs(plane / exact - 1).max() < largest
    assert largest < (5e-7 if size == 10_000 else 4e-6)


def test_longitudes_from_0_to_360_are_the_same_positions() -> None:
    frame = LocalFrame((50.0, -0.001), geographic=True)
    latitude, longitude = np.array([50.0, 50.01]), np.array([-0.002, 0.003])
    signed = frame.north_east(GeographicPositions(latitude, longitude))
    unsigned = frame.north_east(GeographicPositions(latitude, longitude % 360))
    assert signed == pytest.approx(unsigned, abs=1e-6)


def test_the_datum_is_the_first_measured_position() -> None:
    fields = ("latitude", "longitude", "altitude")
    rows = [[np.nan, 20, 0], [91, 181, 0], [60, np.nan, 0], [60, 20, np.nan], [60.1, 20, 0]]
    frame = LocalFrame.at_first(positions_of(fields, np.array(rows, float)))
    assert frame == LocalFrame((60.0, 20.0), geographic=True)
    local = positions_of(("north", "east"), np.array([[np.nan, 1.0], [4.0, 5.0]]))
    frame = LocalFrame.at_first(local)
    assert frame is not None
    assert frame.north_east(local)[1].tolist() == [0.0, 0.0]
    assert LocalFrame.at_first(local.take(slice(0, 1))) is None


def test_degrees_and_metres_are_not_mixed() -> None:
    local = LocalPositions(np.zeros(2), np.zeros(2))
    with pytest.raises(TypeError, match="different types"):
        LocalFrame((60.0, 20.0), geographic=True).to_local(local)
    with pytest.raises(TypeError, match="not geographic"):
        LocalFrame((0.0, 0.0), geographic=False).to_geographic(local)
