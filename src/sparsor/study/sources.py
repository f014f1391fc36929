"""Fields as the study takes them: resampled to the paper's pixels, cut into its windows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.geodesy import BoundingBox, Grid
from sparsor.prior.field import Field
from sparsor.prior.synthetic import UNIT, gulf_values
from sparsor.study.protocol import PAPER_PIXELS, study_maps
from sparsor.study.scoreboard import Source
from sparsor.study.store import field_hash

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# As the OMI field of the Gulf lies: 0.1 degree.
_BUILTIN_BOX, _BUILTIN_SHAPE = (45.5, 22.0, 58.1, 31.0), (90, 126)


def source_of(field: Field) -> Source:
    """Return a field with its windows; one of the paper's pixels is not resampled."""
    pixels = None if field.values.shape == PAPER_PIXELS else PAPER_PIXELS
    return Source(field, study_maps(field, pixels), pixels, field_hash(field))


def builtin_field() -> Field:
    """Return the built-in synthetic field of the Gulf, at 0.1 degree."""
    grid = Grid(BoundingBox(*_BUILTIN_BOX), _BUILTIN_SHAPE)
    lon, lat = (_axes(part) for part in grid.centres_deg())
    values = gulf_values(grid).reshape(_BUILTIN_SHAPE)
    return Field(values, lon[0], lat[:, 0], UNIT, "built-in synthetic NO2 field of the Gulf, 0.1 degree")


def _axes(part: NDArray[np.float64]) -> NDArray[np.float64]:
    return part.reshape(_BUILTIN_SHAPE)
