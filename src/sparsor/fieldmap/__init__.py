"""The map: samples to measurements (response, drift, faults, units), and the map with its uncertainty to files."""

from sparsor.fieldmap.fieldmap import FieldMap, FlownSamples
from sparsor.fieldmap.geotiff import map_geotiff
from sparsor.fieldmap.measuring import Measured, measure
from sparsor.fieldmap.netcdf import map_netcdf
from sparsor.fieldmap.samples_csv import samples_csv

__all__ = ["FieldMap", "FlownSamples", "Measured", "map_geotiff", "map_netcdf", "measure", "samples_csv"]
