"""Training fields from public archives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sparsor.core.download import download
from sparsor.core.files import write_file
from sparsor.core.progress import Progress, silent
from sparsor.errors import OutputError
from sparsor.journeys.modelling import cache_folder
from sparsor.prior.archives import catalogue, field_netcdf

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Fetched:
    """One field that was fetched.

    Parameters
    ----------
    path : Path
        NetCDF; its attributes say where it is from, and its licence.
    url, sha256 : str
        Of what was fetched.
    cached : bool
        Whether that was here already.
    shape : tuple of int
        Rows and columns.
    """

    path: Path
    url: str
    sha256: str
    cached: bool
    shape: tuple[int, int]


def fetch(
    archive: str,
    months: tuple[str, ...],
    output: Path,
    *,
    box: tuple[float, float, float, float] | None = None,
    catalogue_file: Path | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> list[Fetched]:
    """Fetch months of an archive, each into a NetCDF file of its own.

    Parameters
    ----------
    archive : str
        A name in the catalogue.
    months : tuple of str
        ``YYYY-MM``.
    output : Path
        Folder.
    box : tuple of float, optional
        West, south, east, north in degrees: only this part.
    catalogue_file : Path, optional
        Instead of the packaged one.
    force : bool
        Overwrite files that are there.
    progress : Progress

    Raises
    ------
    FieldError
        When archive, month or box is wrong, or what came is no field.
    DownloadError
        When the archive cannot be reached.
    OutputError
        When a file is there already, or cannot be written.
    """
    chosen = catalogue(catalogue_file).named(archive)
    urls = {month: chosen.url_of(month) for month in months}
    targets = {month: output / f"no2-{archive}-{month}.nc" for month in urls}
    if (there := [path for path in targets.values() if path.exists()]) and not force:
        raise OutputError(f"'{there[0]}' is there already: add --force, or choose another folder with -o")
    found = []
    for month, url in urls.items():
        raw = download(url, cache_folder() / "archives", sha256=chosen.sha256.get(month), progress=progress)
        field = chosen.field(raw.path, month, box)
        facts = {"url": url, "license": chosen.licence, "sha256_of_original": raw.sha256, "modified": raw.modified}
        write_file(targets[month], field_netcdf(field, {name: value for name, value in facts.items() if value}))
        rows, columns = field.values.shape
        found.append(Fetched(targets[month], url, raw.sha256, not raw.fetched, (rows, columns)))
    return found
