"""`sparsor study`: what is asked for reaches the journey, and what is wrong is said."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sparsor.cli.main import app
from sparsor.journeys import studying

RUN = CliRunner()


@pytest.fixture
def asked(monkeypatch):
    requests = []

    def study(request, **_):
        requests.append(request)
        return studying.Studied(request.output / "results.md", (request.output / "a.csv",), ())

    monkeypatch.setattr(studying, "study", study)
    return requests


def test_options_reach_the_study_and_the_page_names_the_command(asked, tmp_path):
    ran = RUN.invoke(
        app, ["study", "--field", "x/a b.tif", "--field", "y.nc", "-o", str(tmp_path), "--quick", "--json"]
    )
    assert ran.exit_code == 0, ran.output
    assert json.loads(ran.stdout) == {"results": str(tmp_path / "results.md"), "files": [str(tmp_path / "a.csv")]}
    (request,) = asked
    assert request.fields == (Path("x/a b.tif"), Path("y.nc"))
    assert request.quick
    assert request.command == f"sparsor study --field 'a b.tif' --field y.nc -o {tmp_path} --quick"


@pytest.mark.parametrize(("words", "says"), [(("none.tif",), "none.tif"), (("a/x.tif", "b/x.tif"), "same file name")])
def test_what_is_wrong_is_said_before_anything_is_written(tmp_path, words, says):
    fields = [word for name in words for word in ("--field", name)]
    ran = RUN.invoke(app, ["study", *fields, "-o", str(tmp_path / "out")])
    assert ran.exit_code == 2
    assert says in ran.output
    assert not (tmp_path / "out").exists()
