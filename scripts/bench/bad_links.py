#!/usr/bin/env python3
"""Upload 102 items to the practice autopilot over bad links and read them back: what carries how far, as Markdown.

    scripts/bench/bad_links.py [--autopilot ardupilot|px4] [--repeats 3] [--at-once 6] [--quick]

Three ways over the same links: mavsdk with its own UDP connection; mavsdk behind our connection, which holds back
duplicates and echoes; and ours complete, where an uploader of our own takes over when mavsdk gives up. Loss,
duplicates and delay are of datagrams, in each direction, from a seed.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from sparsor.errors import LinkFailureError
from sparsor.link.connection import Connection
from sparsor.link.missions.mavsdkmissions import mavsdk_item, wire_item
from sparsor.link.missions.readback import differences
from sparsor.link.missions.transfer import Transfer
from sparsor.link.missions.wire import MISSION, wire_items
from sparsor.link.practice import PracticeAutopilot, PracticeServer, PracticeSettings, flavour_named
from sparsor.link.vehicles import find_vehicle
from sparsor.vehicle import AUTOPILOTS

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))  # the proxy and the example plan are the tests'
from link.bad_link import BadLink
from mission_strategies import KNOWN_HOME, example_plan

LINKS = {
    "clean": (0.0, 0.0, 0.0),
    "5 % loss": (0.05, 0.0, 0.0),
    "10 % loss": (0.1, 0.0, 0.0),
    "30 % loss": (0.3, 0.0, 0.0),
    "10 % duplicates": (0.0, 0.1, 0.0),
    "300 ms delay": (0.0, 0.0, 0.3),
    "500 ms delay": (0.0, 0.0, 0.5),
    "30 % + 10 % + 500 ms": (0.3, 0.1, 0.5),
}
QUICK = ("clean", "10 % loss", "30 % loss")
WAYS = ("mavsdk alone", "mavsdk behind our connection", "ours complete")
ITEMS, PATIENT_S = 102, 60.0


@dataclass(frozen=True)
class Outcome:
    """One upload and its read-back; None for what failed, with how long that took, seconds."""

    upload_s: float | None
    download_s: float | None
    total_s: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--autopilot", choices=sorted(AUTOPILOTS), default="ardupilot")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--at-once", type=int, default=6, help="runs at the same time; they wait most of it")
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}; once each")
    options = parser.parse_args()
    links = QUICK if options.quick else tuple(LINKS)
    seeds = range(1 if options.quick else options.repeats)
    cases = list(product([options.autopilot], links, WAYS, seeds))
    with ProcessPoolExecutor(options.at_once) as pool:
        outcomes = dict(zip(cases, pool.map(tried, *zip(*cases, strict=True)), strict=True))
    print(f"{options.autopilot}, {ITEMS} items: passed, upload / read-back in seconds (median of those that passed)\n")
    print("| link, each way | " + " | ".join(WAYS) + " |")
    print("|---|" + "---|" * len(WAYS))
    for link in links:
        cells = [cell([outcomes[options.autopilot, link, way, seed] for seed in seeds]) for way in WAYS]
        print(f"| {link} | " + " | ".join(cells) + " |")


def cell(outcomes: list[Outcome]) -> str:
    """Return one cell of the table."""
    passed = [one for one in outcomes if one.upload_s is not None and one.download_s is not None]
    if not passed:
        return f"0 of {len(outcomes)}"
    upload_s = statistics.median(one.upload_s for one in passed)
    download_s = statistics.median(one.download_s for one in passed)
    return f"{len(passed)} of {len(outcomes)}, {upload_s:.1f} / {download_s:.1f}"


def tried(autopilot: str, link: str, way: str, seed: int) -> Outcome:
    """Run one case on a practice autopilot and a link of its own."""
    loss, twice, delay_s = LINKS[link]
    settings = PracticeSettings(home=KNOWN_HOME, flavour=flavour_named(autopilot))
    began_s = time.monotonic()
    with (
        PracticeServer(PracticeAutopilot(settings), udp=("127.0.0.1", 0)) as server,
        BadLink(server.udp_port, loss=loss, twice=twice, delay_s=delay_s, seed=seed) as bad,
    ):
        facts = AUTOPILOTS[autopilot]
        stops = ITEMS - len(wire_items(example_plan(autopilot, 1), facts)[MISSION]) + 1
        items = wire_items(example_plan(autopilot, stops), facts)[MISSION]
        run = mavsdk_alone if way == WAYS[0] else through_our_connection
        upload_s, held, download_s = run(bad.url, items, resend=way == WAYS[2])
    found = None if held is None else differences(MISSION, items, held, home_is_item_0=facts.home_is_item_0)
    same = found is not None and all(one.harmless for one in found)
    return Outcome(upload_s, download_s if same else None, time.monotonic() - began_s)


def through_our_connection(url: str, items, *, resend: bool):
    """Return seconds of the upload, what was read back, and seconds of that; None from what failed on."""
    upload_s = None
    with Connection(url) as connection:
        try:
            with Transfer(connection, find_vehicle(connection, 1, PATIENT_S), PATIENT_S, resend=resend) as transfer:
                begun_s = time.monotonic()
                transfer.upload(MISSION, items)
                upload_s = time.monotonic() - begun_s
                return upload_s, transfer.download(MISSION), time.monotonic() - begun_s - upload_s
        except LinkFailureError:
            return upload_s, None, None


def mavsdk_alone(url: str, items, *, resend: bool):  # noqa: ARG001 # mavsdk has nothing to choose
    """Return the same of mavsdk with a connection of its own."""
    from mavsdk import ComponentType, Configuration, Mavsdk
    from mavsdk.logging import log_subscribe
    from mavsdk.plugins.mission_raw import MissionRaw

    log_subscribe(lambda *_: True)
    mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    mavsdk.add_any_connection(url)
    upload_s = None
    try:
        missions = MissionRaw(mavsdk.first_autopilot(PATIENT_S))
        begun_s = time.monotonic()
        missions.upload_mission([mavsdk_item(number, MISSION, item) for number, item in enumerate(items)])
        upload_s = time.monotonic() - begun_s
        held = [wire_item(item) for item in missions.download_mission()]
        return upload_s, held, time.monotonic() - begun_s - upload_s
    except Exception:  # noqa: BLE001 # mavsdk's errors have no common class but this
        return upload_s, None, None
    finally:
        mavsdk.destroy()


if __name__ == "__main__":
    main()
