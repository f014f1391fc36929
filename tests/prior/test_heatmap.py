"""Heatmap pictures: undoing a rendered field gives the field back."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from sparsor.errors import FieldError
from sparsor.prior.heatmap import undo_colormap
from sparsor.prior.reading import read_field

BOX = (50.0, 24.0, 52.0, 25.5)


def hills(rows: int = 60, columns: int = 80) -> np.ndarray:
    row, column = np.mgrid[0:rows, 0:columns]
    wave = np.sin(row / 11) * np.cos(column / 13) + 0.3 * np.sin(column / 5)
    return (wave - wave.min()) / np.ptp(wave)


def render(values: np.ndarray, colormap: str) -> np.ndarray:
    return mpl.colormaps[colormap](values, bytes=True)[..., :3]


@pytest.mark.parametrize("colormap", ["viridis", "plasma", "inferno", "turbo", "jet", "hot", "YlOrRd", "gray_r"])
def test_a_rendered_field_comes_back(tmp_path: Path, colormap: str) -> None:
    Image.fromarray(render(hills(), colormap)).save(tmp_path / "a.png")
    field = read_field(tmp_path / "a.png", box=BOX, colormap=colormap)
    # jet shows up to four neighbouring levels in one colour, the others each level in its own.
    assert np.abs(field.values - hills()).max() < (2 if colormap == "jet" else 1) / 255
    assert field.edges_deg == pytest.approx((50, 24, 52, 25.5))
    assert field.unit == "1"
    assert "0.0% of the pixels" in field.notes[0]
    assert "0..1 without dimension" in field.notes[1]


@pytest.mark.parametrize("suffix", ["jpg", "webp", "png"])
def test_a_range_gives_values_and_lossy_pictures_are_tolerated(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(render(hills(), "viridis")).save(path, quality=85)
    field = read_field(path, box=BOX, colormap="viridis", value_range=(10.0, 60.0))
    error = field.values - (10 + 50 * hills())
    assert field.gap_fraction == 0
    assert np.sqrt(np.mean(error**2)) < 0.02 * 50
    assert (field.unit, len(field.notes)) == ("", 1)


def test_lines_labels_and_transparent_pixels_become_gaps(tmp_path: Path) -> None:
    rgba = np.dstack([render(hills(), "viridis"), np.full((60, 80), 255, dtype=np.uint8)])
    rgba[30, :, :3] = 0  # a border, drawn black
    rgba[5:10, 60:70, :3] = 255  # a label
    rgba[50:, :10, 3] = 0
    Image.fromarray(rgba).save(tmp_path / "a.png")
    field = read_field(tmp_path / "a.png", box=BOX, colormap="viridis")
    gaps = np.isnan(field.values)
    assert gaps[29:32].all()
    assert gaps[5:10, 60:70].all()
    assert gaps[50:, :10].all()
    assert gaps.sum() == 3 * 80 + 7 * 12 + 100
    assert np.nanmax(np.abs(field.values - hills())) < 1 / 255
    assert f"{gaps.mean():.1%} of the pixels" in field.notes[0]


@pytest.mark.parametrize("bits", [8, 16])
def test_a_grey_picture_needs_no_colour_map(tmp_path: Path, bits: int) -> None:
    scale, dtype = (255, np.uint8) if bits == 8 else (65535, np.uint16)
    Image.fromarray(np.round(hills() * scale).astype(dtype)).save(tmp_path / "a.png")
    field = read_field(tmp_path / "a.png", box=BOX)
    assert np.abs(field.values - hills()).max() < 1 / scale + (1 / 512 if bits == 8 else 0)


def test_the_nearest_colour_wins_and_distant_ones_are_gaps() -> None:
    colours = np.array([[68, 1, 84], [70, 3, 86], [255, 255, 255], [0, 0, 0]], dtype=np.uint8)
    shares = undo_colormap(colours, "viridis")
    assert (shares[:2] < 0.02).all()
    assert np.isnan(shares[2:]).all()


def test_unknown_missing_and_wrong_colour_maps_are_refused_with_advice(tmp_path: Path) -> None:
    Image.fromarray(render(hills(), "inferno")).save(tmp_path / "a.png")
    with pytest.raises(FieldError, match=r"say by which colour map.*looks like 'inferno'.*viridis, plasma"):
        read_field(tmp_path / "a.png", box=BOX)
    with pytest.raises(FieldError, match=r"no colour map 'viridi'; common ones are viridis"):
        read_field(tmp_path / "a.png", box=BOX, colormap="viridi")
    with pytest.raises(FieldError, match=r"% of the picture lies on colour map 'Blues'; it looks like 'inferno'"):
        read_field(tmp_path / "a.png", box=BOX, colormap="Blues")
    with pytest.raises(FieldError, match=r"distant values in the same colour"):
        read_field(tmp_path / "a.png", box=BOX, colormap="flag")


@pytest.mark.parametrize("value_range", [(1.0, 1.0), (2.0, 1.0), (0.0, np.nan)])
def test_an_empty_range_is_refused(tmp_path: Path, value_range: tuple[float, float]) -> None:
    Image.fromarray(render(hills(), "viridis")).save(tmp_path / "a.png")
    with pytest.raises(FieldError, match=r"--field-range"):
        read_field(tmp_path / "a.png", box=BOX, colormap="viridis", value_range=value_range)


@pytest.mark.parametrize("box", [(50, 25, 52, 24), (50, 24, 50, 25), (50, 24, np.nan, 25), (50, -95, 52, 25)])
def test_a_box_that_is_none_is_refused(tmp_path: Path, box: tuple[float, float, float, float]) -> None:
    Image.fromarray(render(hills(), "viridis")).save(tmp_path / "a.png")
    with pytest.raises(FieldError, match=r"--field-bbox .* is not a box"):
        read_field(tmp_path / "a.png", box=box, colormap="viridis")


def test_a_picture_may_cross_the_antimeridian(tmp_path: Path) -> None:
    Image.fromarray(render(hills(), "viridis")).save(tmp_path / "a.png")
    field = read_field(tmp_path / "a.png", box=(179, -18, -179, -17), colormap="viridis")
    assert field.edges_deg == pytest.approx((179, -18, 181, -17))


def test_pictures_without_a_box_and_broken_ones_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    Image.fromarray(render(hills(), "viridis")).save(path)
    with pytest.raises(FieldError, match=r"is a picture: say where it lies with --field-bbox"):
        read_field(path)
    with pytest.raises(FieldError, match=r"picture, which takes no --variable"):
        read_field(path, box=BOX, variable="no2")
    path.write_bytes(path.read_bytes()[:400])
    with pytest.raises(FieldError, match=r"a\.png: cannot be read as a picture.*is the file complete"):
        read_field(path, box=BOX, colormap="viridis")
    Image.fromarray(np.zeros((9, 9, 4), dtype=np.uint8)).save(path)
    with pytest.raises(FieldError, match=r"the field is empty"):
        read_field(path, box=BOX)
