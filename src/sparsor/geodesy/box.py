"""Bounding boxes in degrees, west south east north."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sparsor.errors import BoxError
from sparsor.geodesy.lengths import distance_m

MIN_SIDE_M = 200.0
MAX_SIDE_M = 3_000_000.0
MAX_LATITUDE_DEG = 85.0
ORDER = "west south east north, in degrees"


@dataclass(frozen=True)
class BoundingBox:
    """A box between two meridians and two parallels (WGS 84).

    A west side east of the east side means that the box crosses the antimeridian.

    Parameters
    ----------
    west_deg, south_deg, east_deg, north_deg : float
        Longitudes in -180..180, latitudes in -85..85, in GDAL's order.

    Raises
    ------
    BoxError
        When a value is not a number or out of range, when sides are swapped, or when a side is shorter than
        200 m or longer than 3000 km.

    Examples
    --------
    >>> box = BoundingBox(51.50, 25.27, 51.53, 25.30)
    >>> round(box.east_m), round(box.north_m)
    (3021, 3323)
    >>> round(BoundingBox(179.9, -17.0, -179.9, -16.8).width_deg, 9)  # Fiji, across the antimeridian
    0.2
    """

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float

    def __post_init__(self) -> None:
        self._check_ranges()
        self._check_sides()

    @property
    def crosses_antimeridian(self) -> bool:
        """Whether the box spans the 180 degree meridian."""
        return self.west_deg > self.east_deg

    @property
    def width_deg(self) -> float:
        """Extent in longitude, degrees, always positive."""
        return (self.east_deg - self.west_deg) % 360.0

    @property
    def height_deg(self) -> float:
        """Extent in latitude, degrees."""
        return self.north_deg - self.south_deg

    @property
    def centre_lat_deg(self) -> float:
        """Latitude of the middle parallel."""
        return (self.south_deg + self.north_deg) / 2

    @property
    def centre_lon_deg(self) -> float:
        """Longitude of the middle meridian, -180..180."""
        return wrap_longitude(self.west_deg + self.width_deg / 2)

    @property
    def east_m(self) -> float:
        """Width along the middle parallel, metres (as the sum of short geodesics, so that it is a width)."""
        parts = 64
        lon = [self.west_deg + self.width_deg * k / parts for k in range(parts + 1)]
        lat = [self.centre_lat_deg] * (parts + 1)
        return float(distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:]).sum())

    @property
    def north_m(self) -> float:
        """Height along a meridian, geodesic metres."""
        return float(distance_m(self.west_deg, self.south_deg, self.west_deg, self.north_deg))

    def as_tuple(self) -> tuple[float, float, float, float]:
        """Return west, south, east, north in degrees."""
        return (self.west_deg, self.south_deg, self.east_deg, self.north_deg)

    def _check_ranges(self) -> None:
        values = self.as_tuple()
        if not all(math.isfinite(value) for value in values):
            raise BoxError(f"the box {_text(values)} holds a value that is not a number; give {ORDER}")
        west, south, east, north = values
        for name, lat in (("south", south), ("north", north)):
            if abs(lat) > 90.0:
                raise BoxError(
                    f"{name} latitude {lat:g} is outside -90..90; the order is {ORDER}"
                    + (" (latitudes and longitudes swapped?)" if abs(west) <= 90 and abs(east) <= 90 else "")
                )
            if abs(lat) > MAX_LATITUDE_DEG:
                raise BoxError(
                    f"{name} latitude {lat:g} is beyond {MAX_LATITUDE_DEG:g} degrees: grids that are regular "
                    "in degrees do not work at the poles"
                )
        for name, lon in (("west", west), ("east", east)):
            if abs(lon) > 180.0:
                raise BoxError(f"{name} longitude {lon:g} is outside -180..180; the order is {ORDER}")

    def _check_sides(self) -> None:
        if self.south_deg > self.north_deg:
            raise BoxError(
                f"south {self.south_deg:g} lies north of north {self.north_deg:g}: swapped? The order is {ORDER}"
            )
        # -180 to 180 is once round, although the two are the same meridian.
        spans_deg = self.width_deg or abs(self.east_deg - self.west_deg)
        if spans_deg > 180.0:
            raise BoxError(
                f"the box from west {self.west_deg:g} to east {self.east_deg:g} spans {spans_deg:g} "
                "degrees, nearly round the world: are west and east swapped? West greater than east means a "
                "box across the antimeridian"
            )
        if self.width_deg == 0 or self.height_deg == 0:
            raise BoxError(f"the box {_text(self.as_tuple())} has no size; give {ORDER}")
        for name, side_m in (("wide", self.east_m), ("high", self.north_m)):
            if side_m < MIN_SIDE_M:
                raise BoxError(f"the box is {side_m:.1f} m {name}; the least is {MIN_SIDE_M:g} m")
            if side_m > MAX_SIDE_M:
                raise BoxError(f"the box is {side_m / 1000:.0f} km {name}; the most is {MAX_SIDE_M / 1000:g} km")


def wrap_longitude(lon_deg: float) -> float:
    """Bring a longitude into -180..180, leaving values inside untouched."""
    if -180.0 <= lon_deg <= 180.0:
        return lon_deg
    return (lon_deg + 180.0) % 360.0 - 180.0


def _text(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:g}" for value in values)
