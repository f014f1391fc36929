"""The sidecar: what a mission was planned with comes back whole; a damaged one is a sentence."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.mission.sidecar import Sidecar, read_sidecar, sidecar_npz
from sparsor.prior.model import Model
from sparsor.prior.statistics import Kernel
from sparsor.vehicle import load_sensor
from strategies import grids

ARRAYS = ("dictionary", "mean", "covariance_factor", "validation")


def make(grid=None, seed=0, **changes):
    grid = grid or Grid(BoundingBox(51.50, 25.27, 51.53, 25.30), (6, 5))
    rng = np.random.default_rng(seed)
    dictionary = rng.normal(size=(grid.size, 4))
    model = Model(
        shape=grid.shape,
        dictionary=dictionary / np.linalg.norm(dictionary, axis=0),
        mean=rng.random(grid.size),
        covariance_factor=rng.normal(size=(grid.size, 3)),
        kernel=Kernel(0.1, 7.5, 0.01),
        lasso_weight=1e-3,
        validation=rng.random((2, grid.size)),
        scale=(3.25, 77.5),
        unit="umol m-2",
        window_m=(3021.5, 3323.25),
        provenance={"source": "synthetic"},
    )
    allowed = np.arange(grid.size) != 1
    phi = (rng.random((3, grid.size)) < 0.5) & allowed
    known = {
        "name": "m", "grid": grid, "allowed": allowed, "model": model, "phi": phi,
        "stops": rng.permutation(np.flatnonzero(phi.any(axis=0))), "altitude_m": 61.25, "hold_s": 2.5,
        "home": (51.5012345678, 25.2712345678, -3.0625), "home_altitude_known": True, "lasso_weight": 3e-4,
        "expected": {"relative_error": 1 / 3}, "plans": {"m.plan": "0" * 64},
        "sensor": load_sensor().model_copy(update={"t90_s": 12.5, "range": (0.0, 500.0)}) if seed % 2 else None,
        "flown": np.flatnonzero(~phi.any(axis=0))[: seed % 3],
    }  # fmt: skip
    return Sidecar(**{**known, **changes})


def write(tmp_path, content):
    path = tmp_path / "m.npz"
    path.write_bytes(content)
    return path


@settings(
    deadline=None, max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(grid=grids(largest=8).filter(lambda grid: grid.size < 100) | grids(largest=8, across=True), seed=st.integers(0))
def test_what_was_written_is_read(tmp_path, grid, seed):
    sidecar = make(grid, seed % 2**32)
    content = sidecar_npz(sidecar)
    again = read_sidecar(write(tmp_path, content))
    assert again.grid == grid
    assert again.kept_out is None
    for name in ("phi", "stops", "allowed", "flown"):
        written, read = getattr(sidecar, name), getattr(again, name)
        assert read.dtype == written.dtype
        assert np.array_equal(read, written)
    for name in (
        "name",
        "altitude_m",
        "hold_s",
        "home",
        "home_altitude_known",
        "lasso_weight",
        "expected",
        "plans",
        "sensor",
    ):
        assert getattr(again, name) == getattr(sidecar, name)
    for name in ("shape", "kernel", "lasso_weight", "scale", "unit", "window_m", "provenance"):
        assert getattr(again.model, name) == getattr(sidecar.model, name)
    for name in ARRAYS:  # the large ones are kept in single precision
        np.testing.assert_allclose(getattr(again.model, name), getattr(sidecar.model, name), rtol=1e-6, atol=1e-7)
    assert sidecar_npz(again) == content


def test_what_is_kept_out_of_is_a_mask_of_its_own(tmp_path):
    sidecar = make()
    kept_out = np.arange(sidecar.grid.size) == 3
    again = read_sidecar(write(tmp_path, sidecar_npz(replace(sidecar, kept_out=kept_out))))
    assert again.kept_out.tolist() == kept_out.tolist()
    # A file without one, as those before had none, is the same bytes as ever.
    assert sidecar_npz(replace(sidecar, kept_out=~sidecar.allowed & False)) == sidecar_npz(sidecar)
    with pytest.raises(MissionError, match="do not fit a grid"):
        read_sidecar(write(tmp_path, sidecar_npz(replace(sidecar, kept_out=kept_out[1:] | True))))


def test_it_holds_plain_arrays_that_numpy_reads_without_pickle(tmp_path):
    with np.load(write(tmp_path, sidecar_npz(make())), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    assert all(array.dtype != object for array in arrays.values())
    assert json.loads(str(arrays["sidecar"]))["bbox"] == [51.50, 25.27, 51.53, 25.30]


def altered(content, **changes):
    """Return a good sidecar with arrays replaced, or taken out (None)."""
    with np.load(io.BytesIO(content)) as stored:
        arrays = {name: stored[name] for name in stored.files}
    arrays |= changes
    buffer = io.BytesIO()
    np.savez(buffer, **{name: array for name, array in arrays.items() if array is not None})
    return buffer.getvalue()


def about(content, **changes):
    with np.load(io.BytesIO(content)) as stored:
        return altered(content, sidecar=np.array(json.dumps({**json.loads(str(stored["sidecar"])), **changes})))


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda _: b"", "cannot be read as .npz"),
        (lambda _: b"words", "cannot be read as .npz"),
        (lambda good: good[: len(good) // 2], "cannot be read as .npz"),
        (lambda good: good[:400] + bytes(200) + good[600:], "m.npz"),
        (lambda good: altered(good, sidecar=None), "not a sidecar"),
        (lambda good: altered(good, phi=None), "not a sidecar"),
        (lambda good: altered(good, model=None), "not a sparsor model"),
        (lambda good: about(good, sensor={"name": "x", "t90_s": -1}), "sensor that cannot be used"),
        (lambda good: altered(good, phi=np.ones((3, 4), bool)), "do not fit a grid of 6 x 5"),
        (lambda good: altered(good, stops=np.array([0, 30])), "do not fit a grid of 6 x 5"),
        (lambda good: altered(good, stops=np.array([-1, 3])), "do not fit a grid of 6 x 5"),
        (lambda good: altered(good, sidecar=np.array("{")), "not a sidecar"),
        (lambda good: altered(good, phi=np.array([{}], dtype=object)), "cannot be read as .npz"),
        (lambda good: about(good, format="sparsor sidecar 9"), "this version reads 'sparsor sidecar 1'"),
        (lambda good: about(good, bbox=[51.53, 25.27, 51.5, 25.3]), "swapped"),
        (lambda good: about(good, bbox=[51.5, 25.27]), "not a sidecar"),
        (lambda good: about(good, home=[51.5]), "not a sidecar"),
        (lambda good: about(good, shape=[900, 2]), "not a sidecar"),
    ],
)
def test_a_damaged_sidecar_is_a_sentence(tmp_path, damage, said):
    path = write(tmp_path, damage(sidecar_npz(make())))
    with pytest.raises(MissionError, match=said) as caught:
        read_sidecar(path)
    assert str(path) in str(caught.value)


def test_a_missing_sidecar_is_a_sentence(tmp_path):
    with pytest.raises(MissionError, match="No such file"):
        read_sidecar(tmp_path / "none.npz")


def test_it_is_a_zip_without_the_time_of_writing(tmp_path):
    with zipfile.ZipFile(write(tmp_path, sidecar_npz(make()))) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
