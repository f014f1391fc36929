"""Pictures from arrays and outlines; matplotlib is imported by what draws, not by this package."""

from sparsor.plot.coastline import coastline
from sparsor.plot.picture import MissionPicture
from sparsor.plot.preview import mission_preview

__all__ = ["MissionPicture", "coastline", "mission_preview"]
