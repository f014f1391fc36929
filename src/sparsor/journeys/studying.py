"""The study: fields in; tables, pictures and a page of results out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sparsor.core.files import write_files
from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, workers_of
from sparsor.errors import InputError
from sparsor.journeys.modelling import cache_folder
from sparsor.journeys.studypage import FieldResults, results_page
from sparsor.prior.reading import read_field
from sparsor.study.against_ipp import against_ipp, board_panels
from sparsor.study.claims import claims
from sparsor.study.example import example
from sparsor.study.figures import figures
from sparsor.study.peers import Peers, find_peers, own_python
from sparsor.study.scoreboard import scoreboard
from sparsor.study.settings import FULL, QUICK, StudySettings
from sparsor.study.sources import builtin_field, source_of
from sparsor.study.store import Store

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.prior.field import Field
    from sparsor.study.scoreboard import Source

BUILTIN = "built-in"


@dataclass(frozen=True)
class StudyRequest:
    """What to study.

    Parameters
    ----------
    fields : tuple of Path
        None: the built-in field.
    output : Path
        Folder, one folder a field inside it.
    results : Path, optional
        The page; `results.md` in `output` by default.
    command : str
        That made it, for the page.
    quick : bool
    pieces : Path, optional
        Folder of the finished pieces; in the cache by default.
    settings : StudySettings, optional
        Instead of those that `quick` names.
    peers_python : str, optional
        A Python that has planners by others, SGP-Tools or PySensors; by default this one, where it has them.
    """

    fields: tuple[Path, ...]
    output: Path
    results: Path | None = None
    command: str = "sparsor study"
    quick: bool = False
    pieces: Path | None = None
    settings: StudySettings | None = None
    peers_python: str | None = None


@dataclass(frozen=True)
class Studied:
    """What a study wrote.

    Parameters
    ----------
    page : Path
    files : tuple of Path
        Tables and pictures.
    results : tuple of FieldResults
    """

    page: Path
    files: tuple[Path, ...]
    results: tuple[FieldResults, ...]


def study(request: StudyRequest, *, workers: Workers | int | None = None, progress: Progress = silent) -> Studied:
    """Study fields; finished pieces are kept, so that an interrupted study goes on where it was.

    Parameters
    ----------
    request : StudyRequest
    workers : Workers or int, optional
        Who works, see `sparsor.core.cluster.workers_at`; the figures are the same for any.
    progress : Progress

    Raises
    ------
    InputError
        When a field cannot be read or is too small, two fields have one name, or a Python for others' planners has
        none.
    OutputError
        When something cannot be written.
    """
    settings = request.settings or (QUICK if request.quick else FULL)
    store = Store(request.pieces or cache_folder() / "study")
    hands = workers_of(workers)
    python = request.peers_python or own_python()
    peers = find_peers(python, settings.peer_steps) if python else None
    page = request.results or request.output / "results.md"
    results: list[FieldResults] = []
    contents: dict[str, bytes] = {}
    for name, source in _sources(request.fields).items():
        one = _studied(name, source, settings, store, peers, hands, progress)
        results.append(one)
        contents |= {f"{name}/{file}": content for file, content in one.files().items()}
    write_files(request.output, contents)
    text = results_page(results, settings, request.command, request.output, page, peers)
    write_files(page.parent, {page.name: text.encode()})
    return Studied(page, tuple(request.output / name for name in contents), tuple(results))


def _sources(paths: tuple[Path, ...]) -> dict[str, Source]:
    if not paths:
        return {BUILTIN: source_of(builtin_field())}
    named = {path.stem: path for path in paths}
    if len(named) < len(paths):
        raise InputError("two of the fields have the same file name; their results would overwrite each other")
    return {name: source_of(_by_name(read_field(path), path)) for name, path in named.items()}


def _by_name(field: Field, path: Path) -> Field:
    """Return a field that says the name of its file, not where it lay on one machine."""
    return replace(field, source=field.source.replace(str(path), path.name))


def _studied(
    name: str,
    source: Source,
    settings: StudySettings,
    store: Store,
    peers: Peers | None,
    hands: Workers,
    progress: Progress,
) -> FieldResults:
    rows = scoreboard(source, settings, store, peers=peers, workers=hands, progress=progress)
    made = [
        *figures(source, settings, store, workers=hands, progress=progress),
        against_ipp(rows, source.field.source),
    ]
    return FieldResults(
        name=name,
        source=source,
        rows=tuple(rows),
        figures=tuple(made),
        board=board_panels(rows, settings.noises),
        claims=claims({one.name: one for one in made}, rows),
        example=example(source, settings, store),
    )
