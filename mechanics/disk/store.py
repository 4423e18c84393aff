"""Named arrays in one memory-mapped file: keyed by content, checksummed, written whole or not at all.

Layout: 8 bytes magic, 8 bytes length of the JSON header (little endian), 32 bytes SHA-256 of magic, length
and header, the header, then the arrays, each at a multiple of 64 bytes. The header holds the key, each
array's type, shape and offset, and the SHA-256 of all that follows it: no bit can change unnoticed.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import CacheError

_LOG = logging.getLogger(__name__)
_MAGIC = b"PALPATE2"
_ALIGN, _START, _DIGEST = 64, 16, 32


def content_key(*parts: Any) -> str:
    """Hexadecimal SHA-256 over strings, numbers and arrays (bytes, type and shape)."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(repr(part).encode())
        digest.update(b"|")
    return digest.hexdigest()


def write_arrays(path: Path, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write `arrays` under `key`; the file appears only when it is complete."""
    entries: dict[str, Any] = {}
    offset = 0
    digest = hashlib.sha256()
    chunks: list[tuple[bytes, memoryview]] = []
    for name, array in arrays.items():
        array = np.ascontiguousarray(array)
        padding = bytes(-offset % _ALIGN)
        offset += len(padding)
        entries[name] = {"dtype": array.dtype.str, "shape": array.shape, "offset": offset}
        data = array.reshape(-1).view(np.uint8).data
        digest.update(padding)
        digest.update(data)
        chunks.append((padding, data))
        offset += array.nbytes
    header = json.dumps(
        {"key": key, "sha256": digest.hexdigest(), "size": offset, "arrays": entries}
    ).encode()
    header += b" " * (-(_START + _DIGEST + len(header)) % _ALIGN)
    start = _MAGIC + len(header).to_bytes(8, "little")
    with atomic_file(path) as temporary, open(temporary, "wb") as file:
        file.write(start + hashlib.sha256(start + header).digest() + header)
        for padding, data in chunks:
            file.write(padding)
            file.write(data)
        file.flush()


def read_arrays(path: Path, key: str) -> dict[str, np.ndarray]:
    """Map the arrays read-only; raises CacheError where the file is not whole, altered, or of another key."""
    try:
        with open(path, "rb") as file:
            start = file.read(_START)
            if len(start) < _START or start[:8] != _MAGIC:
                raise CacheError(f"'{path}' is no file of arrays of this version")
            length = int.from_bytes(start[8:], "little")
            if length > 1 << 20:
                raise CacheError(f"'{path}' has an impossible header")
            seal = file.read(_DIGEST)
            raw = file.read(length)
            if hashlib.sha256(start + raw).digest() != seal:
                raise CacheError(f"'{path}' fails the checksum of its header")
            header = json.loads(raw)
        if header["key"] != key:
            raise CacheError(f"'{path}' belongs to other content")
        first = _START + len(seal) + length
        if path.stat().st_size != first + header["size"]:
            raise CacheError(f"'{path}' is truncated or longer than it was written")
        data = np.memmap(path, dtype=np.uint8, mode="r", offset=first, shape=(header["size"],))
        if hashlib.sha256(data.data).hexdigest() != header["sha256"]:
            raise CacheError(f"'{path}' fails its checksum")
        result = {}
        for name, entry in header["arrays"].items():
            dtype = np.dtype(entry["dtype"])
            size = int(np.prod(entry["shape"])) * dtype.itemsize
            part = data[entry["offset"] : entry["offset"] + size]
            result[name] = np.asarray(part).view(dtype).reshape(entry["shape"])
        return result
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise CacheError(f"'{path}' cannot be read as a compliance cache ({error})") from error


def load_or_build(
    path: Path | None, key: str, build: Callable[[], Mapping[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """The arrays at `path` where they are whole and of `key`, else those of `build`, stored if that is
    possible.

    Two processes may build at once: each writes its own temporary file, and the last rename wins with
    the same content. Without a path, or in a folder that cannot be written, the arrays stay in memory.
    """
    if path is not None:
        try:
            return read_arrays(path, key)
        except CacheError as wrong:  # absent, damaged or of other content
            _LOG.info("computed anew: %s", wrong)
    arrays = {name: np.ascontiguousarray(array).view() for name, array in build().items()}
    for array in arrays.values():
        array.setflags(write=False)  # as mapped ones are: to the kernels' compiler others are another type
    if path is not None:
        try:
            write_arrays(path, key, arrays)
            return read_arrays(path, key)
        except (OSError, CacheError) as refused:  # a full or read-only disk: those in memory serve as well
            _LOG.info("'%s' is not kept: %s", path, refused)
    return arrays
