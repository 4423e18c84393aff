"""An sdist whose bytes follow from its files alone: sorted, of one time, owner and mode.

usage: python tools/same_bytes.py SECONDS_SINCE_1970 NAME.tar.gz (needs nothing of the program)
"""

from __future__ import annotations

import gzip
import io
import sys
import tarfile
from pathlib import Path


def repacked(data: bytes, seconds: int) -> bytes:
    """The archive with the same names and contents."""
    out = io.BytesIO()
    with (
        tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as old,
        gzip.GzipFile("", "wb", 9, out, mtime=seconds) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as new,
    ):
        for member in sorted(old.getmembers(), key=lambda m: m.name):
            kept = tarfile.TarInfo(member.name)
            kept.type, kept.size, kept.mtime = member.type, member.size, seconds
            kept.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            kept.linkname = member.linkname
            new.addfile(kept, old.extractfile(member) if member.isfile() else None)
    return out.getvalue()


if __name__ == "__main__":
    seconds, *paths = sys.argv[1:]
    for path in map(Path, paths):
        path.write_bytes(repacked(path.read_bytes(), int(seconds)))
