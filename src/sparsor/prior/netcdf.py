"""Fields from NetCDF files and Zarr folders that follow the CF conventions."""

from __future__ import annotations

import warnings
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.prior.field import check_pixel_count, field_on_axes
from sparsor.prior.raster import LAZY_PIXELS, TILE, OnFile

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import xarray as xr
    from numpy.typing import NDArray

    from sparsor.prior.field import Field

# What the backends raise on damaged or unusual files; there is no common class.
READ_ERRORS = (
    OSError,
    ValueError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    RuntimeError,
    MemoryError,
    ImportError,
)
# CF conventions, section 4.1 and 4.2, and what files without attributes call them.
AXES = {
    "latitude": (
        ("degrees_north", "degree_north", "degrees_n", "degree_n", "degreesn", "degreen"),
        ("lat", "latitude", "lats", "nav_lat"),
        "Y",
    ),
    "longitude": (
        ("degrees_east", "degree_east", "degrees_e", "degree_e", "degreese", "degreee"),
        ("lon", "longitude", "long", "lons", "nav_lon"),
        "X",
    ),
}
LISTED = 12


def read_netcdf(
    path: Path, *, variable: str | None = None, time: str | int | None = None, lazily: bool = False
) -> Field:
    """Return one variable at one time step as a field.

    Parameters
    ----------
    path : Path
        NetCDF 4 (HDF5), classic NetCDF 3, or a folder of Zarr.
    variable : str, optional
        Needed where there is more than one variable over latitude and longitude.
    time : str or int, optional
        Index of the step from 0 (negative from the end), or the beginning of its ISO date, four digits or
        more, that fits one step; needed where there are several.
    lazily : bool
        Leave a large raster on file until windows are cut from it.

    Returns
    -------
    Field
        ``_FillValue``, ``scale_factor`` and ``add_offset`` applied; infinite values are gaps.

    Raises
    ------
    FieldError
        When it cannot be read, the variable or step is not there or not the only one, or the variable is not
        on a regular longitude-latitude raster.
    """
    with ExitStack() as closing:
        dataset = closing.enter_context(_opened(path))
        name = _choose_variable(dataset, variable, path)
        array = dataset[name]
        lat_name, lon_name = (_axis(dataset, array, kind) for kind in AXES)
        array, step = _one_step(array, time, path, keep=(lat_name, lon_name))
        extra = {str(dim): size for dim, size in array.sizes.items() if dim not in (lat_name, lon_name)}
        if any(size != 1 for size in extra.values()):
            raise FieldError(
                f"{path}: '{name}' has further dimensions ({_sizes(extra)}); take one layer first, e.g. with "
                f"ncks -d {max(extra, key=lambda dim: extra[dim])},0"
            )
        array = array.squeeze(list(extra), drop=True).transpose(lat_name, lon_name)
        read, shape = partial(_values, array, path), (int(array.shape[0]), int(array.shape[1]))
        values: NDArray[np.float64] | OnFile
        if lazily and array.size > LAZY_PIXELS:
            closing.pop_all()  # it stays open as long as the field is there
            chunks = dict(zip(dataset[name].dims, _chunks(dataset[name]), strict=False))
            values = OnFile(shape, read, (int(chunks.get(lat_name, TILE)), int(chunks.get(lon_name, TILE))))
        else:
            check_pixel_count(*shape, str(path))
            values = read(slice(0, shape[0]), slice(0, shape[1]))
        with _wrapped(path):
            lon_deg, lat_deg = (np.asarray(dataset[axis].values, float) for axis in (lon_name, lat_name))
    unit = str(array.attrs.get("units", "")).strip()
    source = ", ".join(part for part in (f"{path}: {name}", step) if part)
    return field_on_axes(values, lon_deg, lat_deg, unit=unit, source=source)


def time_steps(path: Path, variable: str | None = None) -> int | None:
    """Return how many time steps `read_netcdf` offers of a variable; None where there is no time.

    Raises
    ------
    FieldError
        As `read_netcdf`.
    """
    with _opened(path) as dataset:
        array = dataset[_choose_variable(dataset, variable, path)]
        keep = [_axis(dataset, array, kind) for kind in AXES]
        times = [size for dim, size in array.sizes.items() if str(dim) not in keep and _is_time(array, str(dim))]
    return times[0] if times else None


def _values(array: xr.DataArray, path: Path, rows: slice, columns: slice) -> NDArray[np.float64]:
    with _wrapped(path):
        return np.asarray(array[rows, columns].values, dtype=np.float64)


def _chunks(array: xr.DataArray) -> tuple[int, ...]:
    """Return the sizes of what is packed together, a number for each dimension, as NetCDF or Zarr say it."""
    return tuple(array.encoding.get("chunksizes") or array.encoding.get("chunks") or ())


@contextmanager
def _wrapped(path: Path) -> Iterator[None]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # xarray's, on calendars and fill values
            yield
    except READ_ERRORS as error:
        raise FieldError(
            f"{path}: cannot be read as NetCDF ({str(error) or type(error).__name__}); is the file complete? "
            "Try ncdump -h on it, or convert it with nccopy -k nc4"
        ) from error


@contextmanager
def _opened(path: Path) -> Iterator[xr.Dataset]:
    if path.is_dir():
        with _wrapped(path):
            dataset = _open(path, "zarr")
        with dataset:
            yield dataset
        return
    with path.open("rb") as stream:
        magic = stream.read(4)
    if magic == b"CDF\x05":
        raise FieldError(f"{path} is NetCDF of the 64-bit-data kind; convert it with nccopy -k nc4")
    with _wrapped(path):
        dataset = _open(path, "scipy" if magic.startswith(b"CDF") else "h5netcdf")
    with dataset:
        yield dataset


def _open(path: Path, engine: str) -> xr.Dataset:
    import xarray as xr

    try:
        return xr.open_dataset(path, engine=engine, decode_timedelta=False)
    except (ValueError, OverflowError, ImportError):
        # Calendars other than the civil one: steps can still be told by their index.
        return xr.open_dataset(path, engine=engine, decode_times=False)


def _choose_variable(dataset: xr.Dataset, variable: str | None, path: Path) -> str:
    names = [str(name) for name in dataset.data_vars]
    gridded = [name for name in names if _is_gridded(dataset, dataset[name])]
    if variable is not None:
        if variable in gridded:
            return variable
        alike = [name for name in gridded if name.lower() == variable.strip().lower()]
        if len(alike) == 1:
            return alike[0]
        if variable not in names:
            raise FieldError(f"{path} has no variable '{variable}'; {_offer(gridded)}")
        raise FieldError(f"{path}: '{variable}' is not on latitudes and longitudes; {_offer(gridded)}")
    if len(gridded) == 1:
        return gridded[0]
    if gridded:
        raise FieldError(f"{path} has {len(gridded)} variables; choose one with --variable: {_list(gridded)}")
    raise FieldError(f"{path} {_why_not_gridded(dataset)}")


def _is_gridded(dataset: xr.Dataset, array: xr.DataArray) -> bool:
    return array.dtype.kind in "iuf" and all(_axis(dataset, array, kind) for kind in AXES)


def _axis(dataset: xr.Dataset, array: xr.DataArray, kind: str) -> str:
    """Return the dimension of `array` that is the latitude or longitude; ``""`` without one."""
    for dim in map(str, array.dims):
        if dim in dataset.variables and dataset[dim].ndim == 1 and _is_axis(dataset[dim], dim, kind):
            return dim
    return ""


def _is_axis(coordinate: xr.DataArray, name: str, kind: str) -> bool:
    units, names, letter = AXES[kind]
    attributes = {key: str(value).strip() for key, value in coordinate.attrs.items()}
    standard = attributes.get("standard_name")
    if standard is not None:
        return standard == kind
    unit = attributes.get("units", "").lower().replace(" ", "_")
    if unit in units or name.lower() in names:
        return True
    return attributes.get("axis") == letter and unit in ("", "degrees", "degree")


def _why_not_gridded(dataset: xr.Dataset) -> str:
    flat = [name for name in map(str, dataset.variables) if dataset[name].ndim == 2]
    if any(_is_axis(dataset[name], name, "latitude") for name in flat):
        return (
            "is on a curvilinear grid (its latitudes have two dimensions); resample it to a regular raster "
            "first, e.g. with cdo remapbil,r3600x1800"
        )
    standard = {str(dataset[name].attrs.get("standard_name")) for name in dataset.variables}
    if "projection_x_coordinate" in standard:
        return "is on projected coordinates; bring it to longitude and latitude with gdalwarp -t_srs EPSG:4326"
    return (
        f"has no variable on latitudes and longitudes; it holds: {_list(list(map(str, dataset.variables)))}. "
        "Variables inside groups are not read: take them out first, e.g. with ncks -G : -g GROUP"
    )


def _one_step(
    array: xr.DataArray, time: str | int | None, path: Path, keep: tuple[str, ...]
) -> tuple[xr.DataArray, str]:
    """Return the array without its time dimension, and the step's date."""
    dims = [dim for dim in map(str, array.dims) if dim not in keep and _is_time(array, dim)]
    if not dims:
        if time is not None:
            raise FieldError(f"{path}: '{array.name}' has no time steps to choose '{time}' from; leave it out")
        return array, ""
    dim = dims[0]
    steps = _step_texts(array, dim)
    index = _step_index(steps, time, f"{path}: '{array.name}'")
    return array.isel({dim: index}, drop=True), steps[index]


def _is_time(array: xr.DataArray, dim: str) -> bool:
    if dim.lower() in ("time", "t", "date", "valid_time"):
        return True
    if dim not in array.coords:
        return False
    coordinate = array[dim]
    standard, axis = (coordinate.attrs.get(key) for key in ("standard_name", "axis"))
    return coordinate.dtype.kind == "M" or standard == "time" or axis == "T"


def _step_texts(array: xr.DataArray, dim: str) -> list[str]:
    if dim not in array.coords:
        return [f"step {index}" for index in range(array.sizes[dim])]
    steps = array[dim].values
    if steps.dtype.kind == "M":
        texts = [str(text) for text in np.datetime_as_string(steps, unit="s")]
        return [text.removesuffix("T00:00:00") for text in texts]
    unit = str(array[dim].attrs.get("units", ""))
    return [f"{step} {unit}".strip() for step in steps.tolist()]


def _step_index(steps: list[str], time: str | int | None, source: str) -> int:
    if isinstance(time, int) and 0 <= time < len(steps):
        return time  # as text it may be taken for a year
    there = f"its {len(steps)} steps are: {_list(steps)}"
    if time is None:
        if len(steps) == 1:
            return 0
        raise FieldError(f"{source} has {len(steps)} time steps; choose one by its date or its index; {there}")
    text = str(time).strip().replace(" ", "T").removesuffix("Z")
    fits = [k for k, step in enumerate(steps) if len(text) >= 4 and f"{step}T00:00:00".startswith(text)]
    if len(fits) == 1:
        return fits[0]
    if len(fits) > 1:
        raise FieldError(f"{source}: '{time}' fits {len(fits)} time steps: {_list([steps[k] for k in fits])}")
    if text.removeprefix("-").isdecimal() and -len(steps) <= int(text) < len(steps):
        return int(text) % len(steps)
    raise FieldError(f"{source} has no time step '{time}' (an index from 0, or an ISO date); {there}")


def _offer(names: list[str]) -> str:
    return f"there are: {_list(names)}" if names else "it has none that is"


def _list(names: list[str]) -> str:
    more = f" ... {names[-1]}" if len(names) > LISTED else ""
    return ", ".join(names[:LISTED]) + more if names else "nothing"


def _sizes(dims: dict[str, int]) -> str:
    return ", ".join(f"{name} of {size}" for name, size in dims.items())
