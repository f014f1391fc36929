"""The samples over time, as SVG for the report."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from sparsor.plot.scales import multiples, round_step

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sparsor.fieldmap.fieldmap import FlownSamples

WIDTH, HEIGHT = 960, 300
LEFT, RIGHT, TOP, BOTTOM = 64, 12, 12, 40
PAUSE_S = 30.0  # between boots, which share no clock
GAP_S = 10.0  # no line is drawn over a longer silence
COLUMNS = 900  # as many samples are drawn as one can see
MOST_MARKS = 2000
# Okabe and Ito's, with a shape each, so that no colour is needed to tell them apart.
MARKS = (
    ("#d55e00", "M-4,-4L4,4M-4,4L4,-4"),
    ("#56b4e9", "M0,-5L5,4L-5,4Z"),
    ("#cc79a7", "M-4,-4H4V4H-4Z"),
    ("#009e73", "M0,-5L5,0L0,5L-5,0Z"),
    ("#e69f00", "M-5,0H5M0,-5V5"),
)


def timeline_svg(samples: FlownSamples, unit: str) -> str:
    """Return value over time as an SVG element: a line through the samples used, marks at those left out."""
    minutes = _minutes(samples)
    used = samples.used
    lines = [("reading", samples.value)]
    if slow := _is_slow(samples):
        lines.append(("air", samples.air))
    frame = _Frame.around(minutes, np.concatenate([samples.value, samples.air[used] if slow else samples.value[:0]]))
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Samples over time">',
        *frame.axes(unit),
        *(f'<path class="line {name}" d="{_line(frame, minutes[used], value[used])}"/>' for name, value in lines),
    ]
    for (reason, _), (colour, shape) in zip(samples.left_out().items(), _marks(), strict=False):
        rows = np.flatnonzero((samples.reason == reason) & np.isfinite(samples.value))
        rows = rows[:: max(1, -(-rows.size // MOST_MARKS))]
        places = zip(*frame.place(minutes[rows], samples.value[rows]), strict=True)
        marks = "".join(f'<path d="{shape}" transform="translate({x:.1f},{y:.1f})"/>' for x, y in places)
        parts.append(f'<g fill="none" stroke="{colour}" stroke-width="1.4">{marks}</g>')
    return "".join([*parts, "</svg>"])


def timeline_key(samples: FlownSamples) -> str:
    """Return what the marks of `timeline_svg` mean, as HTML."""
    entries = [
        f'<li><svg viewBox="-7 -7 14 14" class="mark" aria-hidden="true"><path d="{shape}" fill="none" '
        f'stroke="{colour}" stroke-width="1.6"/></svg>{escape(reason)} ({count})</li>'
        for (reason, count), (colour, shape) in zip(samples.left_out().items(), _marks(), strict=False)
    ]
    used = f"<li>{_stroke('reading')}{int(samples.used.sum())} samples used</li>"
    if _is_slow(samples):
        used += f"<li>{_stroke('air')}the air, response undone</li>"
    return f'<ul class="key">{used}{"".join(entries)}</ul>'


def _stroke(name: str) -> str:
    return f'<svg viewBox="0 0 14 14" class="mark" aria-hidden="true"><path class="line {name}" d="M0,7H14"/></svg>'


def _is_slow(samples: FlownSamples) -> bool:
    """Return whether the air is another curve than the readings."""
    return not np.array_equal(samples.air, samples.value, equal_nan=True)


def _marks() -> list[tuple[str, str]]:
    """Return colours and shapes, more than there are reasons."""
    return [(colour, shape) for turn in range(len(MARKS)) for colour, shape in (*MARKS[turn:], *MARKS[:turn])]


def _minutes(samples: FlownSamples) -> NDArray[np.float64]:
    """Return minutes since the first sample; boots follow each other after a short pause."""
    step_s = np.diff(samples.time_s, prepend=samples.time_s[:1])
    new_boot = np.diff(samples.boot, prepend=samples.boot[:1]) != 0
    return np.asarray(np.cumsum(np.where(new_boot, PAUSE_S, step_s)) / 60.0)


def _line(frame: _Frame, minutes: NDArray[np.float64], value: NDArray[np.float64]) -> str:
    """Return the path through samples; of many in one column of the picture the lowest and the highest."""
    rows = _envelope(minutes, value)
    x, y = frame.place(minutes[rows], value[rows])
    gap = np.diff(minutes[rows], prepend=-np.inf) > GAP_S / 60.0
    return "".join(f"{'M' if gap[k] else 'L'}{x[k]:.1f},{y[k]:.1f}" for k in range(rows.size))


def _envelope(minutes: NDArray[np.float64], value: NDArray[np.float64]) -> NDArray[np.intp]:
    if minutes.size <= 2 * COLUMNS:
        return np.arange(minutes.size)
    column = np.minimum((minutes - minutes[0]) / (np.ptp(minutes) or 1.0) * COLUMNS, COLUMNS - 1).astype(np.int64)
    ends = []
    for sign in (1.0, -1.0):
        order = np.lexsort((sign * value, column))
        ends.append(order[np.flatnonzero(np.diff(column[order], prepend=-1))])
    return np.unique(np.concatenate(ends))


class _Frame:
    """The axes: where a time and a value lie."""

    def __init__(self, last_min: float, low: float, high: float) -> None:
        self.last_min, self.low, self.high = last_min, low, high

    @classmethod
    def around(cls, minutes: NDArray[np.float64], value: NDArray[np.float64]) -> _Frame:
        known = value[np.isfinite(value)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
        margin = 0.05 * (high - low) or max(abs(high), 1.0) * 0.05
        return cls(float(minutes.max(initial=0.0)) or 1.0, low - margin, high + margin)

    def place(
        self, minutes: NDArray[np.float64], value: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        x = LEFT + minutes / self.last_min * (WIDTH - LEFT - RIGHT)
        y = HEIGHT - BOTTOM - (value - self.low) / (self.high - self.low) * (HEIGHT - TOP - BOTTOM)
        return x, y

    def axes(self, unit: str) -> list[str]:
        """Return grid lines with their numbers, and what the axes are."""
        right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
        along = _ticks(0.0, self.last_min, 10)
        up = _ticks(self.low, self.high, 6)
        x, _ = self.place(along, np.zeros(along.size))
        _, y = self.place(np.zeros(up.size), up)
        parts = [f'<path class="grid" d="M{at:.1f},{TOP}V{bottom}"/>' for at in x]
        parts += [f'<path class="grid" d="M{LEFT},{at:.1f}H{right}"/>' for at in y]
        parts += [
            f'<text x="{at:.1f}" y="{bottom + 16}" text-anchor="middle">{value:g}</text>'
            for at, value in zip(x, along, strict=True)
        ]
        parts += [
            f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
            for at, value in zip(y, up, strict=True)
        ]
        parts.append(f'<text x="{right}" y="{HEIGHT - 6}" text-anchor="end">minutes since the first sample</text>')
        parts.append(f'<text x="{LEFT}" y="{HEIGHT - 6}">{escape(unit)}</text>')
        return parts


def _ticks(low: float, high: float, at_most: int) -> NDArray[np.float64]:
    return multiples(low, high, round_step((high - low) / at_most))
