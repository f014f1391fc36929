"""Whether a vehicle keeps to an uploaded fence, and making it do so."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError, LinkFailureError
from sparsor.link.parameters import Parameter, read_parameter, set_parameter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.link.connection import Connection
    from sparsor.link.vehicles import FoundVehicle
    from sparsor.mission import MissionPlan

POLYGONS: Final = 4  # bit of ArduPilot's FENCE_TYPE (AC_FENCE_TYPE_POLYGON); uploaded circles belong to it
CEILING: Final = 1  # AC_FENCE_TYPE_ALT_MAX
PX4_HOLD: Final = 2  # GF_ACTION: 0 none, 1 warning, 2 hold, 3 return, 4 terminate, 5 land


@dataclass(frozen=True)
class FenceOrder:
    """What has to be set so that the fence is enforced, and what is set now.

    Parameters
    ----------
    wanted, held : tuple of Parameter
        In the order of setting.
    warnings : tuple of str
    """

    wanted: tuple[Parameter, ...]
    held: tuple[Parameter, ...]
    warnings: tuple[str, ...] = ()


def fence_enforced(connection: Connection, vehicle: FoundVehicle) -> bool | None:
    """Return whether the vehicle will keep to an uploaded fence; None when it does not say.

    ArduPilot: FENCE_ENABLE is set and FENCE_TYPE has the bit of polygons. PX4: GF_ACTION is more than a warning.
    """
    if _is_px4(vehicle):
        action = read_parameter(connection, vehicle, "GF_ACTION")
        return None if action is None else action.value >= PX4_HOLD
    enabled = read_parameter(connection, vehicle, "FENCE_ENABLE")
    if enabled is None or not enabled.value:
        return None if enabled is None else False
    kinds = read_parameter(connection, vehicle, "FENCE_TYPE")
    return None if kinds is None else bool(int(kinds.value) & POLYGONS)


def fence_ceiling_m(connection: Connection, vehicle: FoundVehicle) -> float | None:
    """Return the height above home at which an enabled altitude fence of ArduPilot begins; None without one.

    FENCE_ENABLE is set, FENCE_TYPE has the bit 1; FENCE_ALT_MAX, metres.
    """
    if vehicle.autopilot is None or _is_px4(vehicle):
        return None
    enabled = read_parameter(connection, vehicle, "FENCE_ENABLE")
    if enabled is None or not enabled.value:
        return None
    kinds = read_parameter(connection, vehicle, "FENCE_TYPE")
    if kinds is None or not int(kinds.value) & CEILING:
        return None
    highest = read_parameter(connection, vehicle, "FENCE_ALT_MAX")
    return None if highest is None else highest.value


def order_fence(connection: Connection, vehicle: FoundVehicle, plan: MissionPlan) -> FenceOrder:
    """Read what is set now; nothing is changed.

    ArduPilot: FENCE_TYPE 4, the polygon alone (FENCE_ENABLE would also arm the default circle and ceiling), then
    FENCE_ENABLE 1. PX4: GF_ACTION 2 (hold) where it is 0 (none) or 1 (warning).

    Raises
    ------
    LinkError
        When the plan has no fence.
    LinkFailureError
        When the vehicle does not tell what is set.
    """
    if not plan.fences and not plan.circles:
        raise LinkError("the plan has no fence to enforce: leave out --enable-fence, or draw one in QGroundControl")
    if _is_px4(vehicle):
        action = _told(connection, vehicle, "GF_ACTION")
        weak = action.value < PX4_HOLD
        return FenceOrder((replace(action, value=float(PX4_HOLD)),) if weak else (), (action,) if weak else ())
    kinds, enabled = (_told(connection, vehicle, name) for name in ("FENCE_TYPE", "FENCE_ENABLE"))
    breach = read_parameter(connection, vehicle, "FENCE_ACTION")
    only_told = breach is not None and breach.value == 0
    warnings = ("FENCE_ACTION is 0: the vehicle reports a breach of the fence and flies on.",) if only_told else ()
    wanted = (replace(kinds, value=float(POLYGONS)), replace(enabled, value=1.0))
    return FenceOrder(wanted, (kinds, enabled), warnings)


def enforce_fence(connection: Connection, vehicle: FoundVehicle, asked: FenceOrder) -> None:
    """Set what has to be set and read it back; set back what was there when that fails or is interrupted.

    Raises
    ------
    LinkFailureError
        When it failed; says what is set now.
    """
    try:
        for parameter in asked.wanted:
            set_parameter(connection, vehicle, parameter)
        for parameter in asked.wanted:
            _check_held(connection, vehicle, parameter)
    except LinkFailureError as error:
        raise LinkFailureError(
            f"the fence is not enforced: {error}. {_restored(connection, vehicle, asked.held)}"
        ) from error
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt(_restored(connection, vehicle, asked.held)) from interrupt


def _check_held(connection: Connection, vehicle: FoundVehicle, wanted: Parameter) -> None:
    found = _told(connection, vehicle, wanted.name)
    if found.value != wanted.value:
        raise LinkFailureError(f"{wanted.name} is {found.value:g}, it was set to {wanted.value:g}")


def _restored(connection: Connection, vehicle: FoundVehicle, held: Sequence[Parameter]) -> str:
    """Set back, the last first; say what is set."""
    values = " and ".join(f"{parameter.name} {parameter.value:g}" for parameter in held)
    try:
        for parameter in reversed(held):
            set_parameter(connection, vehicle, parameter)
    except LinkFailureError:
        return f"What was set before could not be set again either: see to it that it has {values}"
    return f"It has {values} again"


def _told(connection: Connection, vehicle: FoundVehicle, name: str) -> Parameter:
    found = read_parameter(connection, vehicle, name)
    if found is None:
        raise LinkFailureError(f"the vehicle does not tell {name}")
    return found


def _is_px4(vehicle: FoundVehicle) -> bool:
    return vehicle.autopilot is not None and vehicle.autopilot.name == "px4"
