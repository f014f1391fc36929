"""What is wrong is said in a sentence: the value, what is allowed, exit code 2 (or 1), nothing written."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from sparsor.cli.console import INTERRUPTED

pytestmark = pytest.mark.usefixtures("no_picture")
GOOD = ("51.50", "25.27", "51.53", "25.30")


def refused(ran, *said, code=2):
    assert ran.code == code, (ran.out, ran.err)
    assert ran.out == ""
    assert "Traceback" not in ran.err
    for words in said:
        assert words in ran.said, ran.said


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ("51.53 25.27 51.50 25.30", ("51.53", "51.5", "nearly round the world", "swapped?")),
        ("51.50 25.30 51.53 25.27", ("25.3", "25.27", "swapped?", "west south east north")),
        ("51.50 25.27 51.53 95", ("latitude 95", "-90..90")),
        ("25.27 151.50 25.30 151.53", ("latitude 151.5", "-90..90", "swapped?")),
        ("51.50 86 51.53 86.03", ("latitude 86", "85 degrees")),
        ("451.50 25.27 451.53 25.30", ("451.5", "-180..180")),
        ("nan 25.27 51.53 25.30", ("nan", "not a number")),
        ("51.50 25.27 inf 25.30", ("inf", "not a number")),
        ("51.50 25.27 51.50 25.30", ("51.5", "no size")),
        ("51.50 25.27 51.5001 25.30", ("10.1 m", "200 m")),
        ("20 5 75 45", ("5552 km", "3000 km")),
    ],
)
def test_boxes(console, tree, box, said):
    refused(console.mission(box=tuple(box.split())), *said)
    assert tree() == {}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("--budget 12", ("'12'", "%, m, km, s, min, h")),
        ("--budget 12furlongs", ("'12furlongs'", "%, m, km, s, min, h")),
        ("--budget -5km", ("'-5km'", "above zero")),
        ("--budget 130%", ("'130%'", "100%")),
        ("--vehicle zeppelin", ("'zeppelin'", "quad", ".toml")),
        ("--vehicle none.toml", ("none.toml", "No such file")),
        ("--altitude -5", ("--altitude", "-5.0", "greater than or equal to 0")),
        ("--altitude 30000", ("--altitude", "30000", "less than or equal to 20000")),
        ("--speed 0", ("--speed", "0.0", "greater than 0")),
        ("--hold -1", ("--hold", "-1.0", "greater than or equal to 0")),
        ("--hold long", ("--hold", "valid number", "long")),
        ("--autopilot inav", ("autopilot", "'inav'", "'ardupilot' or 'px4'")),
        ("--export dxf", ("export", "'dxf'", "'waypoints', 'kml' or 'geojson'")),
        ("--name ../x", ("name", "'../x'")),
        ("--name .hidden", ("name", "'.hidden'")),
        ("--home 200 25", ("home", "200", "180")),
        ("--planner magic", ("planner", "'magic'", "'monte-carlo'")),
        ("--rows 0", ("rows", "0")),
        ("--theta 40 --probability 0.1", ("theta is 40", "0..35")),
        ("--probability 1.5", ("probability", "1.5", "1")),
        ("--probability 0.0001 --theta 5", ("none of", "--probability", "--theta")),
        ("--lasso 0", ("lasso", "greater than 0")),
        ("--lambda-path nan", ("--lambda-path", "finite", "nan")),
        ("--iterations 0", ("iterations", "0")),
        ("--seed -1", ("seed", "-1")),
        ("--atoms 1", ("atoms", "1")),
        ("--workers 0", ("--workers", "1")),
        ("--area area.geojson", ("bbox", "area file")),
        ("--model m.npz --field f.tif", ("field", "model", "not both")),
        ("--field-bbox 1 2 3 4", ("--field-bbox", "--field")),
        ("--model m.npz", ("m.npz", "No such file")),
        ("--field f.tif", ("f.tif", "No such file")),
        ("--field .", ("is a folder",)),
        ("--nonsense", ("--nonsense",)),
    ],
)
def test_options(console, tree, options, said):
    refused(console.mission(*options.split()), *said)  # the last --iterations counts
    assert tree() == {}


def test_where_is_missing(console, tree):
    refused(console("generate-mission", "--name", "m"), "where?", "--bbox", "--area", "mission.toml")
    assert tree() == {}


def test_areas(console, tmp_path):
    (tmp_path / "point.geojson").write_text('{"type": "Point", "coordinates": [51, 25]}')
    (tmp_path / "empty.kml").write_bytes(b"")
    for name, said in (("point.geojson", "Point"), ("empty.kml", "cannot be read"), ("none.kml", "no area file")):
        refused(console.mission("--area", name, box=None), name, said)
    assert not Path("missions").exists()


def make_rasters(geotiff):
    noise = np.random.default_rng(0).random((120, 120))
    whole = geotiff(Path("cut.tif"), noise).read_bytes()
    Path("cut.tif").write_bytes(whole[: len(whole) // 3])
    geotiff(Path("gaps.tif"), np.full((120, 120), np.nan))
    geotiff(Path("nodata.tif"), np.full((120, 120), -9999.0), nodata=-9999.0)
    geotiff(Path("one value.tif"), np.ones((120, 120)))
    geotiff(Path("small.tif"), noise[:20, :20])
    geotiff(Path("nowhere.tif"), noise, crs=None)
    Path("empty.tif").write_bytes(b"")
    Path("empty.nc").write_bytes(b"")
    Path("words.tif").write_text("this is not a raster")


def test_fields(console, geotiff):
    make_rasters(geotiff)
    for name, said in (
        ("cut.tif", "cannot be read"),
        ("gaps.tif", "not one of its 14400 values is finite"),
        ("nodata.tif", "no-data"),
        ("one value.tif", "one value only, 1"),
        ("small.tif", "20 x 20 pixels"),
        ("nowhere.tif", "not georeferenced"),
        ("empty.tif", "is empty (0 bytes)"),
        ("empty.nc", "is empty (0 bytes)"),
        ("words.tif", "cannot be read as a raster"),
    ):
        for command in (("generate-mission", "--bbox", *GOOD, "--field"), ("sparsor", "learn", "-o", "m.npz")):
            ran = console(*command, name)
            refused(ran, said, *([] if name == "one value.tif" else [name]))
    assert not Path("missions").exists()
    assert not Path("m.npz").exists()


def test_models(console):
    Path("empty.npz").write_bytes(b"")
    Path("words.npz").write_text("words")
    np.savez("other.npz", a=np.arange(3))
    np.savez("pickled.npz", model=np.array([{"a": 1}], dtype=object))
    for name in ("empty.npz", "words.npz", "other.npz", "pickled.npz"):
        refused(console.mission("--model", name), name)
        refused(console("sparsor", "inspect", name), name)
    assert not Path("missions").exists()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", ("name", "area", "required")),
        ("name = ", ("cannot be read",)),
        ('name = "m"\n[area]\nbbox = [51.5, 25.27, 51.53]\n', ("area.bbox",)),
        ('name = "m"\n[area]\nbbox = [51.5, 25.27, 51.53, 25.3]\n[search]\nbuget = "5%"\n', ("search.buget", "5%")),
        ('name = "m"\n[area]\nbbox = [51.53, 25.27, 51.50, 25.3]\n', ("swapped?",)),
        ('name = "../m"\n[area]\nbbox = [51.5, 25.27, 51.53, 25.3]\n', ("'../m'",)),
    ],
)
def test_mission_files(console, tree, content, said):
    Path("mission.toml").write_text(content)
    before = tree()
    refused(console("generate-mission", "mission.toml", "-o", "out"), *said)
    assert tree() == before


def test_a_mission_file_that_is_not_there_or_not_text(console):
    refused(console("generate-mission", "none.toml"), "none.toml", "No such file")
    Path("picture.toml").write_bytes(b"\xff\xd8\xff\xe0")
    refused(console("generate-mission", "picture.toml"), "picture.toml", "cannot be read")


def test_a_folder_in_the_place_of_a_file(console, tree):
    """Known before the search, so it is the request that is wrong: 2, at or below the file."""
    Path("taken").write_text("mine")
    for folder in ("taken", "taken/below", "taken/far/below"):
        refused(console.mission("-o", folder), "'taken' is a file", "-o")
    assert tree() == {"taken": b"mine"}


def fails(number, after=0):
    calls = []

    def raising(*_, **__):
        calls.append(number)
        if len(calls) > after:
            raise OSError(number, os.strerror(number))

    return raising


@pytest.mark.parametrize("after", [0, 2])
def test_a_full_disk(console, tree, monkeypatch, after):
    monkeypatch.setattr(os, "fsync", fails(errno.ENOSPC, after))
    refused(console.mission("--name", "m"), "cannot write to 'missions/m'", "No space left", "-o", code=1)
    assert tree() == {}


def test_a_full_disk_leaves_the_old_mission(console, tree, monkeypatch):
    assert console.mission("--name", "m", "--export", "kml").code == 0
    before = tree()
    monkeypatch.setattr(os, "fsync", fails(errno.ENOSPC, 3))
    refused(console.mission("--name", "m", "--seed", 1, "--force"), "No space left", code=1)
    assert tree() == before


def test_a_read_only_folder(console, tree, monkeypatch):
    # Permission bits do not stop root, who may run these tests.
    monkeypatch.setattr(tempfile, "mkstemp", fails(errno.EROFS))
    refused(console.mission("-o", "here"), "'here'", "Read-only file system", code=1)
    assert tree() == {}


def test_learning_onto_a_full_disk(console, smooth_field, monkeypatch):
    monkeypatch.setattr(os, "fsync", fails(errno.ENOSPC))
    ran = console("sparsor", "learn", smooth_field, "-o", "m.npz", "--dictionary", "dct", "--atoms", 16)
    refused(ran, "No space left", code=1)
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("where", ["sparsor.journeys.planning.search_refined", "sparsor.journeys.preview.preview_png"])
def test_an_interrupt_leaves_nothing(console, tree, monkeypatch, where):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(where, interrupted)
    ran = console.mission("--name", "m")
    refused(ran, "interrupted", code=INTERRUPTED)
    assert tree() == {}


def test_verbose_adds_the_traceback_and_keeps_the_code(console):
    ran = console.mission("--vehicle", "zeppelin", "-v")
    assert ran.code == 2
    assert "Traceback" in ran.err
    assert ran.err.splitlines()[-1].startswith("error: unknown vehicle 'zeppelin'")


@pytest.mark.parametrize("command", ["generate-mission", "learn"])
def test_a_scheduler_that_does_not_answer_is_named(console, smooth_field, tree, command):
    before = tree()
    if command == "learn":
        ran = console("sparsor", "learn", smooth_field, "-o", "m.npz", "--scheduler", "tcp://127.0.0.1:9")
    else:
        ran = console.mission("--scheduler", "tcp://127.0.0.1:9")
    assert ran.code == 2
    assert "no dask scheduler answers at 'tcp://127.0.0.1:9'" in ran.err
    assert tree() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("send", "--connect", "udpout://127.0.0.1:9"), "say where the values come from"),
        (("record", "--connect", "nowhere", "-o", "a.tlog"), "nowhere"),
        (("download", "--connect", "udpout://127.0.0.1:9", "--all", "--list"), "exclude each other"),
        (("upload", "none", "--connect", "udpout://127.0.0.1:9"), "none"),
        (("reconstruct", "none.tlog", "--mission", "none"), "'none' does not exist"),
        (("plan", "none.toml"), "none.toml"),
        (("inspect", "none.plan"), "none.plan"),
    ],
    ids=lambda one: one[0] if isinstance(one, tuple) else "",
)
def test_with_json_an_error_is_an_object_on_stdout_too(console, words, said):
    ran = console("sparsor", *words, "--json")
    assert ran.code == 2, ran.err
    assert said in ran.result["error"]
    assert ran.err == f"error: {ran.result['error']}\n"
