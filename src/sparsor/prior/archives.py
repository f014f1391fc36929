"""The catalogue of public archives, and what their files are as fields."""

from __future__ import annotations

import gzip
import io
import re
from dataclasses import replace
from importlib import resources
from typing import TYPE_CHECKING, Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator
from pydantic import Field as Checked

from sparsor.core.tomlmodel import model_of_file, model_of_toml
from sparsor.errors import FieldError
from sparsor.prior.field import Field, field_on_axes
from sparsor.prior.reading import read_field

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

_MONTH = r"^\d{4}-(0[1-9]|1[0-2])$"
_GZIP = b"\x1f\x8b"
_DIGITS = 4  # characters of a number in a TOMS grid; they are not separated
_ROUNDING_DEG = 1e-6


class Archive(BaseModel):
    """One archive of monthly fields.

    Parameters
    ----------
    name, title, licence : str
    url : str
        With ``{year}`` and ``{month}``.
    first : str
        Its first month, ``YYYY-MM``.
    kind : {"raster", "toms"}
    unit : str
        Of the values once `scale` is applied.
    scale : float
    missing_from, missing_below : float, optional
        Numbers of the file from, or below, which a pixel is a gap.
    sha256 : dict of str to str
        Known checksums, by month.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    name: Annotated[str, Checked(pattern=r"^[a-z0-9-]{1,30}$")]
    title: str
    url: Annotated[str, Checked(pattern=r"^https?://")]
    first: Annotated[str, Checked(pattern=_MONTH)]
    kind: Literal["raster", "toms"]
    unit: str
    licence: str
    scale: float = 1.0
    missing_from: float | None = None
    missing_below: float | None = None
    sha256: dict[str, str] = {}

    @model_validator(mode="after")
    def _url_names_the_month(self) -> Self:
        if "{year}" not in self.url or "{month}" not in self.url:
            raise ValueError("url has to hold {year} and {month}")
        return self

    def url_of(self, month: str) -> str:
        """Return the address of a month, ``YYYY-MM``.

        Raises
        ------
        FieldError
            When that is no month, or one before the archive begins.
        """
        if not re.match(_MONTH, month):
            raise FieldError(f"'{month}' is not a month; write one like 2020-09")
        if month < self.first:
            raise FieldError(f"{self.name} begins with {self.first}; there is no {month}")
        return self.url.replace("{year}", month[:4]).replace("{month}", month[5:])

    def field(self, path: Path, month: str, box: tuple[float, float, float, float] | None = None) -> Field:
        """Return what a file of this archive holds.

        Parameters
        ----------
        path : Path
        month : str
        box : tuple of float, optional
            West, south, east, north in degrees: only this part.

        Raises
        ------
        FieldError
            When it is not such a file, or has no value in the box.
        """
        source = f"{self.title}, {month}"
        found = read_field(path) if self.kind == "raster" else toms_field(path.read_bytes(), source)
        values = found.in_memory.copy()
        if self.missing_from is not None:
            values[values >= self.missing_from] = np.nan
        if self.missing_below is not None:
            values[values < self.missing_below] = np.nan
        return _within(replace(found, values=values * self.scale, unit=self.unit, source=source), box)


class Catalogue(BaseModel):
    """Archives, each of its own name."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    archive: Annotated[list[Archive], Checked(min_length=1)]

    def named(self, name: str) -> Archive:
        """Return an archive by name.

        Raises
        ------
        FieldError
            When there is none.
        """
        for one in self.archive:
            if one.name == name:
                return one
        raise FieldError(f"unknown archive '{name}'; known are {', '.join(one.name for one in self.archive)}")


def catalogue(path: Path | None = None) -> Catalogue:
    """Return the packaged catalogue, or that of a file.

    Raises
    ------
    FieldError
        When the file cannot be read or a value in it is not allowed.
    """
    if path is not None:
        return model_of_file(Catalogue, path, "catalogue", FieldError)
    packaged = resources.files("sparsor.prior") / "archives.toml"
    return model_of_toml(Catalogue, packaged.read_bytes(), "the packaged catalogue", FieldError)


def toms_field(content: bytes, source: str) -> Field:
    """Return the field of a TOMS text grid: integers of four characters, a block for each latitude.

    Parameters
    ----------
    content : bytes
        Perhaps gzipped. Each block begins ``lat=`` with its latitude; its columns run from 180 W eastward.
    source : str

    Raises
    ------
    FieldError
        When it is not one, or is damaged.
    """
    try:
        text = (gzip.decompress(content) if content.startswith(_GZIP) else content).decode("ascii")
    except (OSError, EOFError, UnicodeDecodeError, ValueError) as error:
        raise FieldError(f"{source}: damaged or not a text grid ({error}); fetch it again") from None
    lat, rows = [], []
    for block in re.split(r"^\s*lat=", text, flags=re.MULTILINE)[1:]:
        head, *lines = block.splitlines()
        digits = "".join(line.ljust(-(-len(line) // _DIGITS) * _DIGITS) for line in lines)
        numbers = [digits[k : k + _DIGITS] for k in range(0, len(digits.rstrip()), _DIGITS)]
        try:
            lat.append(float(head.split()[0]))
            rows.append([int(number) for number in numbers])
        except (ValueError, IndexError):
            raise FieldError(f"{source}: a number near latitude '{head.strip()}' cannot be read") from None
    columns = {len(row) for row in rows}
    if len(rows) < 2 or len(columns) != 1 or min(columns) < 2:
        raise FieldError(f"{source}: not a text grid of one width; its blocks have {sorted(columns)} numbers")
    step = 360.0 / columns.pop()
    lon = -180.0 + step * (np.arange(len(rows[0])) + 0.5)
    return field_on_axes(np.array(rows, dtype=np.float64), lon, lat, unit="", source=source)


def field_netcdf(field: Field, facts: Mapping[str, str]) -> bytes:
    """Return a field as NetCDF 4 (CF), with facts as global attributes: where it is from, its licence."""
    import xarray as xr

    attributes = {"units": field.unit, "long_name": "tropospheric NO2 column"}
    dataset = xr.Dataset(
        {"no2": (("lat", "lon"), field.in_memory.astype(np.float32), attributes)},
        coords={
            "lat": ("lat", field.lat_deg, {"standard_name": "latitude", "units": "degrees_north"}),
            "lon": ("lon", field.lon_deg, {"standard_name": "longitude", "units": "degrees_east"}),
        },
        attrs={"Conventions": "CF-1.11", "source": field.source, **facts},
    )
    stream = io.BytesIO()
    plain = {name: {"_FillValue": None} for name in dataset.coords}
    dataset.to_netcdf(stream, engine="h5netcdf", encoding={**plain, "no2": {"zlib": True, "complevel": 6}})
    return stream.getvalue()


def _within(field: Field, box: tuple[float, float, float, float] | None) -> Field:
    if box is None:
        return field
    west, south, east, north = box
    if not (west < east and south < north):
        raise FieldError(f"--bbox is {west:g} {south:g} {east:g} {north:g}; give west south east north, in degrees")
    lon, lat = _inside(field.lon_deg, west, east), _inside(field.lat_deg, south, north)
    if lon.size < 2 or lat.size < 2:
        raise FieldError(
            f"{field.source}: there are no two pixels each way in --bbox {west:g} {south:g} {east:g} {north:g}"
        )
    values = field.in_memory[np.ix_(lat, lon)]
    return replace(field, values=values, lon_deg=field.lon_deg[lon], lat_deg=field.lat_deg[lat])


def _inside(centres: NDArray[np.float64], low: float, high: float) -> NDArray[np.int64]:
    return np.flatnonzero((centres >= low - _ROUNDING_DEG) & (centres <= high + _ROUNDING_DEG))
