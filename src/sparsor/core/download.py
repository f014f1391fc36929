"""Files from the network: kept once they are whole, gone on with where they broke off, checked by their SHA-256."""

from __future__ import annotations

import hashlib
import http.client
import json
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from sparsor.core.files import sha256_of, write_file
from sparsor.core.progress import Progress, silent
from sparsor.errors import DownloadError, FieldError, OutputError

if TYPE_CHECKING:
    from pathlib import Path

_PATIENCE_S = 60
_PIECE = 1 << 18
_PARTIAL, _NOT_SATISFIABLE = 206, 416
_AGENT = "sparsor (https://pypi.org/project/sparsor)"


@dataclass(frozen=True)
class Download:
    """A file that is here now.

    Parameters
    ----------
    path : Path
    sha256 : str
        Of its contents.
    modified : str
        When the server says that it was changed last; may be empty.
    fetched : bool
        Whether the network was asked for it, or it was here already.
    """

    path: Path
    sha256: str
    modified: str
    fetched: bool


def download(url: str, folder: Path, *, sha256: str | None = None, progress: Progress = silent) -> Download:
    """Return the file of an address, fetched when it is not in the folder.

    What was fetched before a break is kept beside it (`.part`); the next time the rest is asked for, on condition that
    the file on the server is the same (HTTP Range and If-Range).

    Parameters
    ----------
    url : str
        http or https.
    folder : Path
        Made when it does not exist.
    sha256 : str, optional
        What the contents have to have.
    progress : Progress

    Raises
    ------
    DownloadError
        When the server cannot be reached, does not have the file, or the contents are not the ones that are known.
    """
    if urlsplit(url).scheme not in {"http", "https"}:
        raise FieldError(f"'{url}' is not an address of http or https")
    name = f"{hashlib.sha256(url.encode()).hexdigest()[:12]}-{PurePosixPath(urlsplit(url).path).name or 'file'}"
    target = folder / name
    if (kept := _kept(target)) is not None and sha256 in {None, kept.sha256}:
        return kept
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write to '{folder}': {error.strerror or error}") from error
    part = target.with_name(name + ".part")
    about = _fetch(url, part, progress)
    found = sha256_of(part)
    if sha256 not in {None, found}:
        part.unlink()
        raise DownloadError(
            f"{url} has SHA-256 {found}, not {sha256}: it was changed, or damaged on the way. Try again"
        )
    modified = about.get("modified", "")
    # The checksum first: a file without one counts as not there.
    write_file(_facts(target), json.dumps({"url": url, "sha256": found, "modified": modified}).encode())
    part.replace(target)
    _facts(part).unlink(missing_ok=True)
    return Download(target, found, modified, fetched=True)


def _facts(path: Path) -> Path:
    return path.with_name(path.name + ".json")


def _kept(target: Path) -> Download | None:
    """Return a file that is there and as it was when it was fetched."""
    known = _read(_facts(target))
    if not target.is_file() or sha256_of(target) != known.get("sha256"):
        return None
    return Download(target, known["sha256"], known.get("modified", ""), fetched=False)


def _fetch(url: str, part: Path, progress: Progress) -> dict[str, str]:
    """Fetch what is missing of a file; return what the server says of it."""
    before, begun = _read(_facts(part)), part.stat().st_size if part.exists() else 0
    mark = before.get("mark", "")
    headers = {"User-Agent": _AGENT, "Accept-Encoding": "identity"}
    if begun and mark:
        headers |= {"Range": f"bytes={begun}-", "If-Range": mark}
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=_PATIENCE_S) as answer:
            about = _about(answer)
            goes_on = answer.status == _PARTIAL and _first_byte(answer) == begun
            if answer.status == _PARTIAL and not goes_on:
                raise DownloadError(f"{url}: the server sent another part than the one asked for; try again")
            write_file(_facts(part), json.dumps(about).encode())
            _receive(answer, part, begun if goes_on else 0, progress)
    except urllib.error.HTTPError as error:
        if error.code == _NOT_SATISFIABLE and begun:  # nothing is missing, or what is here is not it: begin anew
            part.unlink()
            return _fetch(url, part, progress)
        raise DownloadError(
            f"{url}: the server answers {error.code} {error.reason}. Perhaps there is no such month, or the archive "
            "has moved: see --catalogue"
        ) from error
    except (OSError, http.client.HTTPException) as error:
        reason = getattr(error, "reason", None) or error
        raise DownloadError(
            f"cannot fetch {url} ({reason}). What has arrived is kept, the same command goes on from there. Without "
            "a network leave --field and --model out: missions are then planned with the built-in model; or fetch the "
            "file elsewhere and give it with --field"
        ) from error
    return about


def _about(answer: http.client.HTTPResponse) -> dict[str, str]:
    tag = answer.headers.get("ETag", "")
    modified = answer.headers.get("Last-Modified", "")
    # A weak tag does not promise the same bytes.
    return {"mark": modified if tag.startswith("W/") else tag or modified, "modified": modified}


def _first_byte(answer: http.client.HTTPResponse) -> int:
    words = answer.headers.get("Content-Range", "").removeprefix("bytes ").split("-")
    return int(words[0]) if words[0].isdigit() else -1


def _receive(answer: http.client.HTTPResponse, part: Path, begun: int, progress: Progress) -> None:
    length = answer.headers.get("Content-Length", "")
    total = begun + int(length) if length.isdigit() else 0
    done = begun
    with part.open("ab" if begun else "wb") as stream:
        while piece := answer.read(_PIECE):
            stream.write(piece)
            done += len(piece)
            progress("fetching", done, max(total, done))
    if total and done < total:
        raise http.client.IncompleteRead(b"", total - done)


def _read(path: Path) -> dict[str, str]:
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
