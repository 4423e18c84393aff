"""The one boundary to the disk, writing: what is written or replaced goes through here.

Files and folders are either whole or not there (written to a temporary name beside the target, then
renamed); an output replaces nothing but its own kind; what the operating system refuses is said in one line
(FileError). What a killed process left is swept by the next (mechanics.disk.scratch).
"""

from __future__ import annotations

import errno
import logging
import os
import shutil
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

from palpate.mechanics.disk.reading import refusal
from palpate.mechanics.disk.scratch import OLD, sweep, sweep_scratch, temporary_prefix
from palpate.mechanics.errors import FileError, PalpateError

_LOG = logging.getLogger(__name__)
_HEAD_BYTES = 1 << 16
_WHOLE_BYTES = 1 << 26
_PROBE_BYTES = 1 << 16
_SCRATCH_BYTES = 1 << 24


@dataclass(frozen=True)
class Kind:
    """A kind of file that this program writes, recognised by how it begins, so that nothing else is replaced.

    words: for people. starts: what such a file may begin with. holds: bytes that stand somewhere in it.
    likely_bytes: room that one takes. goes: where it is written if a path is named. beside: further files
    that are written with it, with their kinds.
    """

    words: str
    starts: tuple[bytes, ...]
    holds: bytes = b""
    likely_bytes: int = 1 << 20
    goes: Callable[[Path], Path] = lambda path: path
    beside: Callable[[Path], list[tuple[Path, Kind]]] = lambda path: []

    def replaceable(self, path: Path) -> bool:
        """Whether `path`, an existing file, is empty or of this kind."""
        data = _head(path, _WHOLE_BYTES if self.holds else _HEAD_BYTES)
        begins = any(data.lstrip().startswith(start) for start in self.starts)
        return not data or (begins and self.holds in data)


@dataclass(frozen=True)
class FolderKind:
    """A kind of folder that this program writes: the file that marks it, and the names that are its own.

    Whatever else lies in such a folder survives when it is replaced.
    """

    words: str
    marker: str
    mark: Kind
    own: tuple[str, ...]
    likely_bytes: int = 1 << 25

    def replaceable(self, path: Path) -> bool:
        """Whether `path`, an existing folder, is empty or of this kind."""
        marker = path / self.marker
        return not any(path.iterdir()) or (marker.is_file() and self.mark.replaceable(marker))

    def owns(self, name: str) -> bool:
        """Whether a file of that name in the folder was written by this program."""
        return any(fnmatch(name, pattern) for pattern in self.own)


JSON = Kind("JSON", (b"{", b"["))
PNG = Kind("a PNG picture", (b"\x89PNG",), likely_bytes=1 << 22)


@contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """What the operating system refuses inside becomes a FileError that names the file."""
    try:
        yield
    except PalpateError:
        raise
    except OSError as refused:
        raise FileError(refusal(refused, path, "written")) from refused


def written_at(path: Path | str, kind: Kind | FolderKind) -> list[tuple[Path, Kind | FolderKind]]:
    """All that is written where `path` is named, each with its kind; the one that is named first."""
    path = Path(path)
    return [(kind.goes(path), kind), *kind.beside(path)] if isinstance(kind, Kind) else [(path, kind)]


def check_target(path: Path | str, kind: Kind | FolderKind) -> None:
    """Before long work: whether `path` can be written and would replace nothing but its own kind.

    Raises FileError that says what is in the way, or how much room is missing.
    """
    (path, _), *beside = written_at(path, kind)
    with writing(path):
        target = _target(path, kind)
        place = target.parent
        while not place.exists():
            if place.is_symlink() or place.parent == place:
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(place))
            place = place.parent
        longest = os.pathconf(place, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
        for part in target.relative_to(place).parts:
            if len(os.fsencode(part)) > longest:
                raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG))
        free = shutil.disk_usage(place).free
        if free < kind.likely_bytes:
            raise FileError(
                f"'{path}' needs about {kind.likely_bytes >> 20} MB, and its disk has {free / 1e6:.1f} MB "
                "free: free some space or write to another disk"
            )
        with tempfile.TemporaryFile(prefix=temporary_prefix(), dir=place) as probe:
            probe.write(bytes(_PROBE_BYTES))
            probe.flush()
    for other, other_kind in beside:
        check_target(other, other_kind)


def check_room(folder: Path, least_bytes: int, variable: str = "PALPATE_CACHE") -> None:
    """Make a folder, which a variable of the environment names; raises FileError where it cannot be made, or
    its disk has less room than that: then nothing is made."""
    with writing(folder):
        place = next(p for p in (folder, *folder.absolute().parents) if p.exists())
        free = shutil.disk_usage(place).free
        if free >= least_bytes:
            folder.mkdir(parents=True, exist_ok=True)
    if free < least_bytes:
        raise FileError(
            f"'{folder}' has {free / 1e6:.1f} MB free, about {least_bytes / 1e6:.0f} MB are needed: free "
            f"some space or set {variable} to a folder on another disk"
        )


@contextmanager
def atomic_file(path: Path | str, kind: Kind | None = None) -> Iterator[Path]:
    """Yield a temporary path beside `path`; rename it onto `path` when the block ends without an error.

    kind: what it is; an existing file of another kind is left alone. None: a file of the cache, or inside a
    folder of this program's. Raises FileError for what the operating system refuses in the block.
    """
    path = Path(path)
    with writing(path):
        target = _target(path, kind) if kind else path
        target.parent.mkdir(parents=True, exist_ok=True)
        sweep(target.parent)
        # the suffix is kept because writers choose their format (and compression) by it
        suffix = "".join(path.suffixes[-2:])
        handle, name = tempfile.mkstemp(
            prefix=temporary_prefix(), suffix=suffix if len(suffix) < 20 else path.suffix[:20],
            dir=target.parent,
        )  # fmt: skip
        os.close(handle)
        temporary = Path(name)
        try:
            yield temporary
            if kind is not None:
                _settle(temporary)
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
            os.replace(temporary, target)
            _LOG.debug("written: %s", target)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path | str, kind: FolderKind) -> Iterator[Path]:
    """Yield a temporary folder beside `path`; it replaces `path` when the block ends without an error.

    Only a folder of this kind is replaced, and only its own files: others that lie in it move along. Raises
    FileError for anything else that is there, and for what the operating system refuses.
    """
    path = Path(path)
    with writing(path):
        target = _target(path, kind)
        target.parent.mkdir(parents=True, exist_ok=True)
        sweep(target.parent)
        temporary = Path(tempfile.mkdtemp(prefix=temporary_prefix(), dir=target.parent))
        old = None
        try:
            yield temporary
            for file in temporary.rglob("*"):
                if file.is_file():
                    _settle(file)
            temporary.chmod(0o755)
            if target.exists():
                _carry_over(target, temporary, kind)
                old = Path(tempfile.mkdtemp(prefix=temporary_prefix(OLD), dir=target.parent))
                os.replace(target, old / target.name)
            os.replace(temporary, target)
            _LOG.debug("written: %s", target)
        except BaseException:
            if old is not None and not target.exists():
                os.replace(old / target.name, target)
            raise
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
            if old is not None:
                shutil.rmtree(old, ignore_errors=True)


@contextmanager
def sole_writer(folder: Path | str) -> Iterator[None]:
    """Make `folder` and keep other processes out of it; raises FileError where one writes there already.

    The lock goes with the process, however that ends. Where the system has none, folders are not shared.
    """
    folder = Path(folder)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            import fcntl
        except ImportError:  # Windows
            yield
            return
        path = folder / ".palpate-lock"
        with open(path, "a+b") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # whoever had it a moment ago may have taken the name away
                if os.fstat(lock.fileno()).st_ino != path.stat().st_ino:
                    raise BlockingIOError
            except (BlockingIOError, FileNotFoundError) as error:
                raise FileError(
                    f"another palpate is writing to '{folder}': wait for it, or name another folder"
                ) from error
            try:
                yield
            finally:
                path.unlink(missing_ok=True)


@contextmanager
def temporary_folder(label: str = "") -> Iterator[Path]:
    """A folder for scratch files, removed at the end; what killed processes left is swept first.

    Raises FileError where the disk has no room for any.
    """
    sweep_scratch()
    check_room(Path(tempfile.gettempdir()), _SCRATCH_BYTES, "TMPDIR")
    with writing(tempfile.gettempdir()):
        with tempfile.TemporaryDirectory(prefix=temporary_prefix(label), ignore_cleanup_errors=True) as name:
            yield Path(name)


def _target(path: Path, kind: Kind | FolderKind) -> Path:
    """Where `path` leads; raises FileError where what is there would be lost, or cannot be replaced."""
    target = Path(os.path.realpath(path))
    other = "name another output"
    if path.is_symlink() and not target.parent.is_dir():
        raise FileError(f"'{path}' is a link to '{target}', whose folder does not exist: {other}")
    if not target.exists():
        return target
    if isinstance(kind, FolderKind):
        if not target.is_dir():
            raise FileError(f"'{path}' exists and is no folder: {other}")
        if target in (here := Path.cwd(), *here.parents):
            raise FileError(f"'{path}' is the current folder or holds it: name a new folder")
    elif target.is_dir():
        raise FileError(f"'{path}' is a folder: name a file")
    elif not target.is_file():
        raise FileError(f"'{path}' is no ordinary file: {other}")
    if not kind.replaceable(target):
        bare = kind.words.removeprefix("a ").removeprefix("an ")
        raise FileError(f"'{path}' exists and is no {bare}: {other}")
    return target


def _head(path: Path, most: int) -> bytes:
    """The first bytes of a file, unpacked where it is packed."""
    with open(path, "rb") as file:
        data = file.read(most)
    if data[:2] == b"\x1f\x8b":
        with suppress(zlib.error):
            return zlib.decompressobj(wbits=31).decompress(data, most)
    return data


def _settle(path: Path) -> None:
    """Wait until the bytes are on the disk, where a full one says so."""
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _carry_over(old: Path, new: Path, kind: FolderKind) -> None:
    """Put what is not this program's from the old folder into the new one, by links where that can be."""
    for entry in old.iterdir():
        if kind.owns(entry.name) or entry.name.startswith(".palpate-"):
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.copytree(entry, new / entry.name, symlinks=True, copy_function=_link_or_copy)
        else:
            _link_or_copy(str(entry), str(new / entry.name))


def _link_or_copy(source: str, target: str) -> str:
    try:
        os.link(source, target, follow_symlinks=False)
    except OSError:
        shutil.copy2(source, target, follow_symlinks=False)
    return target
