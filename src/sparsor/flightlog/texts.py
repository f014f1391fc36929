"""Texts of a fixed length, as MAVLink and the vehicles' logs hold them."""

from __future__ import annotations


def text_of(raw: bytes) -> str:
    r"""Return the text up to its first zero byte; what follows that is rubbish, and it may be missing.

    Examples
    --------
    >>> text_of(b"NO2\x00\xfe\x12"), text_of(b"0123456789")
    ('NO2', '0123456789')
    """
    return raw.partition(b"\x00")[0].decode("utf-8", "replace").strip()
