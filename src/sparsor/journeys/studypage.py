"""What a study leaves behind: files of each field, and the page of results."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.plot.curves import Panel, curves_png
from sparsor.plot.example import ExampleMap, example_png
from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.store import code_hash, versions
from sparsor.study.summary import DEFINITIONS, all_rows, headline, means, seconds

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from sparsor.study.figures import Figure
    from sparsor.study.peers import Peers
    from sparsor.study.scoreboard import Source
    from sparsor.study.settings import StudySettings
    from sparsor.study.tables import Table


@dataclass(frozen=True)
class FieldResults:
    """Everything that a study found out about one field.

    Parameters
    ----------
    name : str
    source : Source
    rows : tuple of dict
        Of the scoreboard.
    figures : tuple of Figure
    board : tuple of Panel
        All curves of error against length.
    claims : Table
    example : dict
        See `sparsor.study.example.example`.
    """

    name: str
    source: Source
    rows: tuple[dict[str, Any], ...]
    figures: tuple[Figure, ...]
    board: tuple[Panel, ...]
    claims: Table
    example: dict[str, Any]

    def files(self) -> dict[str, bytes]:
        """Return tables and pictures, by name."""
        unit = self.source.field.unit
        board = means(self.rows, unit)
        title = f"Error against path length, blocked: {self.name}"
        files = {
            "scoreboard.csv": all_rows(self.rows, unit).csv(),
            "scoreboard-means.csv": board.csv(),
            "scoreboard.md": board.markdown().encode(),
            "scoreboard.txt": board.text().encode(),
            "scoreboard.png": curves_png(title, self.board, DEFINITIONS),
            "seconds.csv": seconds(self.rows).csv(),
            "claims.csv": self.claims.csv(),
            "example.png": self._example_png(),
        }
        for one in self.figures:
            files[f"{one.name}.csv"] = one.table.csv()
            caption = f"Paper: {one.claimed}. Here: {one.found}. {'. '.join(one.table.notes)}"
            files[f"{one.name}.png"] = curves_png(f"{one.title}: {self.name}", one.panels, caption)
        return files

    def _example_png(self) -> bytes:
        side = round(len(self.example["truth"]) ** 0.5)
        maps = [ExampleMap("a test map of the first blocked fold", np.array(self.example["truth"]).reshape(side, side))]
        for one in self.example["flights"]:
            words = f"{one['title']}\npath {one['length']:.0f} cell units, |s - s'| / |s| = {one['error']:.3f}"
            maps.append(ExampleMap(words, np.array(one["map"]).reshape(side, side), np.array(one["stops"])))
        return example_png(f"Example: {self.name}", tuple(maps), "0..1 scale of the training windows")


def results_page(
    results: Sequence[FieldResults],
    settings: StudySettings,
    command: str,
    folder: Path,
    page: Path,
    peers: Peers | None = None,
) -> str:
    """Return the page of results in Markdown.

    Parameters
    ----------
    results : sequence of FieldResults
    settings : StudySettings
    command : str
        That made it.
    folder : Path
        Of the files.
    page : Path
        Where it will lie: links are relative to it.
    peers : Peers, optional
        Planners by others that ran.
    """
    used = versions() | (peers.versions if peers else {})
    known = ", ".join(f"{name} {version}" for name, version in used.items())
    parts = [
        "# Results",
        f"Written by `{command}`; do not edit. The {settings.name} study, seed {settings.seed}; {known}; source "
        f"{code_hash()}. Everything but the seconds comes out the same again on one machine.",
        f"{DEFINITIONS}.",
        "`blocked` is the accuracy to expect: no test window overlaps one of training or validation.",
    ]
    for one in results:
        parts += _field(one, settings, os.path.relpath(folder / one.name, page.parent).replace(os.sep, "/"))
    return "\n\n".join(parts) + "\n"


def _field(one: FieldResults, settings: StudySettings, folder: str) -> list[str]:
    maps, source = one.source.maps, one.source
    pixels = "native pixels" if source.pixels is None else f"resampled to {source.pixels[1]} x {source.pixels[0]}"
    parts = [
        f"## {one.name}",
        f"{source.field.source}; sha256 {source.digest}; "
        f"{len(maps.maps)} maps, {maps.dropped} dropped, {maps.filled} with "
        f"gaps filled; {pixels}.",
        "### The abstract's claims",
        one.claims.markdown(),
        "### Scoreboard",
        f"![All curves]({folder}/scoreboard.png)",
    ]
    for noise in settings.noises:
        table = headline(one.rows, "relative", protocol="blocked", noise=noise)
        parts += [
            f"Relative error, `blocked`, noise {noise:g}, by path length as a share of full coverage:",
            table.markdown(),
        ]
    table = headline(one.rows, "relative", protocol="random", noise=settings.noises[0])
    parts += [f"Relative error, `random`, noise {settings.noises[0]:g} ({OVERLAP_NOTE}):", table.markdown()]
    parts += [
        f"Every split, decoder and error: [CSV]({folder}/scoreboard.csv); means: [Markdown]({folder}/scoreboard.md).",
        "Seconds to plan, of the machine that ran it, its workers sharing the cores:",
        seconds(one.rows).markdown(),
        "### The paper's figures",
        f"*{OVERLAP_NOTE}*",
    ]
    for figure in one.figures:
        parts += [
            f"**{figure.title}.** Paper: {figure.claimed}. Here: {figure.found}. ([CSV]({folder}/{figure.name}.csv))",
            f"![{figure.title}]({folder}/{figure.name}.png)",
        ]
    return [*parts, f"**Example.**\n\n![Example]({folder}/example.png)"]
