"""`sparsor fetch` against a local server: files that `learn` and `study` read, with their source and licence."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest
import rasterio
import xarray as xr
from rasterio.transform import from_bounds
from typer.testing import CliRunner

from archive_server import serving
from sparsor.cli.main import app
from sparsor.errors import FieldError
from sparsor.prior.archives import catalogue, toms_field
from sparsor.prior.reading import read_field

RUN = CliRunner()


def toms(values):
    """A text grid as TEMIS writes it: south first, four characters a number, 20 a line."""
    rows, step = len(values), 180 / len(values)
    lines = ["Tropospheric NO2 month average", ""]
    for k, row in enumerate(values[::-1]):
        lines.append(f"lat= {-90 + step * (k + 0.5):8.3f}")
        numbers = [f"{one:4d}" for one in row]
        lines += ["".join(numbers[at : at + 20]) for at in range(0, len(numbers), 20)]
    assert rows > 1
    return gzip.compress("\n".join(lines).encode())


@pytest.fixture
def values():
    made = np.random.default_rng(1).integers(0, 9999, (18, 36))
    made[3, 5] = -999
    return made


@pytest.fixture
def archive(tmp_path, monkeypatch, values):
    monkeypatch.setenv("SPARSOR_CACHE_DIR", str(tmp_path / "cache"))
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    with serving() as one:
        one.files["/2020/09/no2.asc.gz"] = toms(values)
        raster = tmp_path / "raster.tif"
        place = {"crs": "EPSG:4326", "transform": from_bounds(-180, -90, 180, 90, 36, 18)}
        with rasterio.open(raster, "w", driver="GTiff", height=18, width=36, count=1, dtype="float32", **place) as file:
            file.write(np.where(values < 0, 99999.0, values).astype(np.float32), 1)
        one.files["/2020-09.tif"] = raster.read_bytes()
        one.catalogue = tmp_path / "catalogue.toml"
        one.catalogue.write_text(
            f"""
            [[archive]]
            name = "grid"
            title = "A grid"
            url = "{one.url}/{{year}}/{{month}}/no2.asc.gz"
            first = "2018-05"
            kind = "toms"
            unit = "1e15 molecules cm-2"
            scale = 0.01
            missing_below = 0.0
            licence = "free with credit"

            [[archive]]
            name = "picture"
            title = "A raster"
            url = "{one.url}/{{year}}-{{month}}.tif"
            first = "2004-10"
            kind = "raster"
            unit = "u"
            missing_from = 99999.0
            licence = "free"
            """
        )
        yield one


def fetched(archive, *words):
    return RUN.invoke(app, ["fetch", *words, "--catalogue", str(archive.catalogue)])


def test_a_month_becomes_a_field_with_source_licence_and_checksum(archive, tmp_path, values):
    ran = fetched(archive, "grid", "--month", "2020-09", "-o", str(tmp_path), "--json")
    assert ran.exit_code == 0, ran.output
    (file,) = json.loads(ran.stdout)["files"]
    field = read_field(file["file"])
    assert field.unit == "1e15 molecules cm-2"
    np.testing.assert_allclose(field.in_memory, np.where(values < 0, np.nan, values * 0.01), rtol=1e-6)
    assert (field.lat_deg[0], field.lon_deg[0]) == (85.0, -175.0)
    with xr.open_dataset(file["file"]) as dataset:
        assert dataset.attrs["license"] == "free with credit"
        assert dataset.attrs["url"] == file["url"] == f"{archive.url}/2020/09/no2.asc.gz"
        assert dataset.attrs["sha256_of_original"] == file["sha256"]
        assert "A grid, 2020-09" in dataset.attrs["source"]


def test_only_the_part_asked_for_and_gaps_of_rasters(archive, tmp_path, values):
    ran = fetched(
        archive, "picture", "--month", "2020-09", "-o", str(tmp_path), "-q", "--bbox", "-140", "30", "-80", "70"
    )
    assert ran.exit_code == 0, ran.output
    field = read_field(ran.stdout.strip())
    assert field.values.shape == (4, 6)
    expected = np.where(values < 0, np.nan, values)[2:6, 4:10]
    np.testing.assert_allclose(field.in_memory, expected)


def test_the_second_time_the_network_is_not_asked_and_the_file_is_the_same(archive, tmp_path):
    contents = []
    for folder in ("one", "two"):
        assert fetched(archive, "grid", "--month", "2020-09", "-o", str(tmp_path / folder)).exit_code == 0
        contents.append(read_field(tmp_path / folder / "no2-grid-2020-09.nc").in_memory)
    np.testing.assert_array_equal(*contents)
    assert len(archive.asked) == 1


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("grid", "--month", "2020-13"), 2, "not a month"),
        (("grid", "--month", "2010-01"), 2, "begins with 2018-05"),
        (("other", "--month", "2020-09"), 2, "known are grid, picture"),
        (("grid", "--month", "2020-10"), 1, "404"),
        (("grid",), 2, "--month"),
        (("grid", "--month", "2020-09", "--bbox", "9", "0", "8", "1"), 2, "west south east north"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_written(archive, tmp_path, words, code, says):
    ran = fetched(archive, *words, "-o", str(tmp_path / "out"))
    assert ran.exit_code == code
    assert says in ran.output
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_there_is_kept_unless_forced(archive, tmp_path):
    there = tmp_path / "no2-grid-2020-09.nc"
    there.write_text("mine")
    ran = fetched(archive, "grid", "--month", "2020-09", "-o", str(tmp_path))
    assert ran.exit_code == 1
    assert "--force" in ran.output
    assert there.read_text() == "mine"
    assert fetched(archive, "grid", "--month", "2020-09", "-o", str(tmp_path), "--force").exit_code == 0


@pytest.mark.parametrize(
    "content", [b"", b"\x1f\x8bnot gzip", b"lat= 1\n 1 2\nlat= 2\n   1", b"lat= 1\nabcd\nlat= 2\n   1"]
)
def test_a_damaged_grid_is_refused(content):
    with pytest.raises(FieldError, match="made"):
        toms_field(content, "made")


def test_the_packaged_catalogue_names_months_sources_and_licences():
    known = {one.name: one for one in catalogue().archive}
    assert set(known) == {"omi", "tropomi"}
    assert known["omi"].url_of("2020-09").endswith("AURA_NO2_M_2020-09.FLOAT.TIFF")
    assert known["tropomi"].url_of("2020-09").endswith("/2020/09/no2_202009.asc.gz")
    assert all(one.licence and one.unit for one in known.values())
    assert RUN.invoke(app, ["fetch"]).exit_code == 0
