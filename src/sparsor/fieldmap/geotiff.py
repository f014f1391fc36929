"""The map as GeoTIFF: value, standard deviation, and whether a cell was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sparsor.fieldmap.fieldmap import FieldMap


def map_geotiff(field_map: FieldMap) -> bytes:
    """Return a GeoTIFF of three float32 bands on EPSG:4326, north up; NaN where the map says nothing.

    Bands, with description and unit: the value, its standard deviation, and 1 where the cell was measured, else 0.
    The tags say how the map was made.
    """
    from rasterio.io import MemoryFile
    from rasterio.transform import from_origin

    layers = field_map.layers()
    measured = np.where(np.isnan(layers.values), np.nan, layers.measured)
    bands = (
        (field_map.quantity, field_map.unit, layers.values),
        (_deviation(field_map), field_map.unit, layers.standard_deviation),
        ("measured", "1", measured),
    )
    rows, columns = layers.values.shape
    with MemoryFile() as memory:
        with memory.open(
            driver="GTiff",
            height=rows,
            width=columns,
            count=len(bands),
            dtype="float32",
            crs="EPSG:4326",
            transform=from_origin(layers.west_deg, layers.north_deg, *layers.pixel_deg),
            nodata=np.nan,
            compress="deflate",
            predictor=3,
        ) as dataset:
            dataset.update_tags(AREA_OR_POINT="Area", **field_map.facts)
            for number, (description, unit, values) in enumerate(bands, start=1):
                dataset.write(values.astype(np.float32), number)
                dataset.set_band_description(number, description)
                dataset.set_band_unit(number, unit)
        return bytes(memory.read())


def _deviation(field_map: FieldMap) -> str:
    rows, columns = field_map.grid.shape
    of = "" if field_map.factor == 1 else f" (of the cell of the {rows} x {columns} grid around)"
    return f"standard deviation of {field_map.quantity}{of}"
