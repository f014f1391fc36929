"""What a model learned at another ground size costs."""

from __future__ import annotations

# Measured by scripts/bench/size_mismatch.py; see docs/decisions/0008-ground-size.md.
_EXPONENT = 0.15


def mismatch_factor(ratio: float) -> float:
    """Return the factor on the expected error when windows and box differ in size by `ratio`, 1 or above.

    Examples
    --------
    >>> mismatch_factor(1.0)
    1.0
    """
    return float(max(ratio, 1.0) ** _EXPONENT)
