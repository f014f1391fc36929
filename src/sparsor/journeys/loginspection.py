"""What a flight log holds, in words and as plain values."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.flightlog import read_log

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.flightlog import Boot, Damage, FlightLog, NamedValues

KINDS = {"tlog": "a telemetry log", "BIN": "an ArduPilot log", "ulg": "a PX4 log", "CSV": "a table"}
MOST_LISTED = 20


def inspect_log(path: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return what a log holds: plain values for JSON, and the same in words.

    Raises
    ------
    LogError
        When it cannot be read.
    """
    log = read_log(path)
    boots = [_boot_contents(log, boot) for boot in log.boots]
    values = [_value_contents(one) for one in log.values]
    contents = {
        "log_kind": log.kinds[0],
        "vehicles": list(log.vehicles),
        "heard": {str(sender): count for sender, count in sorted(log.heard.items())},
        "boots": boots,
        "values": values,
        "damage": asdict(log.damage),
    }
    listed = [f"{one['name']}@{one['sender']}: {one['count']}, {_range(one)}" for one in values]
    lines = (
        f"{path}: {KINDS[log.kinds[0]]} ({log.kinds[0]})",
        f"Vehicles with positions: {', '.join(map(str, log.vehicles)) or 'none'}."
        + (f" Heard (system/component): {', '.join(map(str, sorted(log.heard)))}." if log.heard else ""),
        *(_boot_line(one) for one in boots),
        *(f"Values {line}" for line in listed[:MOST_LISTED]),
        *([f"... and {len(listed) - MOST_LISTED} more values"] if len(listed) > MOST_LISTED else []),
        *([] if listed else ["No named values: no sensor was heard."]),
        _damage_line(log.damage),
    )
    return contents, lines


def _boot_contents(log: FlightLog, boot: Boot) -> dict[str, Any]:
    known = bool(np.isfinite(boot.unix_offset_s))
    events = [event for event in log.events if (event.system, event.boot) == (boot.system, boot.number)]
    return {
        "system": boot.system,
        "seconds": round(boot.end_s - boot.start_s, 3),
        "start": _date(boot.unix_offset_s + boot.start_s) if known else None,
        "end": _date(boot.unix_offset_s + boot.end_s) if known else None,
        "positions": {track.message: int(track.time_s.size) for track in boot.tracks if track.time_s.size},
        "armed": sum(event.kind == "armed" for event in events),
    }


def _value_contents(values: NamedValues) -> dict[str, Any]:
    finite = values.value[np.isfinite(values.value)]
    return {
        "name": values.name,
        "sender": str(values.sender),
        "message": values.message,
        "count": int(values.value.size),
        "lowest": float(finite.min()) if finite.size else None,
        "highest": float(finite.max()) if finite.size else None,
    }


def _range(value: dict[str, Any]) -> str:
    if value["lowest"] is None:
        return "not a number"
    return f"{value['lowest']:.4g} to {value['highest']:.4g}"


def _boot_line(boot: dict[str, Any]) -> str:
    when = f", {boot['start']} to {boot['end']}" if boot["start"] else ", the date is unknown"
    places = ", ".join(f"{count} {message}" for message, count in boot["positions"].items()) or "no positions"
    return f"Vehicle {boot['system']}: {boot['seconds'] / 60:.1f} min{when}; {places}; armings: {boot['armed']}."


def _damage_line(damage: Damage) -> str:
    said = (
        (damage.places, f"broken at {damage.places} places ({damage.skipped_bytes} bytes passed over)"),
        (damage.unknown, f"{damage.unknown} messages of unknown kinds"),
        (damage.lost, f"{damage.lost} messages were sent and never recorded"),
    )
    words = "; ".join(sentence for count, sentence in said if count)
    return f"Damage: {words}." if words else "Whole: nothing is damaged or missing."


def _date(unix_s: float) -> str:
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H:%M:%SZ}"
