"""Laws of the built-in synthetic field: nothing here depends on stored numbers."""

import numpy as np
import pytest

from sparsor.errors import FieldError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.prior.synthetic import (
    DOMAIN,
    UNIT,
    SyntheticField,
    covers,
    gulf_values,
    synthetic_maps,
    windows,
)
from sparsor.prior.synthetic_inventory import cities, plants, roads
from sparsor.prior.synthetic_puffs import M_PER_DEG, Puffs

GULF = (45.5, 22.0, 58.1, 31.0)
QATAR = (50.5, 24.4, 51.9, 26.3)
DOHA = (51.4, 25.1, 51.7, 25.4)
A_FLIGHT = (51.50, 25.27, 51.53, 25.30)
SIZES_KM = (1.0, 3.0, 30.0, 300.0, 1300.0)


def square(lon_deg: float, lat_deg: float, side_m: float) -> tuple[float, float, float, float]:
    north = side_m / M_PER_DEG / 2
    east = north / np.cos(np.radians(lat_deg))
    return lon_deg - east, lat_deg - north, lon_deg + east, lat_deg + north


def inside(lon, lat, box) -> int:
    west, south, east, north = box
    return int(((lon >= west) & (lon <= east) & (lat >= south) & (lat <= north)).sum())


def test_the_inventory_is_large_enough_and_says_where_it_comes_from():
    towns, works = cities(), plants()
    assert inside(works.lon_deg, works.lat_deg, GULF) >= 150
    assert inside(towns.lon_deg, towns.lat_deg, GULF) >= 150
    assert all(works.source)
    assert (works.position_error_km > 0).all()
    assert (works.strength_mw > 0).all()
    assert inside(works.lon_deg, works.lat_deg, DOMAIN) == works.lon_deg.size
    # A window of 1300 km finds sources on every side of the Gulf too.
    for lon, lat in ((41.0, 18.0), (39.0, 34.0), (64.0, 34.0), (64.0, 27.0)):
        assert inside(towns.lon_deg, towns.lat_deg, (lon - 4, lat - 4, lon + 4, lat + 4)) > 20


def test_roads_join_different_towns():
    assert (roads().length_m > 0).all()


def test_the_same_seed_gives_the_same_field():
    lon, lat = np.linspace(50.5, 51.9, 7), 25.3
    once = SyntheticField(5).values(lon, lat, 500.0)
    assert (once == SyntheticField(5).values(lon, lat, 500.0)).all()
    assert not np.isclose(once, SyntheticField(6).values(lon, lat, 500.0)).any()


def test_the_same_seed_gives_the_same_maps():
    once = synthetic_maps((3000.0, 2000.0), (8, 12), 30, 3, "training")
    assert once.shape == (30, 96)
    assert (once == synthetic_maps((3000.0, 2000.0), (8, 12), 30, 3, "training")).all()
    assert not (once == synthetic_maps((3000.0, 2000.0), (8, 12), 30, 4, "training")).any()


@pytest.mark.parametrize("box", [GULF, QATAR, DOHA, A_FLIGHT])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_cell_holds_the_mean_of_the_small_cells_in_it(box, seed):
    """To 3 % of the map's mean in one cell (root mean square), to 0.5 % over the map."""
    field = SyntheticField(seed)
    coarse = field.on_raster(box, (32, 32))
    fine = field.on_raster(box, (128, 128)).reshape(32, 4, 32, 4).mean(axis=(1, 3))
    assert np.sqrt(((coarse - fine) ** 2).mean()) < 0.03 * coarse.mean()
    assert coarse.mean() == pytest.approx(fine.mean(), rel=0.005)


@pytest.mark.parametrize("side_m", [1500.0, 30_000.0, 300_000.0])
def test_points_and_rasters_agree(side_m):
    box = square(51.5, 25.3, side_m)
    lon, lat = Grid(BoundingBox(*box), (16, 16)).centres_deg()
    field = SyntheticField(0)
    raster = field.on_raster(box, (16, 16)).ravel()
    # Cells of a raster grow wider to the south, square ones do not; wide puffs are averaged to 0.1 %.
    tolerance = 2e-3 + side_m / 3e6
    np.testing.assert_allclose(field.values(lon, lat, side_m / 16), raster, rtol=tolerance)


def test_a_value_does_not_depend_on_what_else_is_asked():
    field = SyntheticField(2)
    lon, lat = np.array([51.50, 51.52, 51.60]), np.array([25.28, 25.29, 25.40])
    together = field.values(lon, lat, 30.0)
    alone = [float(field.values(*point, 30.0)) for point in zip(lon, lat, strict=True)]
    np.testing.assert_allclose(together, alone, rtol=1e-4)


@pytest.mark.parametrize("cell_m", [30.0, 3000.0, 100_000.0])
def test_values_are_positive_and_finite_everywhere(cell_m):
    draw = np.random.default_rng(0)
    west, south, east, north = DOMAIN
    lon, lat = draw.uniform(west, east, 60), draw.uniform(south, north, 60)
    corners_lon, corners_lat = np.array([west, west, east, east]), np.array([south, north, south, north])
    values = SyntheticField(3).values(np.r_[lon, corners_lon], np.r_[lat, corners_lat], cell_m)
    assert np.isfinite(values).all()
    assert (values > 0).all()
    assert (values < 5000).all()


def test_values_broadcast():
    field = SyntheticField(0)
    lon, lat = np.array([[51.4, 51.5, 51.6]]), np.array([[25.2], [25.3]])
    assert field.values(lon, lat, 1000.0).shape == (2, 3)
    assert field.values(51.4, 25.2, 1000.0).shape == ()
    assert field.values([], [], 1000.0).shape == (0,)


@pytest.mark.parametrize("size_km", SIZES_KM)
def test_training_and_validation_windows_never_overlap(size_km):
    side = (size_km * 1000.0, size_km * 1000.0)
    training, validation = windows(side, 300, 1, "training"), windows(side, 100, 1, "validation")
    for box in (training, validation):
        assert (box[:, :2] >= np.array(DOMAIN[:2])).all()
        assert (box[:, 2:] <= np.array(DOMAIN[2:])).all()
        middle = np.cos(np.radians((box[:, 1] + box[:, 3]) / 2))
        np.testing.assert_allclose((box[:, 2] - box[:, 0]) * middle * M_PER_DEG, side[0])
        np.testing.assert_allclose((box[:, 3] - box[:, 1]) * M_PER_DEG, side[1])
    apart_east = (training[:, None, 0] >= validation[None, :, 2]) | (training[:, None, 2] <= validation[None, :, 0])
    assert apart_east.all()


def test_training_and_validation_maps_differ():
    training = synthetic_maps((5000.0, 5000.0), (8, 8), 20, 1, "training")
    validation = synthetic_maps((5000.0, 5000.0), (8, 8), 20, 1, "validation")
    assert not np.isclose(training, validation).any()


@pytest.mark.parametrize("size_km", SIZES_KM)
def test_maps_are_neither_blank_nor_all_alike(size_km):
    maps = synthetic_maps((size_km * 1000.0,) * 2, (32, 32), 60, 2, "training")
    assert np.median(maps.std(axis=1) / maps.mean(axis=1)) > 0.02
    centred = maps - maps.mean(axis=1, keepdims=True)
    values = np.linalg.svd(centred - centred.mean(axis=0), compute_uv=False) ** 2
    # A map of 1 km is little wider than what mixing leaves of a feature: it is little more than a slope.
    assert np.searchsorted(np.cumsum(values) / values.sum(), 0.95) + 1 >= (2 if size_km < 3 else 5)


def test_the_reference_is_the_raster_of_seed_0():
    grid = Grid(BoundingBox(*A_FLIGHT))
    assert (gulf_values(grid) == SyntheticField(0).on_raster(A_FLIGHT, (32, 32)).ravel()).all()
    assert UNIT == "umol m-2"


def test_row_0_is_north():
    raster = SyntheticField(0).on_raster(GULF, (9, 12))
    north = SyntheticField(0).on_raster((45.5, 30.0, 58.1, 31.0), (1, 12))
    np.testing.assert_allclose(raster[0], north[0], rtol=0.01)


def test_outside_the_domain_is_refused():
    assert covers(GULF)
    assert covers(DOMAIN)
    assert not covers((-1.0, 51.0, 1.0, 52.0))
    assert not covers((179.0, 20.0, -179.0, 21.0))
    with pytest.raises(FieldError, match="not inside the synthetic field's domain, 35 to 68 E"):
        gulf_values(Grid(BoundingBox(-0.1, 51.4, 0.1, 51.6)))
    with pytest.raises(FieldError, match="the point 25 51"):
        SyntheticField(0).values(25.0, 51.0, 100.0)


def test_impossible_requests_are_refused():
    with pytest.raises(FieldError, match=r"a cell of 0\.1 m"):
        SyntheticField(0).values(51.0, 25.0, 0.1)
    with pytest.raises(FieldError, match="windows of 2000 x 2000 km do not fit"):
        synthetic_maps((2e6, 2e6), (32, 32), 1, 1, "training")
    with pytest.raises(FieldError, match="'training' or 'validation'"):
        synthetic_maps((1e4, 1e4), (32, 32), 1, 1, "test")


@pytest.mark.parametrize("sigma_m", [50.0, 900.0, 1100.0, 20_000.0])
def test_puffs_keep_their_mass(sigma_m):
    puff = Puffs(np.array([51.0]), np.array([25.0]), np.array([sigma_m]), np.array([1e9]))
    west, south, east, north = square(51.0, 25.0, 250_000.0)
    lon_edges, lat_edges = np.linspace(west, east, 251), np.linspace(north, south, 251)
    cell_m2 = np.diff(lon_edges).mean() * puff.m_per_deg_lon * -np.diff(lat_edges).mean() * M_PER_DEG
    assert (puff.on_raster(lon_edges, lat_edges).sum() * cell_m2)[0] == pytest.approx(1e9, rel=1e-6)
