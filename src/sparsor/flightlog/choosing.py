"""Which vehicle and which sensor of a log are meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sparsor.errors import LogError
from sparsor.flightlog.log import AMBIENT
from sparsor.flightlog.table import ONLY_VALUE

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sparsor.flightlog.log import FlightLog, NamedValues

_MOST_LISTED = 20


def sensors(log: FlightLog) -> tuple[NamedValues, ...]:
    """Return the series that may be a sensor's: all but the autopilot's own air pressure and temperature."""
    return tuple(values for values in log.values if values.message != AMBIENT)


def chosen_sensor(log: FlightLog, sensor: str | None) -> NamedValues:
    """Return the series that is meant.

    Parameters
    ----------
    log : FlightLog
    sensor : str or None
        NAME, NAME@SYSTEM/COMPONENT, or MSG.FIELD of a .BIN file; None when there is only one.

    Raises
    ------
    LogError
        When there is none of that name, or more than one.
    """
    all_of_them = sensors(log)
    if sensor is None:
        found: Sequence[NamedValues] = all_of_them
    else:
        found = [one for one in log.values if sensor in (one.name, f"{one.name}@{one.sender}")]
        if not found and len(all_of_them) == 1 and all_of_them[0].name == ONLY_VALUE:
            found = all_of_them  # a table whose column does not say what it measured
    if len(found) == 1:
        return found[0]
    files = ", ".join(log.files)
    asked = f"'{sensor}'" if sensor is not None else "a sensor"
    if found:
        raise LogError(f"{files}: {asked} may be any of {_listed(found)}; choose one with --sensor")
    if all_of_them:
        fields = _fields_like(log, sensor or "")
        raise LogError(f"{files}: there is no sensor {asked}; there are {_listed(all_of_them)}{fields}; give --sensor")
    heard = ", ".join(f"{sender} ({count} messages)" for sender, count in log.heard.items())
    raise LogError(
        f"{files}: {asked} is asked for, but no sensor is in the log, only messages of {heard or 'nobody'}"
        f"{_fields_like(log, sensor or '')}; record NAMED_VALUE_FLOAT or give another log"
    )


def chosen_vehicle(log: FlightLog, values: NamedValues, system: int | None) -> int:
    """Return the system whose positions count.

    Raises
    ------
    LogError
        When that system has no positions, or several have and none is the sensor's.
    """
    vehicles = log.vehicles
    files, listed = ", ".join(log.files), ", ".join(map(str, vehicles))
    if not vehicles:
        raise LogError(f"{files}: no position of any vehicle is in the log; record GLOBAL_POSITION_INT as well")
    if system is not None:
        if system not in vehicles:
            raise LogError(f"{files}: system {system} has no positions; those of {listed} are there: give --system")
        return system
    if len(vehicles) == 1:
        return vehicles[0]
    if values.sender.system in vehicles:
        return values.sender.system
    raise LogError(f"{files}: the sensor {values.sender} may fly on any of {listed}; choose one with --system")


def _listed(found: Iterable[NamedValues]) -> str:
    names = [f"{one.name}@{one.sender}" for one in found]
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more


def _fields_like(log: FlightLog, sensor: str) -> str:
    """Return the fields of a .BIN message that was asked for by a wrong field name."""
    message = sensor.partition(".")[0]
    fields = [field for field in log.fields if field.partition(".")[0] == message]
    return f"; {message} has {', '.join(fields)}" if fields else ""
