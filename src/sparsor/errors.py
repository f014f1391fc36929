"""The exception tree: every error that sparsor raises on purpose.

Each message says what is wrong, the value that was given, what is allowed and the next thing to try. The
command line prints the message and ends with ``exit_code``; programs that import sparsor catch the classes.
"""

from __future__ import annotations


class SparsorError(Exception):
    """Base of everything sparsor raises on purpose."""

    exit_code = 1


class InputError(SparsorError, ValueError):
    """What was asked for is wrong: nothing was started, nothing was written."""

    exit_code = 2


class BoxError(InputError):
    """A bounding box that is not one: swapped sides, a latitude out of range, no size or too large."""


class AreaError(InputError):
    """An area file that cannot be read or holds no usable polygon."""


class TerrainError(InputError):
    """An elevation model that cannot be read, or that does not know the ground under what is flown."""


class FieldError(InputError):
    """A field of training values that cannot be read or used."""


class EmptyFieldError(FieldError):
    """A field of nothing but gaps, or with gaps in every window."""


class ModelError(InputError):
    """A model file that cannot be read, or that does not fit what is asked of it."""


class DesignError(InputError):
    """Search settings outside their range."""


class BudgetError(InputError):
    """A flight budget that cannot be read, or that no route meets."""


class SchedulerError(InputError):
    """A scheduler that does not answer, has no workers, or whose workers would give another answer."""


class WorkersLostError(SparsorError):
    """The scheduler went away in the middle, or workers died again and again."""


class VehicleError(InputError):
    """A vehicle or sensor profile that is unknown or outside its range."""


class MissionError(InputError):
    """A mission specification, plan or mission folder that cannot be used."""


class LinkError(InputError):
    """An address, a vehicle or a plan for it that cannot be the one that was meant; nothing was sent."""


class LinkFailureError(SparsorError):
    """The link or the vehicle failed on the way: silent, lost, refused, or not holding what was sent."""


class LeftBehindError(LinkFailureError):
    """It failed after something was sent to a vehicle.

    Parameters
    ----------
    message : str
    vehicle_state : str
        What the vehicle holds or does now.
    recording : str or None
        Path of the .tlog of what passed on the link until then.
    """

    def __init__(self, message: str, vehicle_state: str, recording: str | None = None) -> None:
        super().__init__(message)
        self.vehicle_state, self.recording = vehicle_state, recording


class StoppedError(LeftBehindError):
    """Ctrl-C ended it after something was sent to a vehicle."""

    exit_code = 130


class LogError(InputError):
    """A flight log that cannot be read, or that lacks what is asked of it."""


class CalibrationError(InputError):
    """A calibration, unit or gas that is unknown, or that the log does not hold what is needed for."""


class DownloadError(SparsorError):
    """A file that the network did not give: the server is not there, lacks it, or gave another."""


class OutputError(SparsorError):
    """The result could not be written: the folder is read-only, full or gone."""
