"""Fields from a heatmap picture: placed by a box, its colour map undone."""

from __future__ import annotations

import math
import struct
import warnings
from typing import TYPE_CHECKING

import numpy as np

from sparsor.errors import FieldError
from sparsor.prior.field import check_pixel_count, field_on_axes
from sparsor.prior.geotiff import axes_over

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray
    from PIL import Image

    from sparsor.prior.field import Field

COMMON = (
    *("viridis", "plasma", "inferno", "magma", "cividis", "turbo", "jet", "hot", "afmhot"),
    *(
        "YlOrRd",
        "YlOrRd_r",
        "Spectral",
        "Spectral_r",
        "RdYlBu_r",
        "RdYlGn_r",
        "coolwarm",
        "Blues",
        "gray",
        "gray_r",
    ),
)
GREYS = ("gray", "grey")
LEVELS = 256
# JPEG stores brightness and two chromas, these at half the resolution. Nearest colours are looked for there,
# chroma counting half: smaller errors than in RGB or CIELAB (docs/decisions/0004-reading-fields.md).
TO_LUMA_CHROMA = np.array([[0.299, 0.587, 0.114], [-0.0843645, -0.1656355, 0.25], [0.25, -0.2093439, -0.0406561]])
TOLERANCE = 16.0
LEAST_SHARE = 0.5


def read_heatmap(
    path: Path,
    box: tuple[float, float, float, float],
    *,
    colormap: str | None = None,
    value_range: tuple[float, float] | None = None,
) -> Field:
    """Return the values that a rendered heatmap shows.

    Parameters
    ----------
    path : Path
        A picture cropped to the map itself, its rows evenly spaced in latitude.
    box : tuple of float
        West, south, east, north in degrees of the picture's outer edges.
    colormap : str, optional
        Name of a matplotlib colour map; may be left out for a grey picture.
    value_range : tuple of float, optional
        Values of the colour map's first and last colour; 0 and 1, of no dimension, when left out.

    Returns
    -------
    Field
        Transparent pixels, and those off the colour map (borders, labels) with their neighbours, are gaps.

    Raises
    ------
    FieldError
        When it is not a picture, the colour map is unknown or not this picture's, or the range is empty.
    """
    low, high = _check_range(value_range, path)
    picture = _open_picture(path)
    if picture.mode in ("I", "F"):
        raise FieldError(f"{path} holds numbers, not colours; leave --field-colormap and --field-range out")
    if picture.mode.startswith("I;16"):
        shares, name = _shares_of_white(picture, colormap, path), "gray"
    else:
        shares, name = _shares_of_colours(picture, colormap, path)
    lon_deg, lat_deg = axes_over(box, shares.shape, str(path))
    return field_on_axes(
        low + (high - low) * shares,
        lon_deg,
        lat_deg,
        unit="1" if value_range is None else "",
        source=f"{path}: colour map {name} undone onto {low:g}..{high:g}",
        notes=_notes(path, name, shares, stated=value_range is not None),
    )


def undo_colormap(pixels: NDArray[np.uint8], colormap: str, tolerance: float = TOLERANCE) -> NDArray[np.float64]:
    """Return the place of each pixel's colour along a colour map.

    Parameters
    ----------
    pixels : array of uint8 (..., 3)
        Red, green, blue.
    colormap : str
        Name of a matplotlib colour map.
    tolerance : float
        How far from the colour map a colour may lie, in units of 8-bit brightness.

    Returns
    -------
    array of float64 (...)
        0..1, the middle of the nearest of its 256 levels; NaN beyond the tolerance.

    Raises
    ------
    FieldError
        When there is no such colour map, or it shows distant values in the same colour.

    Examples
    --------
    >>> undo_colormap(np.array([[68, 1, 84], [253, 231, 37], [255, 255, 255]], dtype=np.uint8), "viridis")
    array([0.00195312, 0.99804688,        nan])
    """
    from scipy.spatial import cKDTree

    colours, places = _levels(colormap)
    packed = pixels.reshape(-1, 3).astype(np.uint32) @ np.array([65536, 256, 1], dtype=np.uint32)
    found, back = np.unique(packed, return_inverse=True)
    rgb = np.stack([found >> 16, found >> 8 & 255, found & 255], axis=-1).astype(np.float64)
    distance, nearest = cKDTree(colours @ TO_LUMA_CHROMA.T).query(rgb @ TO_LUMA_CHROMA.T)
    shares = np.where(distance <= tolerance, places[nearest], np.nan)
    return np.asarray(shares[back].reshape(pixels.shape[:-1]))


def _levels(colormap: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the distinct colours of a colour map, 0..255, and their places along it, 0..1."""
    places = (np.arange(LEVELS) + 0.5) / LEVELS
    if colormap in GREYS:  # the one that needs no matplotlib
        return np.repeat(np.arange(LEVELS, dtype=np.float64)[:, None], 3, axis=1), places
    import matplotlib as mpl

    if colormap not in mpl.colormaps:
        raise FieldError(
            f"there is no colour map '{colormap}'; common ones are {', '.join(COMMON)} (_r: reversed), and "
            "matplotlib has more"
        )
    drawn = mpl.colormaps[colormap](places, bytes=True)[:, :3]
    colours, back, counts = np.unique(drawn, axis=0, return_inverse=True, return_counts=True)
    back = back.ravel()
    middle = np.bincount(back, places) / counts
    if mpl.colormaps[colormap].N >= LEVELS and np.abs(middle[back] - places).max() > 8 / LEVELS:
        raise FieldError(
            f"colour map '{colormap}' shows distant values in the same colour, so it cannot be undone; "
            f"render the map with another, e.g. {COMMON[0]}"
        )
    return colours.astype(np.float64), middle


def _open_picture(path: Path) -> Image.Image:
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, which have a limit of ours
            with Image.open(path) as picture:
                check_pixel_count(picture.height, picture.width, str(path))
                picture.load()
                return picture
    except FieldError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, struct.error, Image.DecompressionBombError) as error:
        raise FieldError(
            f"{path}: cannot be read as a picture ({str(error) or type(error).__name__}); is the file "
            "complete? Give a PNG, JPEG or WebP"
        ) from error


def _shares_of_white(picture: Image.Image, colormap: str | None, path: Path) -> NDArray[np.float64]:
    """Return the values of a grey picture of 16 bits, which has more levels than a colour map."""
    if colormap not in (None, *GREYS):
        raise FieldError(f"{path} is a grey picture; leave --field-colormap {colormap} out")
    return np.asarray(picture, dtype=np.float64) / 65535.0


def _shares_of_colours(picture: Image.Image, colormap: str | None, path: Path) -> tuple[NDArray[np.float64], str]:
    """Return the places along the colour map (H, W), and its name; transparent and foreign pixels are NaN."""
    rgba = np.asarray(picture.convert("RGBA"))
    colours, opaque = rgba[..., :3], rgba[..., 3] >= 128
    name = colormap or _grey_or_refuse(colours[opaque], path)
    shares = undo_colormap(colours, name)
    _check_share(shares[opaque], colours[opaque], name, path)
    return np.where(opaque, _without_edges(shares, opaque), np.nan), name


def _grey_or_refuse(colours: NDArray[np.uint8], path: Path) -> str:
    spread = np.ptp(colours.astype(np.int16), axis=-1)
    if (spread <= 8).mean() >= 0.95 if spread.size else True:
        return "gray"
    raise FieldError(
        f"{path} is coloured: say by which colour map with --field-colormap; {_guess(colours)}"
        f"common ones are {', '.join(COMMON)} (_r: reversed)"
    )


def _check_share(shares: NDArray[np.float64], colours: NDArray[np.uint8], name: str, path: Path) -> None:
    if shares.size and np.isfinite(shares).mean() < LEAST_SHARE:
        raise FieldError(
            f"{path}: only {np.isfinite(shares).mean():.0%} of the picture lies on colour map '{name}'; "
            f"{_guess(colours)}name the one it was rendered with, and crop axes, legends and margins away"
        )


def _guess(colours: NDArray[np.uint8]) -> str:
    """Return a sentence naming the common colour map that holds most of the colours, when one holds most."""
    some = colours[:: max(1, len(colours) // 20_000)]
    share, name = max((float(np.isfinite(undo_colormap(some, name)).mean()), name) for name in COMMON)
    return f"it looks like '{name}'; " if share >= 0.8 else ""


def _without_edges(shares: NDArray[np.float64], opaque: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Widen the gaps by a pixel: there, lines and labels blend into the map's colours."""
    from scipy.ndimage import binary_dilation

    off = np.isnan(shares) & opaque
    return np.where(binary_dilation(off, np.ones((3, 3), dtype=bool)), np.nan, shares)


def _check_range(value_range: tuple[float, float] | None, path: Path) -> tuple[float, float]:
    low, high = (0.0, 1.0) if value_range is None else value_range
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise FieldError(
            f"{path}: --field-range {low:g} {high:g}: give the values of the first and the last colour, the "
            "lower one first; a colour map that falls has a name that ends in _r"
        )
    return low, high


def _notes(path: Path, name: str, shares: NDArray[np.float64], *, stated: bool) -> tuple[str, ...]:
    gaps = float(np.isnan(shares).mean())
    undone = f"{path.name}: {gaps:.1%} of the pixels are transparent, or off colour map '{name}', and became gaps"
    if stated:
        return (undone,)
    return (undone, f"{path.name}: no --field-range given, so its values count as 0..1 without dimension")
