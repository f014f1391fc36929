"""mission.toml: what is asked for comes back from the file, defaults filled in; what is wrong is named."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sparsor.errors import MissionError
from sparsor.mission.specification import (
    changed,
    read_specification,
    specification,
    specification_toml,
)

BOX = (51.50, 25.27, 51.53, 25.30)


def spec(base=Path("/work"), **sections):
    return specification({"name": "m", "area": {"bbox": BOX}, **sections}, base=base)


def optional(**strategies):
    return st.fixed_dictionaries({}, optional=strategies)


above_zero = st.floats(1e-3, 1e3)
paths = st.lists(st.text("abz 0é-", min_size=1).map(lambda s: f"x{s}x"), min_size=1, max_size=3).map("/".join)
text = st.text(st.characters(codec="utf-8"), max_size=8)
searches = optional(
    paper=st.booleans(),
    rows=st.integers(1, 1024),
    probability=st.floats(1e-6, 1),
    theta=st.integers(0, 1),
    lasso=above_zero,
    lambda_valid=st.floats(0, 1e6),
    lambda_path=st.floats(0, 1e6),
    lambda_incoh=st.floats(0, 1e6),
    iterations=st.integers(1, 10**8),
    time_s=above_zero,
    seed=st.integers(0, 2**63 - 1),
    budget=st.sampled_from(["10%", "12km", "25 min"]),
)
flights = optional(
    vehicle=st.just("quad") | paths.map(lambda path: f"{path}.toml"),
    autopilot=st.sampled_from(["ardupilot", "px4"]),
    altitude_m=st.floats(0.1, 20_000),
    speed_m_s=st.floats(0.1, 200),
    hold_s=st.floats(0, 1e3),
    home=st.tuples(st.floats(-180, 180), st.floats(-85, 85)),
    home_altitude_m=st.floats(-500, 9000),
    fence_margin_m=st.floats(5, 5000),
)
fields = optional(variable=text, time=text, field_range=st.tuples(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9)))
priors = (
    optional(atoms=st.integers(2, 4096))
    | paths.map(lambda path: {"model": path})
    | st.tuples(paths, fields).map(lambda both: {"field": both[0], **both[1]})
)
areas = st.just({"bbox": BOX}) | paths.map(lambda path: {"file": path})
outputs = optional(export=st.lists(st.sampled_from(["waypoints", "kml", "geojson"]), unique=True))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(area=areas, prior=priors, search=searches, flight=flights, output=outputs)
def test_what_was_written_is_read(tmp_path, area, prior, search, flight, output):
    sections = {"area": area, "prior": prior, "search": search, "flight": flight, "output": output}
    asked = spec(base=tmp_path / "here", **sections)
    folder = tmp_path / "missions" / "m"
    folder.mkdir(parents=True, exist_ok=True)
    content = specification_toml(asked, folder)
    (folder / "mission.toml").write_bytes(content)
    again = read_specification(folder / "mission.toml")
    assert again == asked
    assert specification_toml(again, folder) == content


def test_paths_are_relative_to_the_file_so_that_folders_can_move(tmp_path):
    asked = spec(
        base=tmp_path,
        area={"file": "geo/doha.geojson"},
        prior={"model": "models/m.npz"},
        flight={"vehicle": "my quad.toml"},
    )
    assert asked.area.file == tmp_path / "geo" / "doha.geojson"
    written = tomllib.loads(specification_toml(asked, tmp_path / "missions" / "m").decode())
    assert written["area"]["file"] == "../../geo/doha.geojson"
    assert written["prior"]["model"] == "../../models/m.npz"
    assert written["flight"]["vehicle"] == "../../my quad.toml"


def test_everything_left_out_is_filled_in():
    filled = spec().model_dump(exclude_none=True)
    assert filled["search"] == {
        "planner": "refined", "paper": False, "iterations": 480_000, "seed": 0, "budget": "10%",
    }  # fmt: skip
    assert spec(search={"planner": "monte-carlo"}).model_dump(exclude_none=True)["search"] == {
        "planner": "monte-carlo", "paper": False, "rows": 35, "lambda_valid": 1.0, "iterations": 4000, "seed": 0,
        "budget": "10%",
    }  # fmt: skip
    assert filled["flight"] == {
        "vehicle": "quad", "autopilot": "ardupilot", "altitude_m": 50.0, "hold_s": 5.0, "fence_margin_m": 50.0,
        "sorties": True, "keep_out": (), "keep_out_margin_m": 30.0, "homes": (), "drop_unreachable": False,
        "vehicles": 1, "separation_m": 10.0,
    }  # fmt: skip
    assert spec(search={"seed": None}) == spec()


@pytest.mark.parametrize(
    ("search", "budget", "probability", "theta"),
    [
        ({}, "10%", None, None),
        ({"probability": 0.02}, "10%", 0.02, None),
        ({"theta": 2}, "10%", None, 2),
        ({"probability": 0.02, "theta": 2}, None, 0.02, 2),
        ({"lambda_path": 1.0}, None, 0.03, 3),
        ({"paper": True}, None, 0.03, 3),
        ({"paper": True, "theta": 1}, None, 0.03, 1),
        ({"paper": True, "budget": "20%"}, "20%", None, None),
        ({"lambda_path": 1.0, "budget": "20%"}, "20%", None, None),
    ],
)
def test_what_turns_the_default_budget_off(search, budget, probability, theta):
    found = spec(search=search).search
    assert (found.budget, found.probability, found.theta) == (budget, probability, theta)


def test_changes_keep_the_rest():
    first = spec(search={"seed": 7}, flight={"altitude_m": 80})
    second = changed(first, {"search": {"iterations": 9, "seed": None}, "name": None}, base=Path("/"))
    assert second == spec(search={"seed": 7, "iterations": 9}, flight={"altitude_m": 80})
    assert changed(first, {}, base=Path("/")) == first
    moved = changed(first, {"area": {"bbox": None, "file": Path("a.kml")}}, base=Path("/geo"))
    assert (moved.area.bbox, moved.area.file) == (None, Path("/geo/a.kml"))


@pytest.mark.parametrize(
    ("sections", "said"),
    [
        ({"name": "../m"}, r"^name: .*'../m'"),
        ({"name": "m\n"}, "^name: "),
        ({"area": {}}, "^area: give either a bbox .* or an area file"),
        ({"area": {"bbox": BOX, "file": "a.kml"}}, "^area: give either"),
        ({"area": {"bbox": (1, 2, 3)}}, r"^area\.bbox"),
        ({"prior": {"variable": "no2"}}, "^prior: --variable only make sense with --field"),
        ({"prior": {"field": "f.tif", "model": "m.npz"}}, "^prior: .* not both"),
        ({"search": {"iterations": 0}}, r"^search\.iterations: .* given 0"),
        ({"search": {"lambda_path": float("nan")}}, r"^search\.lambda_path: .* given nan"),
        ({"search": {"buget": "9%"}}, r"^search\.buget: .* given '9%'"),
        ({"flight": {"altitude_m": -1}}, r"^flight\.altitude_m: .* given -1"),
        ({"flight": {"autopilot": "inav"}}, r"^flight\.autopilot: .*'ardupilot' or 'px4', given 'inav'"),
        ({"flight": {"home": (200, 0)}}, r"^flight\.home\.0: .* given 200"),
        ({"flight": {"hold_s": -1, "speed_m_s": 0}}, r"speed_m_s: .*; flight\.hold_s: "),
        ({"output": {"export": ["dxf"]}}, r"^output\.export\.0: .* given 'dxf'"),
    ],
)
def test_what_is_wrong_is_named(sections, said):
    with pytest.raises(MissionError, match=said):
        spec(**sections)


@pytest.mark.parametrize("content", [b"name = ", b"\xff\xfe", b"", b"[area]\nbbox = 3\n"])
def test_files_that_are_no_specification_are_named(tmp_path, content):
    path = tmp_path / "mission.toml"
    path.write_bytes(content)
    with pytest.raises(MissionError, match=r"mission\.toml'"):
        read_specification(path)


def test_filled_in_values_follow_from_what_is_asked_for_now():
    """Whoever turns the default budget off and then asks for one gets a search within it, and the other way round."""
    budgeted = spec()
    assert budgeted.search.budget == "10%"
    free = changed(budgeted, {"search": {"lambda_path": 0.1}}, base=Path("/"))
    assert (free.search.budget, free.search.probability, free.search.theta) == (None, 0.03, 3)
    again = changed(free, {"search": {"budget": "20%"}}, base=Path("/"))
    assert (again.search.budget, again.search.probability, again.search.theta) == ("20%", None, None)


def test_homes_given_take_the_place_of_those_before():
    one, two = (51.5, 25.3), ((51.5, 25.3), (51.6, 25.3))
    several = spec(flight={"homes": two})
    assert several.flight.given_homes == two
    single = changed(several, {"flight": {"home": one}}, base=Path("/"))
    assert single.flight.given_homes == (one,)
    assert changed(single, {"flight": {"homes": two}}, base=Path("/")).flight == several.flight
    with pytest.raises(MissionError, match="either one home or several"):
        spec(flight={"home": one, "homes": two})


def test_vehicles_at_once_are_not_planned_over_a_terrain():
    with pytest.raises(MissionError, match="not planned over a --terrain"):
        spec(flight={"vehicles": 2, "terrain": "dem.tif"})


@pytest.mark.parametrize("t90_s", [0.0, 10.0, 30.0, 47.3])
def test_a_hold_by_the_sensor_is_long_enough_for_95_percent_and_no_longer(t90_s, tmp_path):
    asked = {"planner": "monte-carlo"}, {"hold_s": "auto"}
    spec = specification(
        {"name": "m", "area": {"bbox": BOX}, "search": asked[0], "flight": asked[1], "sensor": {"t90_s": t90_s}},
        base=tmp_path,
    )
    hold_s = spec.flight.hold_s

    def shown(seconds):
        return 1 - 0.1 ** (seconds / t90_s) if t90_s else 1.0

    assert shown(hold_s) >= 0.95
    assert hold_s == 0 or shown(hold_s - 1) < 0.95
    (tmp_path / "mission.toml").write_bytes(specification_toml(spec, tmp_path))
    assert read_specification(tmp_path / "mission.toml") == spec
    again = changed(spec, {"flight": {"hold_s": "auto"}, "sensor": {"t90_s": 2 * t90_s}}, base=tmp_path)
    assert again.flight.hold_s >= hold_s


@pytest.mark.parametrize(
    ("search", "words"), [({}, "refined planner places its dwells"), ({"planner": "monte-carlo"}, "say which one")]
)
def test_a_hold_by_the_sensor_needs_one_and_algorithm_1(search, words, tmp_path):
    with pytest.raises(MissionError, match=words):
        specification(
            {"name": "m", "area": {"bbox": BOX}, "search": search, "flight": {"hold_s": "auto"}}, base=tmp_path
        )
