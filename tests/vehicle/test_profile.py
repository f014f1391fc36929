"""A vehicle profile is either right or refused by the name of its key."""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import TYPE_CHECKING

import pytest
from pydantic import ValidationError
from pymavlink.dialects.v20 import common as mavlink

from sparsor.errors import VehicleError
from sparsor.vehicle import Vehicle, load_vehicle, packaged_vehicles

if TYPE_CHECKING:
    from pathlib import Path

MAV_NAMES = {
    "quad": "QUADROTOR",
    "plane": "FIXED_WING",
    # What MAVLink calls VTOL_FIXEDROTOR by now; pymavlink does not yet.
    "vtol": "VTOL_RESERVED2",
    "rover": "GROUND_ROVER",
    "boat": "SURFACE_BOAT",
}
QUAD = (resources.files("sparsor.vehicle") / "profiles" / "quad.toml").read_text(encoding="utf-8")


def test_the_quadrotor() -> None:
    quad = load_vehicle("quad")
    assert (quad.cruise_m_s, quad.climb_m_s, quad.descent_m_s, quad.acceleration_m_s2) == (10, 2.5, 1.5, 2.5)
    assert (quad.endurance_s, quad.reserve_fraction, quad.ceiling_m) == (2100, 0.2, 120)
    assert quad.mav_type == 2
    assert packaged_vehicles() == ["boat", "plane", "quad", "rover", "vtol"]


def test_a_profile_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(QUAD.replace('name = "quad"', 'name = "mine"').replace("10.0 ", "7 ", 1), encoding="utf-8")
    mine = load_vehicle(path)
    assert (mine.name, mine.cruise_m_s) == ("mine", 7)


def test_a_vehicle_does_not_change() -> None:
    with pytest.raises(ValidationError):
        load_vehicle("quad").cruise_m_s = 20.0


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(
        VehicleError, match=r"unknown vehicle 'zeppelin'; known are boat, plane, quad, rover, vtol, .* a \.toml file"
    ):
        load_vehicle("zeppelin")


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("cruise_m_s", 0, "cruise_m_s = 0 is not allowed: input should be greater than 0"),
        ("cruise_m_s", "10", "cruise_m_s = '10' is not allowed: input should be a valid number"),
        ("cruise_m_s", float("nan"), "cruise_m_s = nan is not allowed"),
        ("climb_m_s", True, "climb_m_s = True is not allowed"),
        ("reserve_fraction", 1.0, "reserve_fraction = 1.0 is not allowed: input should be less than 1"),
        ("endurance_s", float("inf"), "endurance_s = inf is not allowed"),
        ("ceiling_m", -1, "ceiling_m = -1 is not allowed"),
        ("kind", "submarine", "kind = 'submarine' is not allowed: input should be 'quad', 'plane'"),
        ("name", "", "name = '' is not allowed"),
        ("cruise", 10, "unknown key 'cruise'; known are name, kind, cruise_m_s"),
    ],
)
def test_an_error_names_key_value_and_what_is_allowed(key: str, value: object, sentence: str) -> None:
    values = tomllib.loads(QUAD) | {key: value}
    with pytest.raises(VehicleError, match=sentence) as caught:
        Vehicle.from_mapping(values, "mine.toml")
    assert str(caught.value).startswith("mine.toml: ")


def test_a_missing_key_is_named() -> None:
    values = tomllib.loads(QUAD)
    del values["endurance_s"]
    with pytest.raises(VehicleError, match="the key 'endurance_s' is missing"):
        Vehicle.from_mapping(values, "mine.toml")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"cruise_m_s = = 3", "is not TOML"),
        (b"\xff\xfe", "is not TOML"),
        (None, "cannot read the vehicle profile"),
    ],
)
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes | None, sentence: str) -> None:
    path = tmp_path / "mine.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(VehicleError, match=sentence) as caught:
        load_vehicle(str(path))
    assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize("kind", packaged_vehicles())
def test_every_packaged_profile_is_of_its_kind(kind: str) -> None:
    vehicle = load_vehicle(kind)
    assert (vehicle.name, vehicle.kind) == (kind, kind)
    assert vehicle.circles == (kind in {"plane", "vtol"})
    assert vehicle.lifts == (kind in {"quad", "vtol"})
    assert vehicle.flies == (kind not in {"rover", "boat"})
    assert getattr(mavlink, f"MAV_TYPE_{MAV_NAMES[kind]}") == vehicle.mav_type


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"energy_wh": 100.0, "cruise_w": 200.0}, "give either endurance_s, or energy_wh with cruise_w"),
        ({"hover_w": 200.0}, "hover_w without energy_wh"),
        ({"kind": "plane"}, "a plane turns in circles: give its turn_radius_m"),
        ({"transition_s": 3.0}, "transition_s is of a vtol, not of a quad"),
        ({"endurance_s": None, "energy_wh": 100.0}, "energy_wh needs a cruise_w above 0"),
        ({"max_items": 0}, "max_items = 0 is not allowed"),
    ],
)
def test_what_does_not_go_together_is_said(changes: dict[str, object], sentence: str) -> None:
    values = {key: value for key, value in (tomllib.loads(QUAD) | changes).items() if value is not None}
    with pytest.raises(VehicleError, match=sentence):
        Vehicle.from_mapping(values, "mine.toml")


def test_energy_and_power_give_the_endurance() -> None:
    values = tomllib.loads(QUAD) | {"energy_wh": 100.0, "cruise_w": 200.0, "hover_w": 300.0}
    del values["endurance_s"]
    quad = Vehicle.from_mapping(values, "mine.toml")
    assert quad.endurance_s == 1800
    assert (quad.load("cruise"), quad.load("hover"), quad.load("climb")) == (1, 1.5, 1)
    assert load_vehicle("quad").load("hover") == 1
