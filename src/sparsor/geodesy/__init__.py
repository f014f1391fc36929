"""Where: bounding boxes, the grid over them, geodesic lengths, areas."""

from sparsor.geodesy.areas import Area, cells_inside, read_area
from sparsor.geodesy.box import BoundingBox
from sparsor.geodesy.grid import Grid

__all__ = ["Area", "BoundingBox", "Grid", "cells_inside", "read_area"]
