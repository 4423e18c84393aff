"""VTK's XML files through this program's own writing: VTK itself says nothing where a disk is full."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from mechanics.errors import PalpateError
from mechanics.files import reading


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
    """What a VTK file holds; raises `error` in one line where the reader complains."""
    import pyvista

    with reading(path, error):
        path.open("rb").close()
    try:
        with pyvista.VtkErrorCatcher(raise_errors=True), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return pyvista.read(path)
    except (RuntimeError, ValueError, TypeError, KeyError, IndexError, MemoryError, OSError) as wrong:
        raise error(
            f"'{path}' is damaged: VTK cannot read it ({' '.join(str(wrong).split())[:200]})"
        ) from wrong
