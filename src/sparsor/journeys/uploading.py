"""From a mission folder or a .plan to the vehicle."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from sparsor.core.progress import silent
from sparsor.errors import MissionError
from sparsor.link.addresses import parse_address
from sparsor.link.connection import Connection
from sparsor.link.upload import UploadReport, upload_plan
from sparsor.link.vehicles import find_vehicle
from sparsor.mission import read_plan

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sparsor.core.progress import Progress
    from sparsor.link.vehicles import FoundVehicle


def upload_mission(
    path: Path,
    url: str,
    *,
    sortie: int | None = None,
    system_id: int | None = None,
    dry_run: bool = False,
    force: bool = False,
    timeout_s: float = 10.0,
    progress: Progress = silent,
    found: Callable[[FoundVehicle], None] = lambda _: None,
) -> UploadReport:
    """Send a plan to a vehicle and verify that it holds it.

    Parameters
    ----------
    path : Path
        A mission folder or a .plan, ours or QGroundControl's.
    url : str
        Address of the link.
    sortie : int or None
        Which plan of a folder that holds several.
    system_id : int or None
        Which vehicle, where there are several.
    dry_run, force : bool
        As `upload_plan`.
    timeout_s : float
        How long to wait for the vehicle.
    progress : Progress
    found : callable
        Told which vehicle was found, before anything is sent.

    Raises
    ------
    InputError
        When the plan, the address or the vehicle is not one that this can be done with; nothing was sent.
    LinkFailureError
        When the vehicle is silent or the transfer fails.
    """
    plan = read_plan(choose_plan(path, sortie))
    with Connection(parse_address(url), timeout_s=timeout_s) as connection:
        vehicle = find_vehicle(connection, system_id, timeout_s)
        found(vehicle)
        return upload_plan(plan, connection, vehicle, dry_run=dry_run, force=force, progress=progress)


def choose_plan(path: Path, sortie: int | None = None) -> Path:
    """Return the .plan that is meant by a folder or a file.

    Raises
    ------
    MissionError
        When there is none, or several and none was chosen.
    """
    if not path.exists():
        raise MissionError(f"there is no '{path}'; give a mission folder or a .plan")
    if not path.is_dir():
        return path
    plans = sorted(path.glob("*.plan"))
    if not plans:
        raise MissionError(f"'{path}' is a folder without a .plan; make one with 'sparsor plan'")
    if sortie is None:
        if len(plans) > 1:
            names = ", ".join(plan.name for plan in plans)
            raise MissionError(f"'{path}' holds {len(plans)} plans: {names}. Choose one with --sortie N")
        return plans[0]
    chosen = [plan for plan in plans if re.search(rf"-0*{sortie}$", plan.stem)]
    if len(chosen) != 1:
        names = ", ".join(plan.name for plan in plans)
        raise MissionError(f"'{path}' has no sortie {sortie}; it holds {names}")
    return chosen[0]
