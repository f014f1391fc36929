"""A plan onto a vehicle: checked, sent, read back and compared."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LeftBehindError, LinkFailureError, SparsorError, StoppedError
from sparsor.link.fence import enforce_fence, fence_ceiling_m, fence_enforced, order_fence
from sparsor.link.missions.checks import above_the_fence, check_plan, far_from_home
from sparsor.link.missions.readback import differences, summary
from sparsor.link.missions.transfer import Transfer
from sparsor.link.missions.wire import FENCE, KINDS, MISSION, RALLY, WireItem, wire_items

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sparsor.core.progress import Progress
    from sparsor.link.connection import Connection
    from sparsor.link.fence import FenceOrder
    from sparsor.link.missions.readback import Difference
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan
    from sparsor.vehicle import Autopilot

Items = dict[int, tuple[WireItem, ...]]
UNKNOWN: Final = "state unknown, do not arm"
NEW_PLAN: Final = "new plan"
LIFE_S: Final = 3.0
SENDINGS: Final = 3


class DifferentPlanError(LinkFailureError):
    """What was read back is not what was sent."""


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
    started : bool or None
        Whether the mission was started; None when that was not asked for.
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
    started: bool | None = None


def upload_plan(
    plan: MissionPlan,
    connection: Connection,
    vehicle: FoundVehicle,
    *,
    dry_run: bool = False,
    force: bool = False,
    enable_fence: bool = False,
    progress: Progress = silent,
) -> UploadReport:
    """Send a plan to a vehicle, read it back and compare.

    What the vehicle held is read first. A plan that is read back otherwise than it was sent is sent again, twice at
    most. When the transfer fails while the link lives, the old plan is sent back (or, where this fails too, the
    vehicle is emptied), and the error says which.

    Parameters
    ----------
    plan : MissionPlan
    connection : Connection
    vehicle : FoundVehicle
    dry_run : bool
        Check everything and send nothing.
    force : bool
        Send to an armed vehicle too.
    enable_fence : bool
        Make the vehicle keep to the plan's fence, once it holds it.
    progress : Progress

    Raises
    ------
    LinkError
        When the plan must not go to this vehicle; nothing was sent.
    LinkFailureError
        When the link or the vehicle failed before anything was sent.
    LeftBehindError
        When the transfer or the fence failed; says what the vehicle holds now. StoppedError after a Ctrl-C.
    """
    warnings = [*check_plan(plan, vehicle, force=force), *far_from_home(plan, vehicle, connection)]
    warnings += above_the_fence(plan, None if enable_fence else fence_ceiling_m(connection, vehicle))
    fence = order_fence(connection, vehicle, plan) if enable_fence else None
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
        warnings=(*warnings, *(fence.warnings if fence else ())),
    )
    if dry_run:
        return report
    with Transfer(connection, vehicle) as transfer:
        held = {kind: transfer.download(kind) for kind in KINDS}
        changed = _send_or_restore(transfer, items, held, facts, progress, lambda: _gone(connection, vehicle))
    report = replace(report, verified=True, changed=changed, vehicle_state=NEW_PLAN)
    if fence is None:
        return report
    _enforce(connection, vehicle, fence)
    return replace(report, fence_enforced=True)


def _enforce(connection: Connection, vehicle: FoundVehicle, fence: FenceOrder) -> None:
    try:
        enforce_fence(connection, vehicle, fence)
    except LinkFailureError as error:
        raise LeftBehindError(f"{error}. The vehicle holds the new plan", NEW_PLAN) from error
    except KeyboardInterrupt as interrupt:
        fence_now = str(interrupt) or "Its fence may be enforced or not"
        raise StoppedError(f"interrupted. {fence_now}. The vehicle holds the new plan", NEW_PLAN) from interrupt


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
        return _sent(transfer, items, facts, progress)
    except LinkFailureError as error:
        state = _left(transfer, held, facts, gone)
        raise LeftBehindError(f"{str(error).removesuffix('.')}. The vehicle: {state}", state) from error
    except KeyboardInterrupt as interrupt:
        transfer.cancel()
        state = _left(transfer, held, facts, gone)
        raise StoppedError(f"interrupted. The vehicle: {state}", state) from interrupt


def _sent(transfer: Transfer, items: Items, facts: Autopilot, progress: Progress) -> tuple[str, ...]:
    """Send everything until it is read back as it was sent."""
    for left in reversed(range(SENDINGS)):
        for kind in KINDS:
            transfer.upload(kind, items[kind], progress)
        transfer.set_current(0)
        try:
            return _verified(transfer, items, facts, progress)
        except DifferentPlanError:
            if not left:
                raise
    raise AssertionError("the last sending returns or raises")


def _left(transfer: Transfer, held: Items, facts: Autopilot, gone: Callable[[], bool]) -> str:
    """Return what the vehicle is left with; a second Ctrl-C ends trying to make that the old plan."""
    try:
        return UNKNOWN if gone() else _restored(transfer, held, facts)
    except KeyboardInterrupt:
        return UNKNOWN


def _verified(transfer: Transfer, items: Items, facts: Autopilot, progress: Progress) -> tuple[str, ...]:
    found: list[Difference] = []
    for place, kind in enumerate(KINDS):
        progress("read back", place, len(KINDS))
        found += differences(kind, items[kind], transfer.download(kind), home_is_item_0=facts.home_is_item_0)
    progress("read back", len(KINDS), len(KINDS))
    harmful = [one.sentence for one in found if not one.harmless]
    if harmful:
        more = f" (and {len(harmful) - 3} more)" if len(harmful) > 3 else ""
        raise DifferentPlanError("the vehicle holds another plan than was sent: " + " ".join(harmful[:3]) + more)
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
