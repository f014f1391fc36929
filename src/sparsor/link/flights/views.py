"""What a flight shows: events as they happen, and the state at one moment."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """Something that happened.

    Parameters
    ----------
    text : str
        A sentence.
    warning : bool
    detail : bool
        Only for those who want to know everything.
    """

    text: str
    warning: bool = False
    detail: bool = False


@dataclass(frozen=True)
class View:
    """The flight at one moment; None for what is not known yet.

    Parameters
    ----------
    item, items : int
        Which item is flown (1 is the plan's first), of how many.
    mode : str or None
    flown_m, left_m, left_s : float
    height_m, ground_speed_m_s : float or None
        Above home.
    battery_percent : int or None
    samples : int
    sample : str or None
        The last one.
    sample_age_s, sample_rate_hz : float or None
    """

    item: int
    items: int
    mode: str | None
    flown_m: float
    left_m: float | None
    left_s: float | None
    height_m: float | None
    ground_speed_m_s: float | None
    battery_percent: int | None
    samples: int
    sample: str | None
    sample_age_s: float | None
    sample_rate_hz: float | None


@dataclass(frozen=True)
class Fix:
    """Where the vehicle was (GLOBAL_POSITION_INT); `time_s` since its start, `height_m` above home."""

    time_s: float
    lon_deg: float
    lat_deg: float
    height_m: float
    ground_speed_m_s: float
