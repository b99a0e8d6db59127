"""Types of position: geographic, in degrees, and local, in metres."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .ellipsoid import FloatArray, chord

MAX_LATITUDE, MAX_LONGITUDE = 90.0, 360.0  # deg


@dataclass(frozen=True, eq=False)
class GeographicPositions:
    """Latitudes and longitudes on the WGS-84 ellipsoid.

    Attributes
    ----------
    latitude
        (n,) geodetic latitude, deg, positive north.
    longitude
        (n,) longitude, deg, positive east; by any multiple of 360 the same.
    """

    latitude: FloatArray
    longitude: FloatArray

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether both components are known and in range, (n,)."""
        with np.errstate(invalid="ignore"):
            north = np.abs(self.latitude) <= MAX_LATITUDE
            return np.asarray(north & (np.abs(self.longitude) <= MAX_LONGITUDE))

    @property
    def at_zero(self) -> NDArray[np.bool_]:
        """Whether both components are zero, which receivers print without a fix, (n,)."""
        return np.asarray((np.abs(self.latitude) < 1e-9) & (np.abs(self.longitude) < 1e-9))

    def distances(self, rows: NDArray[np.intp], others: NDArray[np.intp]) -> FloatArray:
        """Return the straight distance from each of `rows` to each of `others`, (m,) m.

        It is the chord through the earth: up to 30 km it equals the geodesic to 1e-6.
        """
        return chord(
            self.latitude[rows],
            self.longitude[rows],
            self.latitude[others],
            self.longitude[others],
        )

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> "GeographicPositions":
        """Return the selected positions."""
        return GeographicPositions(self.latitude[rows], self.longitude[rows])


@dataclass(frozen=True, eq=False)
class LocalPositions:
    """Positions in a plane frame.

    Attributes
    ----------
    north, east
        (n,) m from the origin of the frame.
    """

    north: FloatArray
    east: FloatArray

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether both components are known, (n,)."""
        return np.asarray(np.isfinite(self.north) & np.isfinite(self.east))

    @property
    def at_zero(self) -> NDArray[np.bool_]:
        """False throughout: the origin of a local frame is a place like any other, (n,)."""
        return np.zeros(len(self.north), bool)

    def distances(self, rows: NDArray[np.intp], others: NDArray[np.intp]) -> FloatArray:
        """Return the distance from each of `rows` to each of `others`, (m,) m."""
        return np.asarray(
            np.hypot(
                self.north[others] - self.north[rows],
                self.east[others] - self.east[rows],
            )
        )

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> "LocalPositions":
        """Return the selected positions."""
        return LocalPositions(self.north[rows], self.east[rows])


Positions = GeographicPositions | LocalPositions


def positions_of(fields: tuple[str, ...], values: FloatArray) -> Positions:
    """Return the samples of a position channel with their type.

    Parameters
    ----------
    fields
        Names of the components. With ``latitude`` and ``longitude`` among them the positions are
        geographic; otherwise the first two components are north and east.
    values
        (n, k) one column per component. Further components, such as the altitude, are ignored.

    Examples
    --------
    >>> positions_of(("north", "east"), np.array([[3.0, 4.0]])).measured.tolist()
    [True]
    >>> fix = np.array([[91.0, 181.0, np.nan]])
    >>> positions_of(("latitude", "longitude", "altitude"), fix).measured.tolist()
    [False]
    """
    if "latitude" in fields and "longitude" in fields:
        latitude, longitude = fields.index("latitude"), fields.index("longitude")
        return GeographicPositions(values[:, latitude], values[:, longitude])
    return LocalPositions(values[:, 0], values[:, 1])
