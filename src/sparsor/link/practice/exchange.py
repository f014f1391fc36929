"""What passes between the practice autopilot and its links: who sent a message, and where an answer goes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

TEXT_BYTES = 50
Message = Any
"""A message of pymavlink's dialect, which has no common type."""


@dataclass(frozen=True)
class Peer:
    """Who sent a message.

    Parameters
    ----------
    system, component : int
        Source ids of its MAVLink header.
    link : int
        Number of the link it came in on; answers leave by the same.
    """

    system: int
    component: int
    link: int


@dataclass(frozen=True)
class Outgoing:
    """A message to send.

    Parameters
    ----------
    message : pymavlink message
        Not packed yet: each link counts its own sequence numbers.
    link : int, optional
        Default: every link.
    """

    message: Message
    link: int | None = None


def status_text(text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> Outgoing:
    """Return STATUSTEXT to every link; cut to the 50 bytes of the field."""
    return Outgoing(mavlink.MAVLink_statustext_message(severity, text.encode("ascii", "replace")[:TEXT_BYTES]))


def same_sender(one: Peer, other: Peer) -> bool:
    """Whether two messages come from one system and component, whatever the link."""
    return (one.system, one.component) == (other.system, other.component)
