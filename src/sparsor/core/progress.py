"""How long work tells that it goes on, without knowing who listens."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """What a stage calls while it works; the command line turns it into a bar."""

    def __call__(self, task: str, done: int, total: int) -> None:
        """Say that `done` of `total` steps of `task` are finished."""
        ...


def silent(task: str, done: int, total: int) -> None:
    """Ignore progress: the default wherever progress is optional."""
    del task, done, total
