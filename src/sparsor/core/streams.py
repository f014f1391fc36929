"""Independent random streams from one seed."""

from __future__ import annotations

import numpy as np


def stream(seed: int, *key: int) -> np.random.Generator:
    """Return the random stream that belongs to `key` under `seed`.

    Streams of different keys are independent, and a stream depends on nothing but its seed and key: which
    worker draws it, and how many there are, makes no difference.

    Parameters
    ----------
    seed : int
        The user's seed, 0 or above.
    *key : int
        Names the stream, e.g. the number of the Monte-Carlo sample.

    Examples
    --------
    >>> bool(stream(1, 7).random() == stream(1, 7).random())
    True
    >>> bool(stream(1, 7).random() == stream(1, 8).random())
    False
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
