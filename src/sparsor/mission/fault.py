"""One thing that is wrong with a plan."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a plan.

    Parameters
    ----------
    sentence : str
    serious : bool
        Whether the plan must not be sent to a vehicle like this; what is not serious has to be known.
    wrong : bool
        Whether the plan cannot be flown as it is, though somebody may want to send it; serious ones always are.
    """

    sentence: str
    serious: bool = False
    wrong: bool = False

    @property
    def fails(self) -> bool:
        """Whether a check of the plan fails by it; else it is a warning."""
        return self.serious or self.wrong
