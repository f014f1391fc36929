"""An even sample of maps that come set by set, of bounded size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.streams import stream

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STREAM = 6  # not one of the searches', nor of the rehearsal's


class Reservoir:
    """Keeps all maps as long as there are no more than `most`, then as many, each as likely as any other.

    Every map draws a number; those of the lowest numbers are kept, in the order in which they came. So what is kept
    depends on the maps' places in the stream and on nothing else.

    Parameters
    ----------
    most : int
        Maps to keep.
    cells : int
        N.
    key : int
        Names its random stream.
    """

    def __init__(self, most: int, cells: int, *key: int) -> None:
        self.seen = 0
        self._most, self._rng = most, stream(0, _STREAM, *key)
        self._maps, self._numbers = np.empty((0, cells)), np.empty(0)

    def add(self, maps: NDArray[np.float64]) -> None:
        """Let maps in, (n, N)."""
        numbers = self._rng.random(len(maps))
        self.seen += len(maps)
        full = len(self._numbers) == self._most
        wanted = numbers < (self._numbers.max(initial=0.0) if full else 1.0)
        if not wanted.any():
            return
        numbers = np.concatenate([self._numbers, numbers[wanted]])
        kept = np.sort(numbers.argsort()[: self._most])
        # From the two parts at once: both together may be much larger than what is kept.
        held, new = kept[kept < len(self._maps)], kept[kept >= len(self._maps)] - len(self._maps)
        self._maps = np.concatenate([self._maps[held], maps[np.flatnonzero(wanted)[new]]])
        self._numbers = numbers[kept]

    @property
    def maps(self) -> NDArray[np.float64]:
        """The maps kept, (n, N)."""
        return self._maps
