"""One page about a map, for a browser without a network: nothing in it is loaded from elsewhere."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from html import escape
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

from sparsor.fieldmap.timeline import timeline_key, timeline_svg

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.fieldmap.fieldmap import FieldMap, FlownSamples

CELL_COLUMNS = ("row", "column", "longitude", "latitude", "value", "standard deviation", "samples")


@dataclass(frozen=True, eq=False)
class Report:
    """What the page says.

    Parameters
    ----------
    field_map : FieldMap
    samples : FlownSamples
    map_png, uncertainty_png : bytes
        Pictures.
    summary : sequence of (str, str)
        Names and values, as the command prints them.
    warnings : sequence of str
    """

    field_map: FieldMap
    samples: FlownSamples
    map_png: bytes
    uncertainty_png: bytes
    summary: Sequence[tuple[str, str]]
    warnings: Sequence[str]


def report_html(report: Report) -> bytes:
    """Return the page: map and uncertainty, summary, warnings, samples over time, measured cells, how it was made."""
    field_map, samples = report.field_map, report.samples
    title = f"{field_map.quantity} over {field_map.name}"
    style, script = _part("report.css"), _part("report.js")
    policy = f"default-src 'none'; img-src data:; style-src {_hash(style)}; script-src {_hash(script)}"
    unit = escape(field_map.unit)
    body = [
        f"<header><h1>{escape(title)}</h1></header><main>",
        _warnings(report.warnings),
        '<div class="maps">',
        _figure(report.map_png, f"{title}, map", f"The map in {unit}, the way flown and the samples in its colours."),
        _figure(
            report.uncertainty_png,
            f"{title}, standard deviation",
            f"How far each cell may be off: one standard deviation in {unit}.",
        ),
        "</div>",
        f"<section><h2>Summary</h2>{_rows(report.summary)}</section>",
        f'<section><h2>Samples over time</h2><div class="wide">{timeline_svg(samples, field_map.unit)}</div>'
        f"{timeline_key(samples)}</section>",
        _cells(field_map, samples),
        f"<section><h2>How it was made</h2>{_rows(tuple(field_map.facts.items()))}</section>",
        "</main>",
    ]
    head = (
        '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{escape(title)}</title><style>{style}</style>"
    )
    page = f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{chr(10).join(body)}\n'
    return f"{page}<script>{script}</script></body></html>\n".encode()


def _part(name: str) -> str:
    """Return a part of the page that lies beside this module."""
    return (resources.files("sparsor.fieldmap") / "page" / name).read_text(encoding="utf-8").strip()


def _hash(content: str) -> str:
    """Return what a content security policy allows this very content by."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"


def _figure(png: bytes, alternative: str, caption: str) -> str:
    source = f"data:image/png;base64,{base64.b64encode(png).decode()}"
    return f'<figure><img src="{source}" alt="{escape(alternative)}"><figcaption>{caption}</figcaption></figure>'


def _warnings(warnings: Sequence[str]) -> str:
    if not warnings:
        return ""
    items = "".join(f"<li>{escape(warning)}</li>" for warning in warnings)
    return f'<section class="warnings"><h2>Warnings</h2><ul>{items}</ul></section>'


def _rows(rows: Sequence[tuple[str, str]]) -> str:
    lines = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>' for name, value in rows)
    return f'<div class="wide"><table class="facts"><tbody>{lines}</tbody></table></div>'


def _cells(field_map: FieldMap, samples: FlownSamples) -> str:
    cells = np.flatnonzero(field_map.measured)
    at = field_map.grid.cell_at(samples.lon_deg[samples.used], samples.lat_deg[samples.used])
    counts = np.bincount(at[at >= 0], minlength=field_map.grid.size)
    heads = "".join(f'<th scope="col"><button type="button">{name}</button></th>' for name in CELL_COLUMNS)
    lines = "".join(_cell_line(field_map, cell, counts) for cell in cells.tolist())
    return (
        f"<section><h2>Measured cells</h2><p>{cells.size} of {int(field_map.allowed.sum())} cells, in "
        f"{escape(field_map.unit)}; row 0 is the northmost, column 0 the westmost.</p>"
        f'<div class="wide tall"><table class="cells"><thead><tr>{heads}</tr></thead><tbody>{lines}</tbody></table>'
        "</div></section>"
    )


def _cell_line(field_map: FieldMap, cell: int, counts: NDArray[np.int64]) -> str:
    row, column = divmod(cell, field_map.grid.shape[1])
    lon_deg, lat_deg = field_map.grid.centres_deg(cell)
    numbers = (
        f"{row}",
        f"{column}",
        f"{float(lon_deg):.6f}",
        f"{float(lat_deg):.6f}",
        f"{field_map.values[cell]:.4g}",
        f"{field_map.standard_deviation[cell]:.3g}",
        f"{counts[cell]}",
    )
    return f"<tr>{''.join(f'<td>{number}</td>' for number in numbers)}</tr>"
