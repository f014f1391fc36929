"""Files that are either the old ones or the new ones, never half of one."""

from __future__ import annotations

import errno
import hashlib
import os
import signal
import tempfile
import threading
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from sparsor.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


def write_files(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write several files into a folder, all of them or none.

    Everything is first written beside its target under a temporary name and flushed to the disk; only when
    all of it is there are the files renamed. A full disk or an interrupt on the way leaves what was there
    before.

    Parameters
    ----------
    folder : Path
        Made, with its parents, when it does not exist.
    contents : mapping of str to bytes
        File name inside `folder`, perhaps with a folder before it or whole, to its contents.

    Raises
    ------
    OutputError
        When the folder or a file cannot be written.
    """
    made: list[Path] = []
    written: list[tuple[Path, Path]] = []
    try:
        for home in dict.fromkeys((folder, *((folder / name).parent for name in contents))):
            made = [*_missing_folders(home), *made]
            home.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            target = folder / name
            if target.is_dir():
                raise IsADirectoryError(errno.EISDIR, f"'{name}' is a folder")
            temporary = _write_temporary(target, content)
            written.append((temporary, target))
        with _uninterrupted():
            for temporary, target in written:
                temporary.replace(target)
    except OSError as error:
        raise OutputError(
            f"cannot write to '{folder}': {error.strerror or error}. Free some space or choose another folder with -o."
        ) from error
    finally:
        for temporary, _ in written:
            temporary.unlink(missing_ok=True)
        _remove_empty(made)


def write_file(path: Path, content: bytes) -> None:
    """Write one file as `write_files` does.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    write_files(path.parent, {path.name: content})


@contextmanager
def file_written_in_pieces(path: Path) -> Iterator[BinaryIO]:
    """Yield a stream whose contents become the file when the block ends; they are dropped when it raises.

    For what is too large to be held in memory. Until then it has a temporary name beside its target.

    Parameters
    ----------
    path : Path
        Its folder has to exist.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    try:
        with _temporary_file(path) as (temporary, stream):
            yield stream
            _finish(temporary, stream)
            temporary.replace(path)
    except OSError as error:
        raise OutputError(f"cannot write '{path}': {error.strerror or error}") from error


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file's contents, in hexadecimal; of a folder: of its files' names and contents."""
    if path.is_dir():
        names = sorted(file.relative_to(path).as_posix() for file in path.rglob("*") if file.is_file())
        listed = "".join(f"{sha256_of(path / name)}  {name}\n" for name in names)
        return hashlib.sha256(listed.encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _write_temporary(target: Path, content: bytes) -> Path:
    with _temporary_file(target) as (temporary, stream):
        stream.write(content)
        _finish(temporary, stream)
    return temporary


@contextmanager
def _temporary_file(target: Path) -> Iterator[tuple[Path, BinaryIO]]:
    """Yield a new file beside its target, which is removed again when the block raises."""
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield temporary, stream
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _finish(temporary: Path, stream: BinaryIO) -> None:
    stream.flush()
    os.fsync(stream.fileno())
    # mkstemp makes the file private; what we leave behind has the permissions a plain open() gives.
    temporary.chmod(0o666 & ~_umask())
    stream.close()


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C for the moment in which some files would be new and others old."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed = False

    def remember(_number: int, _frame: object) -> None:
        nonlocal pressed
        pressed = True

    before = signal.signal(signal.SIGINT, remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        raise KeyboardInterrupt


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _missing_folders(folder: Path) -> list[Path]:
    return [path for path in (folder, *folder.parents) if not path.exists()]


def _remove_empty(folders: list[Path]) -> None:
    """Remove the folders that were made for a write that then failed; deepest first."""
    for path in folders:
        with suppress(OSError):
            path.rmdir()
