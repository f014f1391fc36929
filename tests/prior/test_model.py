"""The model file: what goes in comes out, and of a broken one no more than a sentence."""

from __future__ import annotations

import io
import json
import pickle
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.errors import ModelError
from sparsor.prior.model import Model, arrays_to_npz, model_arrays, model_from_arrays, model_from_npz, read_model
from sparsor.prior.statistics import Kernel

LARGE = ("dictionary", "covariance_factor", "validation")


def made(seed=0, shape=(3, 4), atoms=5, *, centred=True):
    rng = np.random.default_rng(seed)
    N = shape[0] * shape[1]
    psi = rng.normal(size=(N, atoms))
    return Model(
        shape=shape,
        dictionary=psi / np.linalg.norm(psi, axis=0),
        mean=rng.random(N) if centred else np.zeros(N),
        covariance_factor=0.3 * rng.normal(size=(N, 3)),
        kernel=Kernel(1 / 30, 1 / 0.7, 0.1 / 3),
        lasso_weight=1e-3 / 7,
        validation=rng.random((2, N)),
        scale=(-1 / 3, 1e16 / 3),
        unit="molecules/cm²",
        window_m=(3000.1, 2999.9),
        provenance={"source": "a made field, größer", "seed": str(seed)},
    )


GOOD = arrays_to_npz(model_arrays(made()))


def with_about(**changed):
    """The arrays of a good model, with some of its small values replaced (or removed, by None)."""
    arrays = model_arrays(made())
    about = json.loads(str(arrays["model"])) | changed
    return arrays | {"model": np.array(json.dumps({key: value for key, value in about.items() if value is not None}))}


def assert_only_model_errors(contents):
    """Damaged files give a ModelError that names them, or, where the damage is in what nobody reads, the model."""
    good, refused = model_arrays(made()), 0
    for content in contents:
        try:
            arrays = model_arrays(model_from_npz(content, "broken.npz"))
        except ModelError as error:
            assert "broken.npz" in str(error)
            refused += 1
        else:
            for name, array in good.items():
                np.testing.assert_array_equal(arrays[name], array)
    return refused


@settings(max_examples=20, deadline=None)
@given(
    st.integers(0, 10**6),
    st.tuples(st.integers(1, 6), st.integers(2, 6)),
    st.integers(2, 9),
    st.booleans(),
    st.sampled_from([(np.float32, 2.0**-23), (np.float16, 2.0**-10)]),
)
def test_a_model_comes_back_from_its_bytes(seed, shape, atoms, centred, precision):
    model, (dtype, digits) = made(seed, shape, atoms, centred=centred), precision
    back = model_from_npz(arrays_to_npz(model_arrays(model, dtype)), "m")
    for name in ("shape", "kernel", "lasso_weight", "scale", "unit", "window_m", "provenance", "atoms", "centred"):
        assert getattr(back, name) == getattr(model, name), name
    for name in (*LARGE, "mean"):
        assert getattr(back, name).dtype == np.float64
        np.testing.assert_allclose(getattr(back, name), getattr(model, name), rtol=digits, atol=1e-7)


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_bytes_come_back_from_a_model(dtype):
    content = arrays_to_npz(model_arrays(made(), dtype))
    assert arrays_to_npz(model_arrays(model_from_npz(content, "m"), dtype)) == content
    assert arrays_to_npz(model_arrays(made(), dtype)) == content, "the same model, other bytes"


def test_half_the_precision_is_the_smaller_file_and_the_mean_keeps_its_own():
    big = made(shape=(16, 16), atoms=64)
    single, half = (model_arrays(big, dtype) for dtype in (np.float32, np.float16))
    assert len(arrays_to_npz(half)) < 0.6 * len(arrays_to_npz(single))
    assert half["mean"].dtype == np.float32


def test_a_model_comes_back_from_its_file(tmp_path):
    path = tmp_path / "model.npz"
    path.write_bytes(GOOD)
    np.testing.assert_array_equal(read_model(path).dictionary, model_from_npz(GOOD, "m").dictionary)


def test_the_file_holds_plain_arrays_that_others_can_read():
    with np.load(io.BytesIO(GOOD), allow_pickle=False) as stored:
        assert {name: stored[name].dtype.kind for name in stored.files} == {
            "model": "U",
            "mean": "f",
            **dict.fromkeys(LARGE, "f"),
        }
        assert json.loads(str(stored["model"]))["format"] == "sparsor model 2"
    assert {field.name for field in fields(Model)} == set(json.loads(str(model_arrays(made())["model"]))) - {
        "format"
    } | {"mean", *LARGE}


class Trap:
    """Runs when it is unpickled."""

    ran = False

    def __reduce__(self):
        return setattr, (Trap, "ran", True)


def test_pickles_are_never_opened():
    objects = io.BytesIO()
    np.savez(objects, allow_pickle=True, **model_arrays(made()) | {"mean": np.array([Trap()], dtype=object)})
    alone = io.BytesIO()
    np.save(alone, np.array([Trap()], dtype=object), allow_pickle=True)
    for content in (objects.getvalue(), alone.getvalue(), pickle.dumps(Trap())):
        with pytest.raises(ModelError, match=r"trap\.npz cannot be read as \.npz"):
            model_from_npz(content, "trap.npz")
    assert not Trap.ran


def test_a_file_cut_short_anywhere_is_a_model_error():
    assert assert_only_model_errors(GOOD[:length] for length in range(len(GOOD))) == len(GOOD)


@pytest.mark.parametrize("flip", [0x01, 0x06, 0x40, 0xFF])
def test_a_byte_flipped_anywhere_is_a_model_error_or_no_harm(flip):
    def flipped(place):
        content = bytearray(GOOD)
        content[place] ^= flip
        return bytes(content)

    assert assert_only_model_errors(map(flipped, range(len(GOOD)))) > 0.5 * len(GOOD)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_bytes_overwritten_removed_or_added_are_a_model_error_or_no_harm(data):
    start, stop = sorted(data.draw(st.integers(0, len(GOOD))) for _ in range(2))
    assert_only_model_errors([GOOD[:start] + data.draw(st.binary(max_size=40)) + GOOD[stop:]])


@settings(max_examples=60, deadline=None)
@given(st.sampled_from([b"", b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY\x01\x00", b"\x80\x05"]), st.binary(max_size=80))
def test_files_of_another_kind_are_a_model_error(start, rest):
    with pytest.raises(ModelError, match="other"):
        model_from_npz(start + rest, "other")


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def test_a_single_array_is_not_a_model():
    with pytest.raises(ModelError, match=r"array\.npy (is not an|cannot be read as) \.npz"):
        model_from_npz(npy(np.ones(3)), "array.npy")


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000000,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (10000000000000000000000000,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-12,), }",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (12,)",
        "{'descr': 'zz', 'fortran_order': False, 'shape': (12,), }",
        "[]",
    ],
    ids=["too large", "beyond 64 bits", "negative", "cut off", "no such type", "a list"],
)
def test_an_array_whose_header_lies_is_a_model_error(header):
    """With matching checksums, as a faulty or hostile writer would leave them."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in model_arrays(made()).items():
            content = npy(array)
            if name == "mean":
                assert content[8:10] == (118).to_bytes(2, "little")
                content = content[:10] + header.encode().ljust(117) + b"\n" + content[128:]
            archive.writestr(f"{name}.npy", content)
    with pytest.raises(ModelError, match="lies"):
        model_from_npz(buffer.getvalue(), "lies.npz")


def test_an_archive_of_anything_else_is_a_model_error():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in model_arrays(made()):
            archive.writestr(name, b"text")
    with pytest.raises(ModelError, match=r"text\.npz is not a sparsor model"):
        model_from_npz(buffer.getvalue(), "text.npz")


@pytest.mark.parametrize("name", ["model", "mean", *LARGE])
def test_a_missing_array_is_named(name):
    arrays = model_arrays(made())
    del arrays[name]
    with pytest.raises(ModelError, match=rf"m\.npz is not a sparsor model \('{name}'\); make one with 'sparsor learn'"):
        model_from_npz(arrays_to_npz(arrays), "m.npz")


@pytest.mark.parametrize(
    "key", ["format", "shape", "kernel", "lasso_weight", "scale", "unit", "window_m", "provenance"]
)
def test_a_missing_value_is_named(key):
    with pytest.raises(ModelError, match=rf"m\.npz is not a sparsor model \('{key}'\)"):
        model_from_arrays(with_about(**{key: None}), "m.npz")


def test_a_model_of_another_version_is_said_so():
    with pytest.raises(ModelError, match="m: made as 'sparsor model 9'; this version reads 'sparsor model 2'"):
        model_from_arrays(with_about(format="sparsor model 9"), "m")


@pytest.mark.parametrize(
    "changed",
    [
        {"shape": [12]},
        {"shape": "wide"},
        {"shape": [float("inf"), 1]},
        {"shape": [-3, -4]},
        {"shape": [3.9, 4]},
        {"kernel": [1.0, 2.0]},
        {"kernel": [1.0, 0.0, 0.0]},
        {"kernel": "long"},
        {"lasso_weight": -1.0},
        {"lasso_weight": float("nan")},
        {"lasso_weight": float("inf")},
        {"scale": [2.0, 1.0]},
        {"scale": [0.0, float("inf")]},
        {"scale": [0, 10**400]},
        {"window_m": [0.0, 1.0]},
        {"window_m": [1.0, float("nan")]},
        {"window_m": [float("inf"), 1.0]},
        {"provenance": "a field"},
    ],
    ids=lambda changed: str(changed)[:40],
)
def test_a_value_out_of_range_is_a_model_error(changed):
    with pytest.raises(ModelError, match=r"^m\b"):
        model_from_arrays(with_about(**changed), "m")


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "[" * 100_000], ids=["empty", "cut", "list", "null", "deep"])
def test_a_description_that_is_none_is_a_model_error(text):
    with pytest.raises(ModelError, match="m is not a sparsor model"):
        model_from_arrays(model_arrays(made()) | {"model": np.array(text)}, "m")


def test_a_refused_file_is_named(tmp_path):
    path = tmp_path / "model.npz"
    with pytest.raises(ModelError, match=r"cannot read '.*model\.npz': No such file"):
        read_model(path)
    with pytest.raises(ModelError, match="cannot read '"):
        read_model(tmp_path)
    path.write_bytes(GOOD[:100])
    with pytest.raises(ModelError, match=r"'.*model\.npz' cannot be read as \.npz.*; is it damaged"):
        read_model(path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("dictionary", r"the dictionary of shape .* does not fit a grid of \(3, 4\)"),
        ("mean", r"the mean of shape .* does not fit a grid of \(3, 4\)"),
        ("covariance_factor", r"the covariance factor of shape .* does not fit a grid of \(3, 4\)"),
        ("validation", r"the validation maps of shape .* does not fit a grid of \(3, 4\)"),
    ],
)
def test_parts_that_do_not_fit_the_grid_are_refused(name, words):
    array = getattr(made(), name)
    with pytest.raises(ModelError, match=words):
        replace(made(), **{name: array[:, :-1] if name == "validation" else array[:-1]})


@pytest.mark.parametrize("name", ["mean", *LARGE])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_parts_that_hold_no_numbers_are_refused(name, value):
    array = getattr(made(), name).copy()
    array.flat[1] = value
    with pytest.raises(ModelError, match="holds values that are not numbers"):
        replace(made(), **{name: array})


@pytest.mark.parametrize(
    ("name", "reshaped"),
    [
        ("dictionary", lambda psi: psi[:, 0]),
        ("dictionary", lambda psi: psi[:, :, None]),
        ("mean", lambda mean: mean[None]),
        ("covariance_factor", lambda factor: factor[:, 0]),
        ("validation", lambda maps: maps[0]),
        ("validation", lambda maps: maps[None]),
    ],
    ids=["dictionary 1-D", "dictionary 3-D", "mean 2-D", "factor 1-D", "validation 1-D", "validation 3-D"],
)
def test_parts_with_the_wrong_number_of_axes_are_refused(name, reshaped):
    arrays = model_arrays(made())
    with pytest.raises(ModelError, match=r"^m\b"):
        model_from_arrays(arrays | {name: reshaped(arrays[name])}, "m")


@pytest.mark.parametrize("factor", [0.0, 0.5, 0.98, 1.02, 2.0])
def test_atoms_that_are_not_of_unit_norm_are_refused(factor):
    psi = made().dictionary.copy()
    psi[:, 2] *= factor
    with pytest.raises(ModelError, match="the dictionary's atoms are not of unit norm"):
        replace(made(), dictionary=psi)


def test_a_model_needs_atoms_and_maps():
    with pytest.raises(ModelError, match="at least two atoms and one validation map"):
        replace(made(), dictionary=made().dictionary[:, :1])
    with pytest.raises(ModelError, match="at least two atoms and one validation map"):
        replace(made(), validation=np.empty((0, 12)))
