"""What was logged: tlog, .BIN, .ulg and CSV files as tracks, named values and events, and samples on one clock."""

from sparsor.flightlog.log import (
    AMBIENT,
    Boot,
    Damage,
    DroppedFixes,
    Event,
    FlightLog,
    NamedValues,
    Places,
    Sender,
    Track,
)
from sparsor.flightlog.reading import read_log, read_logs
from sparsor.flightlog.sampling import DroppedSamples, Samples, samples
from sparsor.flightlog.timing import ClockUse

__all__ = [
    "AMBIENT",
    "Boot",
    "ClockUse",
    "Damage",
    "DroppedFixes",
    "DroppedSamples",
    "Event",
    "FlightLog",
    "NamedValues",
    "Places",
    "Samples",
    "Sender",
    "Track",
    "read_log",
    "read_logs",
    "samples",
]
