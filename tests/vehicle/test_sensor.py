"""A sensor profile is either right or refused by the name of its key."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from sparsor.errors import VehicleError
from sparsor.vehicle import SensorProfile, load_sensor, packaged_sensors

if TYPE_CHECKING:
    from pathlib import Path


def test_the_packaged_sensor() -> None:
    no2 = load_sensor()
    assert (no2.gas, no2.unit, no2.t90_s, no2.noise_sd, no2.range) == ("NO2", "ppb", 30, 5, None)
    assert packaged_sensors() == ["no2"]


def test_a_profile_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nt90_s = 12.5\nrange = [0, 500]\n', encoding="utf-8")
    mine = load_sensor(path)
    assert (mine.name, mine.t90_s, mine.range) == ("mine", 12.5, (0, 500))


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"t90_s": -1}, "t90_s = -1 is not allowed: input should be greater than or equal to 0"),
        ({"t90_s": float("nan")}, "t90_s = nan is not allowed"),
        ({"noise": 3}, "unknown key 'noise'; known are name, gas, unit"),
        ({"interval_s": 0}, "interval_s = 0 is not allowed"),
        ({"range": [5.0, 1.0]}, r"range is \[5, 1\]; give the lower end first"),
        ({"name": ""}, "name = '' is not allowed"),
    ],
)
def test_an_error_names_key_value_and_what_is_allowed(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(VehicleError, match=sentence) as caught:
        SensorProfile.from_mapping({"name": "mine"} | values, "mine.toml")
    assert str(caught.value).startswith("mine.toml: ")


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(VehicleError, match=r"unknown sensor 'nose'; known are no2, or give the path of a \.toml file"):
        load_sensor("nose")


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(VehicleError, match="cannot read the sensor profile"):
        load_sensor(tmp_path / "none.toml")
