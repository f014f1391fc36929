"""Downloads: whole or gone on with, never mixed of two files, and kept."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from archive_server import serving
from sparsor.core.download import download
from sparsor.errors import DownloadError, FieldError

CONTENT = np.random.default_rng(0).bytes(1_000_000)


@pytest.fixture
def archive(monkeypatch):
    for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
    with serving() as one:
        one.files["/no2.tif"] = CONTENT
        yield one


def test_a_file_is_fetched_once_with_its_checksum_and_date(archive, tmp_path):
    first = download(f"{archive.url}/no2.tif", tmp_path)
    assert first.path.read_bytes() == CONTENT
    assert first.sha256 == hashlib.sha256(CONTENT).hexdigest()
    assert first.modified == "Thu, 01 Oct 2020 00:00:00 GMT"
    again = download(f"{archive.url}/no2.tif", tmp_path)
    assert (again.path, again.sha256, again.fetched) == (first.path, first.sha256, False)
    assert len(archive.asked) == 1
    assert not list(tmp_path.glob("*.part*"))


@pytest.mark.parametrize("kept", [1, 300_000, 999_999])
def test_what_broke_off_is_gone_on_with_and_is_the_same_file(archive, tmp_path, kept):
    archive.breaks_after = kept
    with pytest.raises(DownloadError, match="goes on from there"):
        download(f"{archive.url}/no2.tif", tmp_path)
    assert not [path for path in tmp_path.iterdir() if path.suffix == ".tif"]
    assert download(f"{archive.url}/no2.tif", tmp_path).path.read_bytes() == CONTENT
    assert archive.asked[-1] == ("/no2.tif", f"bytes={kept}-")


@pytest.mark.parametrize("ranges", [True, False])
def test_a_file_that_changed_in_between_or_a_server_without_ranges_is_begun_anew(archive, tmp_path, ranges):
    archive.breaks_after = 5000
    with pytest.raises(DownloadError):
        download(f"{archive.url}/no2.tif", tmp_path)
    archive.ranges = ranges
    if ranges:
        archive.files["/no2.tif"], archive.tags["/no2.tif"] = CONTENT[::-1], '"two"'
    assert download(f"{archive.url}/no2.tif", tmp_path).path.read_bytes() == archive.files["/no2.tif"]


def test_a_part_that_is_longer_than_the_file_is_begun_anew(archive, tmp_path):
    archive.breaks_after = 5000
    with pytest.raises(DownloadError):
        download(f"{archive.url}/no2.tif", tmp_path)
    archive.files["/no2.tif"] = CONTENT[:4000]
    assert download(f"{archive.url}/no2.tif", tmp_path).path.read_bytes() == CONTENT[:4000]


def test_contents_that_are_not_the_known_ones_are_refused_and_a_damaged_copy_fetched_again(archive, tmp_path):
    with pytest.raises(DownloadError, match="not 00"):
        download(f"{archive.url}/no2.tif", tmp_path, sha256="00" * 32)
    right = hashlib.sha256(CONTENT).hexdigest()
    path = download(f"{archive.url}/no2.tif", tmp_path, sha256=right).path
    path.write_bytes(b"damaged")
    assert download(f"{archive.url}/no2.tif", tmp_path, sha256=right).path.read_bytes() == CONTENT


def test_no_file_no_server_and_no_address_are_said_in_words(archive, tmp_path):
    with pytest.raises(DownloadError, match="404"):
        download(f"{archive.url}/none.tif", tmp_path)
    with pytest.raises(FieldError, match="http or https"):
        download("file:///etc/hostname", tmp_path)
    with pytest.raises(DownloadError, match="built-in model"):
        download("http://127.0.0.1:9/no2.tif", tmp_path)
