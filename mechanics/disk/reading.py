"""The one boundary to the disk, reading: what the operating system refuses is said in one line, and a
stranger's file gets no more memory than it may need."""

from __future__ import annotations

import errno
import gzip
import hashlib
import os
import tomllib
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.errors import FileError, PalpateError

FOLLOW_PATHS = "PALPATE_FOLLOW_PATHS"
"""Set to 1: paths in a TOML may leave its folder."""
_TEXT_BYTES = 16 << 20
_DEEPEST = 32
_MOST_MEMORY = 2 << 30
_REMEDIES = {
    errno.ENOSPC: "free some space or write to another disk",
    errno.EDQUOT: "free some space or write to another disk",
    errno.EFBIG: "write to a place that allows larger files",
    errno.EROFS: "name a folder that can be written",
    errno.EACCES: "change its permissions or name another place",
    errno.EPERM: "change its permissions or name another place",
    errno.ENOENT: "check the spelling of the path",
    errno.ENOTDIR: "a part of the path is a file: name another folder",
    errno.EISDIR: "it is a folder: name a file",
    errno.EEXIST: "a file of that name is in the way: name another",
    errno.ENAMETOOLONG: "use a shorter name",
    errno.ELOOP: "its links lead in a circle: name the file itself",
    errno.EMFILE: "close other programs or raise the limit of open files (ulimit -n)",
    errno.EIO: "the disk is failing or was taken out: write to another",
}


def refusal(error: OSError, path: Path | str | None, doing: str) -> str:
    """One line for a person: which file, what failed, what to do. doing: 'read' or 'written'."""
    named = path if path is not None else error.filename
    what = error.strerror or str(error) or type(error).__name__
    remedy = _REMEDIES.get(error.errno or 0, "check the path and the disk")
    where = f"'{named}' cannot be {doing}" if named is not None else "a file cannot be used"
    return f"{where} ({what}): {remedy}"


@contextmanager
def reading(path: Path | str, error: type[PalpateError] = FileError) -> Iterator[None]:
    """What the operating system refuses inside becomes `error`, in one line that names the file."""
    try:
        yield
    except PalpateError:
        raise
    except EOFError as refused:
        raise error(f"'{path}' is truncated: copy it again") from refused
    except (gzip.BadGzipFile, zlib.error) as refused:
        raise error(f"'{path}' cannot be unpacked ({refused}): it is damaged; copy it again") from refused
    except OSError as refused:
        raise error(refusal(refused, path, "read")) from refused


def no_file(path: Path | str) -> str:
    """In words, what `path` names that is no file: 'is a folder', or that it does not exist."""
    path = Path(path)
    if path.is_dir():
        return "is a folder"
    if path.is_symlink() and not path.exists():
        return f"is a link to '{os.path.realpath(path)}', which does not exist"
    return "is no ordinary file" if path.exists() else "does not exist"


@contextmanager
def bounded_memory(path: Path | str, error: type[PalpateError] = FileError) -> Iterator[None]:
    """A stranger's file may unpack to anything: inside, this process gets at most 2 GB more than it has, and
    `error` names the file. Where the system has no such limit (Windows, macOS) nothing is bounded."""
    try:
        with _limited_data(_MOST_MEMORY):
            yield
    except MemoryError as wrong:
        raise error(
            f"'{path}' takes more than {_MOST_MEMORY >> 30} GB of memory to read: cut it, or check where "
            "it is from"
        ) from wrong


@contextmanager
def _limited_data(most_bytes: int) -> Iterator[None]:
    """RLIMIT_DATA counts what is written privately: neither maps of files nor what is reserved only."""
    try:
        import resource

        import psutil

        held = psutil.Process().memory_info().data
    except (ImportError, AttributeError):  # Windows has no such limit, macOS does not count what is written
        yield
        return
    soft, hard = before = resource.getrlimit(resource.RLIMIT_DATA)
    limits = [held + most_bytes, *(x for x in before if x != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(limits), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def read_text(path: Path | str, error: type[PalpateError] = FileError) -> str:
    """A UTF-8 file of at most 16 MB; raises `error` in one line for anything else."""
    with reading(path, error), open(path, "rb") as file:
        data = file.read(_TEXT_BYTES + 1)
    if len(data) > _TEXT_BYTES:
        raise error(f"'{path}' is larger than {_TEXT_BYTES >> 20} MB: it is not a text file of this program")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise error(f"'{path}' is no UTF-8 text (byte {wrong.start}): save it as UTF-8") from wrong


def read_toml(path: Path | str, error: type[PalpateError] = FileError) -> dict[str, Any]:
    """The table of a TOML file; raises `error` in one line where it is none, or is nested too deep."""
    text = read_text(path, error)
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as wrong:
        raise error(f"'{path}' is no valid TOML: {str(wrong) or type(wrong).__name__}") from wrong
    level: list[Any] = [table]
    for _ in range(_DEEPEST):
        level = [
            below
            for value in level
            if isinstance(value, dict | list)
            for below in (value.values() if isinstance(value, dict) else value)
        ]
    if level:
        raise error(f"'{path}' is nested more than {_DEEPEST} deep: it is not a table of this program")
    return table


def named_in(path: Path, value: str, error: type[PalpateError]) -> Path:
    """The file or folder that a TOML at `path` names; raises `error` where that leaves the TOML's folder,
    unless PALPATE_FOLLOW_PATHS=1 asks for it or it is in the cache."""
    target = Path(os.path.realpath(path.parent / value))
    roots = (Path(os.path.realpath(path.parent)), Path(os.path.realpath(cache_folder())))
    if os.environ.get(FOLLOW_PATHS) == "1" or any(target.is_relative_to(root) for root in roots):
        return target
    raise error(
        f"'{path}' names '{value}', which is outside its folder: copy it there, or set {FOLLOW_PATHS}=1 to "
        "follow such paths"
    )


def sha256_of_file(path: Path | str) -> str:
    """Hexadecimal SHA-256 of a file's bytes."""
    with reading(path), open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
