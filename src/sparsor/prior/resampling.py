"""Values between pixels, means over cells, and gaps filled from their rims."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from sparsor.prior.field import Field


def resample_bilinear(values: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return a raster over the same extent with another number of pixels, bilinear between pixel centres.

    Parameters
    ----------
    values : array_like (rows, columns)
        Gaps are NaN.
    shape : tuple of int
        Rows and columns wanted.

    Returns
    -------
    array of float64, of `shape`
        In the half pixel outside the outer centres the edge value is kept; a pixel is a gap where gaps hold
        more than half of its weight.

    Examples
    --------
    >>> resample_bilinear([[0.0, 1.0], [0.0, 1.0]], (2, 4))[0].tolist()
    [0.0, 0.25, 0.75, 1.0]
    """
    array = np.asarray(values, dtype=np.float64)
    row, column = (
        (np.arange(wanted) + 0.5) * (native / wanted) - 0.5 for wanted, native in zip(shape, array.shape, strict=True)
    )
    return bilinear_at(array, row[:, None], column[None, :])


def sample_at(field: Field, lon_deg: ArrayLike, lat_deg: ArrayLike) -> NDArray[np.float64]:
    """Return the field's values at points, bilinear between pixel centres.

    Parameters
    ----------
    field : Field
        What is sampled.
    lon_deg, lat_deg : array_like
        Degrees, broadcast against each other; longitudes count modulo 360.

    Returns
    -------
    array of float64
        In the field's unit; NaN outside the field's outer pixel edges and where gaps hold more than half of
        the weight.
    """
    lon, lat = np.broadcast_arrays(np.asarray(lon_deg, dtype=np.float64), np.asarray(lat_deg, dtype=np.float64))
    width, height = field.pixel_deg
    west = field.edges_deg[0]
    # A hair before the western edge, so that points on that edge stay inside whatever turn they came by.
    column = ((lon - west + 1e-9) % 360.0 - 1e-9) / width - 0.5
    row = (field.lat_deg[0] - lat) / height
    if isinstance(field.values, np.ndarray):
        return bilinear_at(field.values, row, column)
    around = [_around(place, size) for place, size in zip((row, column), field.values.shape, strict=True)]
    return bilinear_at(field.values[around[0], around[1]], row - around[0].start, column - around[1].start)


def _around(place: NDArray[np.float64], size: int) -> slice:
    """Return the pixels of an axis that places lie between."""
    first = int(np.clip(np.floor(place.min()), 0, size - 1))
    return slice(first, int(np.clip(np.ceil(place.max()) + 1, first + 1, size)))


def bilinear_at(
    values: NDArray[np.float64], row: NDArray[np.float64], column: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return values at fractional places in pixels, bilinear between pixel centres.

    Parameters
    ----------
    values : array of float64 (rows, columns)
        Gaps are NaN.
    row, column : array of float64
        Places, pixel centres at whole numbers, broadcast against each other; may be NaN.

    Returns
    -------
    array of float64
        In the half pixel outside the outer centres the edge value; NaN beyond, and where gaps hold more than
        half of the weight.
    """
    edge = 0.5 + 1e-6
    inside = (row >= -edge) & (row <= values.shape[0] - 1 + edge)
    inside = inside & (column >= -edge) & (column <= values.shape[1] - 1 + edge)
    last_row, last_column = values.shape[0] - 1, values.shape[1] - 1
    row0, row_part = _split(np.nan_to_num(row), last_row)
    column0, column_part = _split(np.nan_to_num(column), last_column)
    total = np.zeros(np.broadcast_shapes(row.shape, column.shape))
    weight = np.zeros(total.shape)
    for below, row_weight in ((0, 1.0 - row_part), (1, row_part)):
        for right, column_weight in ((0, 1.0 - column_part), (1, column_part)):
            corner = values[np.minimum(row0 + below, last_row), np.minimum(column0 + right, last_column)]
            finite = np.isfinite(corner)
            share = row_weight * column_weight * finite
            total += share * np.where(finite, corner, 0.0)
            weight += share
    kept = inside & (weight >= 0.5 - 1e-12)
    return np.where(kept, total / np.where(kept, weight, 1.0), np.nan)


def cell_means(
    values: NDArray[np.float64], bounds: tuple[float, float, float, float], shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Return area-weighted means of a window of pixels over a grid of equal cells.

    One axis is averaged after the other: differences of the running integral at the edges of the cells.
    Inside a pixel values rise as from its one neighbour to the other, its mean kept (conservative remapping
    of second order). So whole pixels give their plain mean, and a plane stays a plane however cells cut
    pixels; beside a lone spike a mean may undershoot a little.

    Parameters
    ----------
    values : array of float64 (H, W)
        Without gaps.
    bounds : tuple of float
        Top, bottom, left, right of the window in pixels from the outer north-west corner,
        ``0 <= top < bottom <= H`` and ``0 <= left < right <= W``; they may lie inside pixels.
    shape : tuple of int
        Rows and columns of cells.

    Returns
    -------
    array of float64, of `shape`

    Examples
    --------
    >>> cell_means(np.array([[0.0, 3.0, 6.0, 9.0]]), (0, 1, 0.5, 3.5), (1, 2)).round(9).tolist()
    [[2.25, 6.75]]
    """
    top, bottom, left, right = bounds
    over_rows = _means_down(values, np.linspace(top, bottom, shape[0] + 1))
    return _means_down(over_rows.T, np.linspace(left, right, shape[1] + 1)).T


def fill_gaps(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the raster with its gaps filled linearly, beyond the hull of the values by the nearest one.

    Only the rim of each gap is triangulated. A pixel whose neighbours all have values shares its Delaunay
    edges with these alone, so the triangles over the gaps are those of all the pixels together (or as
    good ones: on a lattice, Delaunay leaves the choice between diagonals).

    Parameters
    ----------
    values : array of float64 (rows, columns)
        Gaps are NaN; at least one value has to be finite.
    """
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.ndimage import binary_dilation
    from scipy.spatial import QhullError
    from threadpoolctl import threadpool_limits

    gap = ~np.isfinite(values)
    if not gap.any():
        return values
    rim = np.argwhere(binary_dilation(gap, np.ones((3, 3), dtype=bool)) & ~gap)
    known = values[rim[:, 0], rim[:, 1]]
    wanted = np.argwhere(gap)
    try:
        # One small system a triangle: on a busy machine BLAS's threads made this thirty times slower.
        with threadpool_limits(1, "blas"):
            filled = np.asarray(LinearNDInterpolator(rim, known)(wanted))
    except (QhullError, ValueError):  # a rim along one line, or of fewer than three pixels: no triangles
        filled = np.full(len(wanted), np.nan)
    beyond = ~np.isfinite(filled)
    if beyond.any():
        filled[beyond] = NearestNDInterpolator(rim, known)(wanted[beyond])
    result = values.copy()
    result[gap] = filled
    return result


def _means_down(values: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means between successive edges along the first axis, (edges - 1, columns)."""
    # Not a product with a matrix of weights: products this small spend their time waking BLAS's threads.
    integral = np.zeros((len(values) + 1, values.shape[1]))
    np.cumsum(values, axis=0, out=integral[1:])
    whole = np.minimum(np.floor(edges).astype(np.intp), len(values) - 1)
    part = (edges - whole)[:, None]
    at_edges = integral[whole] + part * values[whole] + part * (part - 1) / 2 * _slopes(values)[whole]
    return np.diff(at_edges, axis=0) / np.diff(edges)[:, None]


def _slopes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rise over each pixel along the first axis, as its neighbours have it."""
    return np.gradient(values, axis=0) if len(values) > 1 else np.zeros_like(values)


def _split(place: NDArray[np.float64], last: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    clamped = np.clip(place, 0.0, last)
    whole = np.floor(clamped).astype(np.intp)
    return whole, clamped - whole
