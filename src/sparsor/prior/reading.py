"""Training fields from files of any kind that we know."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sparsor.errors import FieldError

if TYPE_CHECKING:
    import os

    from sparsor.prior.field import Field

KINDS = "a GeoTIFF, a NetCDF file or Zarr folder, or a heatmap picture (PNG, JPEG, WebP) with --field-bbox W S E N"
VARIABLE, TIME, BOX = "--variable", "time step", "--field-bbox"
COLORMAP, RANGE = "--field-colormap", "--field-range"
NETCDF = (b"\x89HDF\r\n\x1a\n", b"CDF\x01", b"CDF\x02", b"CDF\x05")
ZARR = ("zarr.json", ".zmetadata", ".zgroup")
PICTURES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"GIF8", b"BM")


def read_field(
    path: str | os.PathLike[str],
    *,
    variable: str | None = None,
    time: str | int | None = None,
    box: tuple[float, float, float, float] | None = None,
    colormap: str | None = None,
    value_range: tuple[float, float] | None = None,
    lazily: bool = False,
) -> Field:
    """Return the field in a file; what kind of file it is, its first bytes say.

    Parameters
    ----------
    path : path
        A GeoTIFF or another raster with a CRS, NetCDF, Zarr, or a picture.
    variable : str, optional
        NetCDF: name of the variable. GeoTIFF: name or number, from 1, of the band.
    time : str or int, optional
        NetCDF: index of the time step, or the beginning of its ISO date.
    box : tuple of float, optional
        West, south, east, north in degrees of the outer edges of a picture, or of a raster without a CRS.
    colormap : str, optional
        Picture: name of the matplotlib colour map it was rendered with; may be left out for a grey one.
    value_range : tuple of float, optional
        Picture: values of the first and the last colour; 0 and 1 when left out.
    lazily : bool
        Leave a large raster on file until windows are cut from it, so that it may be larger than memory.

    Returns
    -------
    Field
        Its `notes` say what was assumed or lost.

    Raises
    ------
    FieldError
        When there is no such file, it cannot be read or has no values, or an option does not fit its kind.
    """
    file = Path(path)
    kind = _kind_of(file)
    if kind == "netcdf":
        from sparsor.prior.netcdf import read_netcdf

        _refuse(file, "NetCDF file", {BOX: box, COLORMAP: colormap, RANGE: value_range})
        return read_netcdf(file, variable=variable, time=time, lazily=lazily)
    # A TIFF may be either: a colour map or a range says that it is a picture.
    if kind == "picture" or colormap is not None or value_range is not None:
        from sparsor.prior.heatmap import read_heatmap

        if box is None:
            why = "is a picture" if kind == "picture" else f"is read as a picture ({COLORMAP}, {RANGE})"
            raise FieldError(f"{file} {why}: say where it lies with {BOX} W S E N")
        _refuse(file, "picture", {VARIABLE: variable, TIME: time})
        return read_heatmap(file, box, colormap=colormap, value_range=value_range)
    from sparsor.prior.geotiff import read_geotiff

    _refuse(file, "raster", {TIME: time})
    return read_geotiff(file, variable=variable, box=box, lazily=lazily)


def is_netcdf(path: Path) -> bool:
    """Return whether a file is NetCDF, by its first bytes, or a folder of Zarr, which follows the same conventions.

    Raises
    ------
    FieldError
        When there is no such file.
    """
    return _kind_of(path) == "netcdf"


def _kind_of(file: Path) -> str:
    if file.is_dir():
        if any((file / name).is_file() for name in ZARR):
            return "netcdf"
        raise FieldError(f"'{file}' is a folder; give a file: {KINDS}")
    try:
        with file.open("rb") as stream:
            head = stream.read(16)
    except OSError as error:
        raise FieldError(f"cannot read '{file}': {error.strerror or error}; give {KINDS}") from error
    except ValueError as error:
        raise FieldError(f"{str(file)!r} is not a file name ({error}); give {KINDS}") from error
    if not head:
        raise FieldError(f"'{file}' is empty (0 bytes); give {KINDS}")
    if head.startswith(NETCDF):
        return "netcdf"
    if head.startswith(PICTURES) or (head[:4] == b"RIFF" and head[8:12] == b"WEBP"):
        return "picture"
    return "raster"


def _refuse(file: Path, kind: str, options: dict[str, object]) -> None:
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise FieldError(f"{file} is a {kind}, which takes no {' or '.join(given)}; leave it out")
