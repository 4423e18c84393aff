"""Models that come with the program, so that a first touch waits for nothing.

FOLDER/NAME.zip holds the MODEL folder of a scene. NAME is that of the scene's folder in the cache, which
ends with a hash of all that the model depends on (scenes.kept): a scene that was changed finds nothing here
and is made as ever. `python -m tools.shipped_models` makes the files; tests say when they must be made anew.

The compliance is packed: of its symmetric blocks one half, rounded to 11 bits, which moves a force by less
than 1e-3 of itself where several tips touch and not at all where one does; what follows from the rest is left
out. Its name holds the whole key of its content, so that of another model it is not taken.
"""

from __future__ import annotations

import io
import lzma
import re
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.compliance.stored_compliance import compliance_file
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.disk.store import write_arrays
from palpate.mechanics.disk.writing import atomic_folder
from palpate.mechanics.errors import FileError
from palpate.mechanics.model.files import MODEL


class DamagedError(FileError):
    """An archive that came with the program cannot be read."""


FOLDER = Path(__file__).parent / "shipped"
_PACKED = re.compile(r"compliance-([0-9a-f]{64})\.npz")
_DATE = (1980, 1, 1, 0, 0, 0)
"""Of every file in an archive: the same content gives the same bytes."""
_DAMAGES = (
    zipfile.BadZipFile,
    lzma.LZMAError,
    struct.error,
    EOFError,
    KeyError,
    ValueError,
    NotImplementedError,
    RuntimeError,
)
"""What zipfile and NumPy raise at bytes that were changed."""


def shipped_model(name: str) -> Path | None:
    """The archive of a model by the name of its folder; None where none of that name is shipped."""
    path = FOLDER / f"{name}.zip"
    return path if path.is_file() else None


def part_of(archive: Path, name: str) -> bytes:
    """One file of an archive. Raises DamagedError where it cannot be read."""
    try:
        with zipfile.ZipFile(archive) as packed:
            return packed.read(name)
    except _DAMAGES as error:
        raise DamagedError(f"'{archive}' is damaged ({error}): install the program again") from error


def unpack(archive: Path, folder: Path) -> None:
    """Write the MODEL folder of an archive, with its compliance as the cache keeps it.

    Raises FileError where it cannot be written, DamagedError where the archive cannot be read.
    """
    try:
        with zipfile.ZipFile(archive) as packed, atomic_folder(folder, MODEL) as target:
            for name in packed.namelist():
                found = _PACKED.fullmatch(name)
                data = packed.read(name)
                if found is None:
                    (target / Path(name).name).write_bytes(data)
                else:
                    made = _whole(data)
                    write_arrays(target / compliance_file(found[1]), found[1], made.arrays())
    except _DAMAGES as error:
        raise DamagedError(f"'{archive}' is damaged ({error}): install the program again") from error


def pack(folder: Path, archive: Path, compliance: SurfaceCompliance, key: str) -> None:
    """Make the archive of a MODEL folder and its compliance of that key (`stored_compliance`)."""
    own = [path for path in sorted(folder.iterdir()) if path.suffix not in (".bin", ".cache")]
    files = {path.name: path.read_bytes() for path in (*own, folder / "presses.bin")}
    files[f"compliance-{key}.npz"] = _halved(compliance)
    archive.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_LZMA) as packed:
        for name, data in files.items():
            packed.writestr(zipfile.ZipInfo(name, _DATE), data, zipfile.ZIP_LZMA)


def _halved(compliance: SurfaceCompliance) -> bytes:
    arrays: dict[str, Any] = dict(compliance.arrays())
    blocks = arrays.pop("blocks")
    del arrays["own_middles"]
    half = blocks[np.triu_indices(len(blocks))].astype("<f2").reshape(-1, 9)
    # entry by entry, first bytes first: so they pack to four fifths
    arrays["half"] = half.T.copy().view(np.uint8).reshape(9, -1, 2).transpose(2, 0, 1)
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def _whole(data: bytes) -> SurfaceCompliance:
    with np.load(io.BytesIO(data)) as file:
        arrays = {name: file[name] for name in file.files}
    entries = np.ascontiguousarray(arrays.pop("half").transpose(1, 2, 0)).view("<f2")
    half = entries.reshape(9, -1).T.reshape(-1, 3, 3).astype(np.float32)
    count = len(arrays["nodes"])
    blocks = np.zeros((count, count, 3, 3), dtype=np.float32)
    i, j = np.triu_indices(count)
    blocks[j, i] = half.transpose(0, 2, 1)
    blocks[i, j] = half
    return SurfaceCompliance(blocks=blocks, **arrays)
