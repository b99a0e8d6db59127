import numpy as np
import pytest
from geographiclib.geodesic import Geodesic

from shiplog.geodesy.ellipsoid import chord, end_of_geodesic, geodesic

DATUMS = [
    (60.0, 20.0), (-17.0, 179.999), (-17.0, -179.999), (0.0, 0.0), (0.0, 180.0), (89.999, 30.0),
    (90.0, 0.0), (-90.0, 45.0), (-89.9995, -135.0), (35.0, 359.99), (1e-7, -75.0),
]  # fmt: skip


@pytest.mark.parametrize("datum", DATUMS)
def test_geodesics_agree_with_geographiclib(datum: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    distance = 10 ** rng.uniform(-1, 6, 60)  # m
    azimuth = rng.uniform(-180, 180, 60)
    azimuth[:4] = 0, 90, 180, -90
    exact = [Geodesic.WGS84.Direct(*datum, a, s) for a, s in zip(azimuth, distance, strict=True)]
    latitude, longitude = np.array([[each["lat2"], each["lon2"]] for each in exact]).T
    computed, at = geodesic(*datum, latitude, longitude)
    assert computed == pytest.approx(distance, abs=1e-4)
    across = (at - np.radians(azimuth) + np.pi) % (2 * np.pi) - np.pi
    assert distance * across == pytest.approx(0, abs=1e-4)
    ends = end_of_geodesic(*datum, distance, np.radians(azimuth))
    assert chord(*ends, latitude, longitude) == pytest.approx(0, abs=1e-4)


def test_a_whole_turn_of_longitude_changes_nothing() -> None:
    latitude, longitude = np.array([59.9, 60.1]), np.array([20.2, 19.9])
    for turns in (-360, 360, 720):
        for one, other in zip(
            geodesic(60, 20, latitude, longitude),
            geodesic(60, 20, latitude, longitude + turns),
            strict=True,
        ):
            assert one == pytest.approx(other, rel=1e-9)


def test_positions_nearly_opposite_on_the_earth_are_not_computed() -> None:
    distance, azimuth = geodesic(30, 0, np.array([-29.9, 30.0]), np.array([179.9, 0.0]))
    assert np.isnan(distance).tolist() == np.isnan(azimuth).tolist() == [True, False]


def test_a_chord_equals_a_short_geodesic() -> None:
    at = np.linspace(0.001, 0.2, 20)
    distance, _ = geodesic(-17, 179.95, -17 + at, 179.95 + at)
    start = np.full(20, -17.0), np.full(20, 179.95)
    assert chord(*start, -17 + at, 179.95 + at - 360) == pytest.approx(distance, rel=1e-6)
