"""VTK's XML files through this program's own writing: VTK itself says nothing where a disk is full."""

from __future__ import annotations

import base64
import logging
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.mechanics.disk.overheard import overheard
from palpate.mechanics.disk.reading import reading
from palpate.mechanics.errors import PalpateError

_LOG = logging.getLogger(__name__)


def vtk_bytes(dataset: Any) -> bytes:
    """A .vtu of an unstructured grid, or a .vtp of surfaces and lines, as it would stand in the file."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    surfaces = dataset.GetClassName().endswith("PolyData")
    writer = vtkXMLPolyDataWriter() if surfaces else vtkXMLUnstructuredGridWriter()
    writer.SetInputData(dataset)
    writer.SetDataModeToBinary()
    writer.SetWriteToOutputString(True)
    writer.Write()
    data = writer.GetOutputString()
    return data.encode() if isinstance(data, str) else bytes(data)


def read_vtk(path: Path, error: type[PalpateError]) -> Any:
    """What a VTK file holds; raises `error` in one line where the reader complains, or would end the
    process."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    with reading(path, error):
        data = path.read_bytes()
    said = vtkLogger.GetCurrentVerbosityCutoff()
    try:
        if data.lstrip()[:1] == b"<":  # the older text format makes room for what is there
            _check_counts(data)
            _check_arrays(data)
        # what it complains about is raised, not printed by VTK itself, too
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        with overheard(_LOG), pyvista.VtkErrorCatcher(raise_errors=True):
            return pyvista.read(path)
    except (RuntimeError, ValueError, TypeError, KeyError, IndexError, MemoryError, OSError) as wrong:
        raise error(
            f"'{path}' is damaged: VTK cannot read it ({' '.join(str(wrong).split())[:200]})"
        ) from wrong
    finally:
        vtkLogger.SetStderrVerbosity(said)


def _check_counts(data: bytes) -> None:
    """Raises ValueError where the file declares more points or cells than it can hold: VTK makes room for
    them first, and ends the whole process where there is none."""
    most = min(_PACKED * len(data), _MOST_COUNT)
    for name, digits in _COUNT.findall(data):
        if len(digits) > 18 or int(digits) > most:
            raise ValueError(f"{name.decode()} of {digits.decode()[:20]} in a file of {len(data)} bytes")


def _check_arrays(data: bytes) -> None:
    """Raises ValueError where an array in the file's own text (as this program writes them) is not as long as
    its header says: VTK believes that header, and ends the whole process where it asks for too much."""
    if b"<AppendedData" in data:
        return
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as wrong:
        raise ValueError(str(wrong)) from wrong
    count = np.dtype("<u8" if root.get("header_type") == "UInt64" else "<u4")
    for array in root.iter("DataArray"):
        if array.get("format") != "binary":
            continue
        text = (array.text or "").strip()
        if not root.get("compressor"):
            continue
        blocks = int(np.frombuffer(base64.b64decode(text[:12]), count, 1)[0])
        if blocks * count.itemsize > len(text):
            raise ValueError(f"the array {array.get('Name')} declares {blocks} blocks")
        length = (3 + blocks) * count.itemsize
        head = 4 * -(-length // 3)  # header and blocks are packed each by itself
        sizes = np.frombuffer(base64.b64decode(text[:head]), count, 3 + blocks)
        body = base64.b64decode(text[head:])
        if int(sizes[3:].sum()) != len(body) or max(sizes[1], sizes[2]) > _BLOCK_BYTES:
            raise ValueError(f"the array {array.get('Name')} is not as long as it declares")


_BLOCK_BYTES = 1 << 26
_PACKED, _MOST_COUNT = 1032, 30_000_000
"""Times that zlib can pack bytes; points or cells of any file that is read here."""
_COUNT = re.compile(rb"""\b(NumberOf\w+)\s*=\s*["']\s*\+?(\d+)""")
