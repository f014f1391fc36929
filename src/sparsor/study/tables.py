"""Tables of figures as text, CSV and Markdown."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

_DIGITS = ".4g"


@dataclass(frozen=True)
class Table:
    """Named columns and rows.

    Parameters
    ----------
    title : str
    columns : tuple of str
        With their units.
    rows : tuple of tuples
        Numbers and words; None where there is nothing.
    notes : tuple of str
        Sentences that the table is never shown without.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]
    notes: tuple[str, ...] = ()

    def csv(self) -> bytes:
        """Return the table as CSV, every digit kept."""
        stream = io.StringIO()
        for note in self.notes:
            stream.write(f"# {note}\n")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows([["" if one is None else one for one in row] for row in self.rows])
        return stream.getvalue().encode()

    def markdown(self) -> str:
        """Return the table as Markdown, its notes beneath."""
        cells = [[shown(one).replace("|", "\\|") for one in row] for row in (self.columns, *self.rows)]
        lines = [f"| {' | '.join(row)} |" for row in cells]
        lines.insert(1, "|---" * len(self.columns) + "|")
        return "\n".join([*lines, *(f"\n*{note}*" for note in self.notes)]) + "\n"

    def text(self) -> str:
        """Return the table in columns of equal width."""
        cells = [self.columns, *(tuple(map(shown, row)) for row in self.rows)]
        widths = [max(len(row[k]) for row in cells) for k in range(len(self.columns))]
        lines = ["  ".join(one.ljust(width) for one, width in zip(row, widths, strict=True)).rstrip() for row in cells]
        return "\n".join([self.title, "", *lines, *(f"\n{note}" for note in self.notes)]) + "\n"


def shown(value: object) -> str:
    """Return a value as people read it."""
    if value is None:
        return "-"
    return format(value, _DIGITS) if isinstance(value, float) else str(value)
