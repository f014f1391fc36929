"""What the practice autopilot tells the person at the desk, and the battery that somebody changes on the ground."""

from __future__ import annotations

import re

import pytest

from mission_strategies import AUTOPILOT_NAMES, example_plan
from practice_rig import Rig, mavlink, mission_messages
from sparsor.link.practice import PracticeAutopilot, PracticeSettings, Troubles, Window, WindSettings, flavour_named
from sparsor.link.practice.narrator import Narrator


def flown(autopilot, troubles=Troubles(), **settings):  # noqa: B008 (frozen)
    """Fly a short plan to its end; return the rig and what was told."""
    plan = example_plan(autopilot, stops=2)
    rig, lines = Rig.of(autopilot, plan=plan, troubles=troubles, truth=lambda *_: 0.5, **settings), []
    rig.vehicle.narrator = Narrator(rig.flight, lines.append)
    rig.upload(mission_messages(plan, autopilot))
    rig.run(10)
    rig.take_off()
    assert rig.run(900, until=lambda: rig.flight.flown_s and not rig.flight.armed)
    return rig, plan, lines


@pytest.mark.parametrize("autopilot", AUTOPILOT_NAMES)
def test_what_happens_is_told_in_order_with_the_simulated_time(autopilot):
    troubles = Troubles(silent_sensor=(Window(5, 20),), gps_outage=(Window(8, 10),), link_loss=(Window(12, 15),))
    _, plan, lines = flown(autopilot, troubles)
    stamps = [float(re.match(r" *([\d.]+) s  ", line)[1]) for line in lines]
    assert stamps == sorted(stamps)
    assert [line.partition(" s  ")[2] for line in lines] == [
        f"mission received, {len(plan.items)} items",
        "armed",
        "take-off",
        "the sensor falls silent",
        "the GPS loses its fix",
        "the GPS has a fix again",
        "the link is lost",
        "the link is back",
        "the sensor sends again",
        "landed",
        "disarmed",
    ]
    assert stamps[3] - stamps[2] == pytest.approx(5, abs=0.2)


def test_a_wind_that_is_too_strong_is_told():
    lines = []
    settings = PracticeSettings(example_plan("ardupilot").home, flavour_named("ardupilot"), wind=WindSettings(25, 90))
    rig = Rig(PracticeAutopilot(settings, lines.append))
    rig.vehicle.join(1)
    rig.upload(mission_messages(example_plan("ardupilot", stops=2), "ardupilot"))
    rig.run(10)
    rig.take_off()
    assert rig.run(120, until=lambda: any("the wind is too strong" in line for line in lines))


@pytest.mark.parametrize("keep", [False, True])
def test_somebody_changes_the_battery_on_the_ground_unless_it_is_to_be_kept(keep):
    rig, _, lines = flown("ardupilot", Troubles(low_battery_s=10, keep_battery=keep))
    left = rig.flight.battery.level
    assert left < 0.15
    rig.run(9)
    assert rig.flight.battery.level == left
    rig.run(2)
    assert rig.flight.battery.level == (left if keep else 1.0)
    assert ("the battery was changed" in lines[-1]) is not keep
    if not keep:  # what made it low was that flight's
        assert rig.command(mavlink.MAV_CMD_DO_SET_MODE, 1, 4) == 0  # GUIDED
        rig.take_off()
        rig.run(40)
        assert rig.flight.battery.level > 0.9
