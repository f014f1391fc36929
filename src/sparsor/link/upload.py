"""A plan onto a vehicle: checked, sent, read back and compared."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LinkFailureError, SparsorError
from sparsor.link.checks import above_the_fence, check_plan, far_from_home
from sparsor.link.parameters import fence_ceiling_m, fence_enforced
from sparsor.link.readback import differences, summary
from sparsor.link.transfer import Transfer
from sparsor.link.wire import FENCE, KINDS, MISSION, RALLY, WireItem, wire_items

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.readback import Difference
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan
    from sparsor.vehicle import Autopilot

Items = dict[int, tuple[WireItem, ...]]
UNKNOWN: Final = "state unknown, do not arm"
LIFE_S: Final = 3.0


@dataclass(frozen=True)
class UploadReport:
    """What an upload did.

    Parameters
    ----------
    autopilot, vehicle : str
        As people write them.
    system_id : int
    items, fence_points, rally_points : int
        Of the plan; items without home.
    verified : bool or None
        Whether what was read back is what was sent; None when nothing was sent.
    fence_enforced : bool or None
        Whether the autopilot will keep to the fence; None when it does not say.
    changed : tuple of str
        Harmless changes that the autopilot made.
    vehicle_state : {"new plan", "unchanged"}
        What the vehicle holds now.
    warnings : tuple of str
    """

    autopilot: str
    vehicle: str
    system_id: int
    items: int
    fence_points: int
    rally_points: int
    verified: bool | None
    fence_enforced: bool | None
    changed: tuple[str, ...]
    vehicle_state: str
    warnings: tuple[str, ...]


def upload_plan(
    plan: MissionPlan,
    connection: Connection,
    vehicle: FoundVehicle,
    *,
    dry_run: bool = False,
    force: bool = False,
    progress: Progress = silent,
) -> UploadReport:
    """Send a plan to a vehicle, read it back and compare.

    What the vehicle held is read first. When the transfer fails while the link lives, that is sent back (or, where
    this fails too, the vehicle is emptied), and the error says which.

    Parameters
    ----------
    plan : MissionPlan
    connection : Connection
    vehicle : FoundVehicle
    dry_run : bool
        Check everything and send nothing.
    force : bool
        Send to an armed vehicle too.
    progress : Progress

    Raises
    ------
    LinkError
        When the plan must not go to this vehicle; nothing was sent.
    LinkFailureError
        When the link or the transfer failed; says what the vehicle holds now.
    """
    warnings = [*check_plan(plan, vehicle, force=force), *far_from_home(plan, vehicle, connection)]
    warnings += above_the_fence(plan, fence_ceiling_m(connection, vehicle))
    facts = vehicle.autopilot
    assert facts is not None  # check_plan refuses a vehicle that we know nothing of
    items = wire_items(plan, facts)
    report = UploadReport(
        autopilot=vehicle.autopilot_title,
        vehicle=vehicle.vehicle_title,
        system_id=vehicle.system_id,
        items=len(plan.items),
        fence_points=len(items[FENCE]),
        rally_points=len(items[RALLY]),
        verified=None,
        fence_enforced=fence_enforced(connection, vehicle),
        changed=(),
        vehicle_state="unchanged",
        warnings=tuple(warnings),
    )
    if dry_run:
        return report
    with Transfer(connection, vehicle) as transfer:
        held = {kind: transfer.download(kind) for kind in KINDS}
        changed = _send_or_restore(transfer, items, held, facts, progress, lambda: _gone(connection, vehicle))
    return replace(report, verified=True, changed=changed, vehicle_state="new plan")


def _gone(connection: Connection, vehicle: FoundVehicle) -> bool:
    """Return whether the vehicle gives no sign of life; heartbeats come once a second."""
    try:
        with connection.inbox(system_id=vehicle.system_id) as inbox:
            return next(inbox.until(time.monotonic() + LIFE_S), None) is None
    except SparsorError:
        return True


def _send_or_restore(
    transfer: Transfer, items: Items, held: Items, facts: Autopilot, progress: Progress, gone: Callable[[], bool]
) -> tuple[str, ...]:
    """Send everything and compare; on failure leave the vehicle in a state that can be named, and name it."""
    try:
        for kind in KINDS:
            transfer.upload(kind, items[kind], progress)
        transfer.set_current(0)
        return _verified(transfer, items, facts, progress)
    except LinkFailureError as error:
        state = UNKNOWN if gone() else _restored(transfer, held, facts)
        raise LinkFailureError(f"{error}. The vehicle: {state}") from error
    except KeyboardInterrupt as interrupt:
        transfer.cancel()
        state = UNKNOWN if gone() else _restored(transfer, held, facts)
        raise LinkFailureError(f"interrupted. The vehicle: {state}") from interrupt


def _verified(transfer: Transfer, items: Items, facts: Autopilot, progress: Progress) -> tuple[str, ...]:
    found: list[Difference] = []
    for place, kind in enumerate(KINDS):
        progress("read back", place, len(KINDS))
        found += differences(kind, items[kind], transfer.download(kind), home_is_item_0=facts.home_is_item_0)
    progress("read back", len(KINDS), len(KINDS))
    harmful = [one.sentence for one in found if not one.harmless]
    if harmful:
        more = f" (and {len(harmful) - 3} more)" if len(harmful) > 3 else ""
        raise LinkFailureError("the vehicle holds another plan than was sent: " + " ".join(harmful[:3]) + more)
    return tuple(summary(found))


def _restored(transfer: Transfer, held: Mapping[int, tuple[WireItem, ...]], facts: Autopilot) -> str:
    """Send back what was there, or empty the vehicle; say which."""
    try:
        for kind in KINDS:
            transfer.upload(kind, held[kind])
        _verified(transfer, dict(held), facts, silent)
    except LinkFailureError:
        try:
            for kind in (MISSION, FENCE, RALLY):
                transfer.clear(kind)
        except LinkFailureError:
            return UNKNOWN
        return "the new plan was cleared, it holds none now"
    return "it holds its old plan again" if held[MISSION] else "it holds no plan, as before"
