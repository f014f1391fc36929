"""Files are the old ones or the new ones: whatever goes wrong on the way, nothing else is left behind."""

from __future__ import annotations

import errno
import hashlib
import os
import signal
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sparsor.core.files import sha256_of, write_file, write_files
from sparsor.errors import OutputError

OLD = {"doha.plan": b"old plan", "doha.npz": b"old sidecar"}
NEW = {"doha.plan": b"new plan", "doha.npz": b"new sidecar", "preview.png": b"new picture"}


def tree(folder):
    """Every path below a folder, with what the files hold."""
    return {path.relative_to(folder): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.fixture
def mission(tmp_path):
    folder = tmp_path / "missions" / "doha"
    write_files(folder, OLD)
    return folder


def failing(monkeypatch, name, error, *, calls_before=0):
    """Let an `os` function raise `error` after so many calls have gone well."""
    original, calls = getattr(os, name), []

    def broken(*args, **kwargs):
        calls.append(args)
        if len(calls) > calls_before:
            raise error
        return original(*args, **kwargs)

    monkeypatch.setattr(os, name, broken)


@settings(max_examples=25, deadline=None)
@given(
    contents=st.dictionaries(st.from_regex(r"[a-z][a-z0-9]{0,7}", fullmatch=True), st.binary(max_size=64), min_size=1)
)
def test_what_is_written_is_read_back_and_nothing_else_is_there(tmp_path_factory, contents):
    folder = tmp_path_factory.mktemp("round") / "trip" / "deeper"
    write_files(folder, contents)
    assert tree(folder) == {Path(name): content for name, content in contents.items()}
    for name, content in contents.items():
        assert sha256_of(folder / name) == hashlib.sha256(content).hexdigest()


def test_old_files_are_replaced_and_others_are_left_alone(mission):
    (mission / "notes.txt").write_bytes(b"mine")
    write_files(mission, NEW)
    assert tree(mission) == {Path(name): content for name, content in NEW.items()} | {Path("notes.txt"): b"mine"}


def test_writing_again_changes_nothing(mission):
    before = tree(mission)
    write_files(mission, OLD)
    assert tree(mission) == before


def test_one_file_is_written_like_several(tmp_path):
    write_file(tmp_path / "new" / "model.npz", b"content")
    assert tree(tmp_path) == {Path("new"): None, Path("new/model.npz"): b"content"}


@pytest.mark.parametrize("calls_before", range(len(NEW)))
def test_a_full_disk_leaves_the_old_files(mission, monkeypatch, calls_before):
    before = tree(mission.parent)
    failing(monkeypatch, "fsync", OSError(errno.ENOSPC, "No space left on device"), calls_before=calls_before)
    with pytest.raises(
        OutputError, match=r"cannot write to '.*doha': No space left on device\. Free some space or"
    ) as e:
        write_files(mission, NEW)
    assert e.value.exit_code == 1
    assert tree(mission.parent) == before


@pytest.mark.parametrize("calls_before", range(len(NEW)))
@pytest.mark.parametrize("error", [KeyboardInterrupt(), MemoryError(), SystemExit(1)])
def test_an_interrupt_leaves_the_old_files_and_goes_on(mission, monkeypatch, error, calls_before):
    before = tree(mission.parent)
    failing(monkeypatch, "fsync", error, calls_before=calls_before)
    with pytest.raises(type(error)):
        write_files(mission, NEW)
    assert tree(mission.parent) == before


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_folders_made_for_a_write_that_failed_are_removed(tmp_path, monkeypatch, error):
    (tmp_path / "kept").mkdir()
    failing(monkeypatch, "fsync", error, calls_before=1)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        write_files(tmp_path / "kept" / "new" / "newer", NEW)
    assert tree(tmp_path) == {Path("kept"): None}


def test_folders_that_others_filled_meanwhile_are_kept(tmp_path, monkeypatch):
    folder = tmp_path / "new" / "newer"

    def fsync(_):
        (tmp_path / "new" / "theirs").write_bytes(b"theirs")
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(OutputError, match="Input/output error"):
        write_files(folder, NEW)
    assert tree(tmp_path) == {Path("new"): None, Path("new/theirs"): b"theirs"}


@pytest.mark.parametrize("blocked", NEW)
def test_a_folder_where_a_file_should_be_leaves_all_of_the_old_files(mission, blocked):
    (mission / blocked).unlink(missing_ok=True)
    (mission / blocked / "inside").mkdir(parents=True)
    before = tree(mission.parent)
    with pytest.raises(OutputError, match=r"cannot write to '.*doha'"):
        write_files(mission, NEW)
    assert tree(mission.parent) == before


@pytest.mark.parametrize("at", range(1, len(NEW) + 1))
def test_ctrl_c_between_renames_leaves_all_of_the_old_files_or_all_of_the_new(mission, monkeypatch, at):
    before, handler = tree(mission.parent), signal.getsignal(signal.SIGINT)
    after = before | {Path("doha", name): content for name, content in NEW.items()}
    original, calls = Path.replace, []

    def replace(self, target):
        calls.append(target)
        if len(calls) == at:
            signal.raise_signal(signal.SIGINT)
        return original(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(KeyboardInterrupt):
        write_files(mission, NEW)
    assert tree(mission.parent) in (before, after)
    assert signal.getsignal(signal.SIGINT) is handler, "the next Ctrl-C would be lost"


def test_other_threads_write_too(mission):
    with ThreadPoolExecutor(1) as pool:  # signals are handled in the main thread only
        pool.submit(write_files, mission, NEW).result()
    assert tree(mission) == {Path(name): content for name, content in NEW.items()}


def test_a_file_where_the_folder_should_be_is_kept(tmp_path):
    (tmp_path / "doha").write_bytes(b"a file")
    for folder in (tmp_path / "doha", tmp_path / "doha" / "deeper"):
        with pytest.raises(OutputError, match=r"cannot write to '.*': .+\. Free some space or choose another folder"):
            write_files(folder, NEW)
    assert tree(tmp_path) == {Path("doha"): b"a file"}


@pytest.mark.parametrize("where", ["folder", "file"])
def test_a_name_longer_than_the_file_system_takes_is_said_so(tmp_path, where):
    long = "x" * 300
    with pytest.raises(OutputError, match="cannot write to"):
        write_files(tmp_path / long if where == "folder" else tmp_path, {long if where == "file" else "a": b""})
    assert tree(tmp_path) == {}


def test_a_folder_that_may_not_be_written_to_is_said_so(mission, monkeypatch):
    before = tree(mission.parent)
    failing(monkeypatch, "open", PermissionError(errno.EACCES, "Permission denied"))
    with pytest.raises(OutputError, match="Permission denied"):
        write_files(mission, NEW)
    monkeypatch.undo()
    assert tree(mission.parent) == before


@pytest.mark.skipif(os.name != "posix", reason="permissions as POSIX has them")
@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_permissions_are_those_a_plain_open_gives(tmp_path, umask):
    old = os.umask(umask)
    try:
        write_file(tmp_path / "ours", b"")
        (tmp_path / "plain").write_bytes(b"")
        assert os.umask(umask) == umask, "the process's own mask was changed"
    finally:
        os.umask(old)
    ours, plain = (stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("ours", "plain"))
    assert ours == plain == 0o666 & ~umask
