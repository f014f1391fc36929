"""A companion computer's sensor on its way into the telemetry: lines of text to NAMED_VALUE_FLOAT."""

from __future__ import annotations

from sparsor.link.sensing.formats import Columns, Pattern
from sparsor.link.sensing.lines import Source
from sparsor.link.sensing.outlet import Outlet
from sparsor.link.sensing.readings import LineFormat, Reading
from sparsor.link.sensing.replay import ReplayedFile
from sparsor.link.sensing.sender import Sent, send_samples
from sparsor.link.sensing.sources import PipedLines, SensorPort

__all__ = [
    "Columns",
    "LineFormat",
    "Outlet",
    "Pattern",
    "PipedLines",
    "Reading",
    "ReplayedFile",
    "SensorPort",
    "Sent",
    "Source",
    "send_samples",
]
