"""Pictures from arrays and outlines; matplotlib is imported by what draws, not by this package."""

from sparsor.plot.budgets import BudgetCurve, budget_curve_png
from sparsor.plot.coastline import coastline
from sparsor.plot.picture import MissionPicture
from sparsor.plot.preview import mission_preview
from sparsor.plot.profile import HeightProfile, height_profile_png
from sparsor.plot.reconstruction import MapPicture, map_png, reconstruction_png, uncertainty_png

__all__ = [
    "BudgetCurve",
    "HeightProfile",
    "MapPicture",
    "MissionPicture",
    "budget_curve_png",
    "coastline",
    "height_profile_png",
    "map_png",
    "mission_preview",
    "reconstruction_png",
    "uncertainty_png",
]
