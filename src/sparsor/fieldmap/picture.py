"""The map as pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot.reconstruction import MapPicture

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.fieldmap.fieldmap import FieldMap, FlownSamples


def map_picture(field_map: FieldMap, samples: FlownSamples, caption: Sequence[str] = ()) -> MapPicture:
    """Return what the pictures of a map show: the map, the ways flown and the samples.

    Parameters
    ----------
    field_map : FieldMap
    samples : FlownSamples
    caption : sequence of str
        Lines beneath.
    """
    layers, box = field_map.layers(), field_map.grid.box
    outside = np.isnan(layers.values).ravel()
    used, places = samples.used, samples.places
    return MapPicture(
        title=f"{field_map.quantity} over {field_map.name}",
        box_deg=box.as_tuple(),
        east_m=box.east_m,
        north_m=box.north_m,
        values=layers.values,
        standard_deviation=layers.standard_deviation,
        label=field_map.quantity,
        unit=field_map.unit,
        tracks=tuple(places[samples.boot == boot] for boot in np.unique(samples.boot)),
        samples=places[used],
        sample_values=samples.air[used],
        left_out=places[~used],
        outside=outside if outside.any() else None,
        caption=tuple(caption),
    )
