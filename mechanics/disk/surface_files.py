"""Closed surfaces from the files of other programs: STL, OBJ, PLY, glTF, VTP, VTU, VTK, MSH, INP, in metres.

Of a volume mesh the boundary is taken. Small or flat holes are closed, others are refused with their place;
triangles come out outward.

Meshes in Gmsh's first format ($NOD, $ELM), which libraries read no more.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from palpate.mechanics.disk.holes import close
from palpate.mechanics.disk.mesh_parts import Part, bodies, labels, without_specks
from palpate.mechanics.disk.overheard import overheard
from palpate.mechanics.disk.reading import bounded_memory, no_file
from palpate.mechanics.disk.vtk_files import read_vtk
from palpate.mechanics.errors import NotClosedError, PalpateWarning, SurfaceError
from palpate.mechanics.extras import install_words
from palpate.mechanics.quantities import parse_unit

if TYPE_CHECKING:
    import trimesh


_CELLS = {
    2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6),
    7: ("pyramid", 5), 9: ("triangle6", 6), 11: ("tetra10", 10),
}  # fmt: skip
"""Gmsh's number of a kind of element -> meshio's name, and its nodes."""


def is_gmsh1(path: Path) -> bool:
    """Whether the file begins as that format does."""
    with path.open("rb") as file:
        return file.read(64).lstrip().startswith(b"$NOD")


def read_gmsh1(path: Path) -> Any:
    """The mesh as meshio's, its regions as cell data "gmsh:physical". Raises ValueError for a damaged
    file."""
    import meshio

    lines = [line.split() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    nodes = np.array(_section(lines, "$NOD"), dtype=float)
    at = {int(number): k for k, number in enumerate(nodes[:, 0])}
    cells: dict[str, list[list[int]]] = {}
    regions: dict[str, list[int]] = {}
    for row in _section(lines, "$ELM"):
        _, kind, physical, _, count, *members = map(int, row)
        name, size = _CELLS.get(kind, ("", 0))
        if not name:  # points and lines
            continue
        if count != size or len(members) != size:
            raise ValueError(f"an element of kind {kind} has {len(members)} nodes, {size} are due")
        cells.setdefault(name, []).append([at[member] for member in members])
        regions.setdefault(name, []).append(physical)
    blocks = [(name, np.array(rows)) for name, rows in cells.items()]
    held = {"gmsh:physical": [np.array(regions[name]) for name, _ in blocks]}
    return meshio.Mesh(nodes[:, 1:4], blocks, cell_data=held)


def _section(lines: list[list[str]], name: str) -> list[list[str]]:
    """The rows between a section's name with its count, and its end."""
    starts = [k for k, words in enumerate(lines) if words == [name]]
    if not starts:
        raise ValueError(f"no section {name}")
    count = int(lines[starts[0] + 1][0])
    rows = lines[starts[0] + 2 : starts[0] + 2 + count]
    if len(rows) < count or any(words[:1] and words[0].startswith("$") for words in rows):
        raise ValueError(f"section {name} ends before its {count} rows")
    return rows


_LOG = logging.getLogger(__name__)
BY_TRIMESH = (".stl", ".obj", ".ply", ".gltf", ".glb", ".off", ".3mf")
BY_VTK = (".vtp", ".vtu", ".vtk")
BY_MESHIO = {".msh": "gmsh", ".inp": "abaqus"}
"""And as what: of an ending that it does not know for sure it tries every reader, one of which never ends."""
SUFFIXES = (*BY_TRIMESH, *BY_VTK, *BY_MESHIO)
UNITS = {unit: parse_unit(unit).scale for unit in ("m", "cm", "mm", "um", "in")}
"""Metres in a file's unit of length."""
_FLAT = 1e-4
"""Angle, rad, below which neighbours are one flat face."""
LEAST_M, GREATEST_M = 0.002, 2.0
"""An object that a hand explores is so large across."""
USUAL_M = 0.01, 0.5
"""Most are."""


@dataclass(frozen=True)
class ClosedSurface:
    """vertices: (n, 3) m, in the file's frame. triangles: (m, 3), outward. name: of the file. notes: what was
    mended, in words. parts: the bodies or labels that it tells apart, none where it is one."""

    vertices: np.ndarray
    triangles: np.ndarray
    name: str
    notes: tuple[str, ...] = ()
    parts: tuple[Part, ...] = ()

    @property
    def size_m(self) -> float:
        """Greatest extent along an axis, m."""
        return float(np.ptp(self.vertices, axis=0).max())


def without_parts(surface: ClosedSurface, names: Collection[str]) -> ClosedSurface:
    """The surface of the other parts; as of any file, it tells none apart where one is left.

    Raises SurfaceError where none is."""
    import trimesh

    left = [part for part in surface.parts if part.name not in names]
    if not left:
        raise SurfaceError(f"of '{surface.name}' no part is left: leave some in")
    shell = trimesh.util.concatenate(
        [trimesh.Trimesh(part.vertices, part.triangles, process=False) for part in left]
    )
    rest = surface_of(shell)
    notes = (*surface.notes, *rest.notes, f"{', '.join(names)} left out")
    return replace(rest, name=surface.name, notes=notes, parts=tuple(left) if len(left) > 1 else ())


def is_surface_file(path: Path | str) -> bool:
    """Whether the name is that of a surface or mesh that can be read."""
    return Path(path).suffix.lower() in SUFFIXES


def read_surface(path: Path | str, unit: str = "m", up: np.ndarray | None = None) -> ClosedSurface:
    """The closed surface in a file. unit: of its lengths, one of UNITS. up: (3,) unit, out of the support; a
    surface that is open where it stands is closed there (`holes.close`).

    Raises SurfaceError where the file is not there, holds no triangles, is open, or is of no size that a hand
    explores.
    """
    path = Path(path)
    if not is_surface_file(path):
        allowed = ", ".join(s.removeprefix(".") for s in SUFFIXES)
        raise SurfaceError(f"'{path}' is no surface that can be read: allowed are {allowed}")
    if unit not in UNITS:
        raise SurfaceError(f"--unit is '{unit}'; allowed are {', '.join(UNITS)}")
    if not path.is_file():
        raise SurfaceError(f"'{path}' {no_file(path)}: name a file that is there")
    shell, labelled = _shell_of(path, UNITS[unit])
    with overheard(_LOG):
        return _closed(shell, path.name, unit, up, labelled, path)


def surface_of(shape: Any, unit: str = "m", up: np.ndarray | None = None) -> ClosedSurface:
    """The closed surface of a file, or of a triangle mesh that has `vertices` (n, 3) in `unit` and `faces`
    (m, 3). up: as in `read_surface`.

    Raises SurfaceError as `read_surface` does, and for what is neither.
    """
    import trimesh

    if isinstance(shape, str | Path):
        return read_surface(shape, unit, up)
    if not (hasattr(shape, "vertices") and hasattr(shape, "faces")):
        raise SurfaceError(
            f"a {type(shape).__name__} is no surface: give a file, or a mesh with vertices and faces"
        )
    if unit not in UNITS:
        raise SurfaceError(f"unit is '{unit}'; allowed are {', '.join(UNITS)}")
    mesh = trimesh.Trimesh(np.array(shape.vertices, dtype=float), np.array(shape.faces), process=False)
    with overheard(_LOG):
        return _closed(mesh, "the mesh", unit, up)


def _closed(
    shell: trimesh.Trimesh,
    name: str,
    unit: str,
    up: np.ndarray | None = None,
    labelled: tuple[Part, ...] = (),
    path: Path | None = None,
) -> ClosedSurface:
    shell, joined = _cleaned(shell)
    if not len(shell.faces):
        raise SurfaceError(f"'{name}' holds no triangles: export the object as a surface of triangles")
    size = float(np.ptp(shell.vertices, axis=0).max())
    _check_size(name, size, unit)
    given = name, np.array(shell.vertices) * UNITS[unit], np.array(shell.faces, dtype=np.int64)
    try:
        notes = joined + close(shell, name, UNITS[unit], up)
    except SurfaceError as error:
        raise NotClosedError(str(error), *given) from error
    if shell.volume < 0:
        shell.invert()
    if not shell.volume > 1e-6 * size**3:
        raise NotClosedError(
            f"'{name}' encloses no volume: it is a sheet, or it crosses itself, so that inside and outside "
            "cancel; a solid object is needed: mend it in the program that made the file",
            *given,
        )
    if not labelled:
        shell, dust = without_specks(shell)
        notes += dust
    vertices = np.asarray(shell.vertices) * UNITS[unit]
    parts = labelled or bodies(shell, path, UNITS[unit])
    return ClosedSurface(vertices, np.asarray(shell.faces, dtype=np.int64), name, notes, parts)


def _shell_of(path: Path, metres: float) -> tuple[trimesh.Trimesh, tuple[Part, ...]]:
    """The triangles of a file, in its own unit, and the labels of its cells."""
    import trimesh

    suffix = path.suffix.lower()
    try:
        with bounded_memory(path, SurfaceError):
            if suffix in BY_TRIMESH:
                loaded: Any = trimesh.load(path, force="mesh", resolver=_within(path.resolve().parent))
                if not isinstance(loaded, trimesh.Trimesh):
                    raise SurfaceError(f"'{path}' holds no triangles: export the object as a surface")
                return loaded, ()
            if suffix in BY_VTK:
                return _boundary(read_vtk(path, SurfaceError), {}, metres)
            import meshio
            import pyvista

            with overheard(_LOG):
                if suffix == ".msh" and is_gmsh1(path):
                    held = read_gmsh1(path)
                else:
                    held = meshio.read(path, file_format=BY_MESHIO[suffix])
                names = {int(about[0]): name for name, about in held.field_data.items() if len(about) == 2}
                return _boundary(pyvista.from_meshio(held), names, metres)
    except SurfaceError:
        raise
    except ImportError as error:
        name = suffix.removeprefix(".")
        raise SurfaceError(
            f"'{path}' needs {error.name or 'a library'} to be read as {name}, which is not installed: "
            + install_words("import", error.name)
        ) from error
    except (SystemExit, Exception) as error:  # each library has errors of its own for a damaged file
        reason = "it is damaged" if isinstance(error, SystemExit) else " ".join(str(error).split())[:200]
        raise SurfaceError(
            f"'{path}' cannot be read as {suffix.removeprefix('.')} ({reason}): write it anew, as stl where "
            "that fails"
        ) from error


def _within(folder: Path) -> Any:
    """Finds the files that a file names, in its own folder alone: trimesh below 5 follows any path."""
    from trimesh.resolvers import FilePathResolver

    class Within(FilePathResolver):
        def get(self, name: str) -> bytes:
            wanted = (folder / name.strip()).resolve()
            if not (wanted.is_relative_to(folder) and wanted.is_file()):
                raise FileNotFoundError(f"it names '{name.strip()}', which is no file in its folder")
            return wanted.read_bytes()

        def namespaced(self, namespace: str) -> Any:
            return _within(folder / namespace)

    return Within(str(folder))


def _boundary(grid: Any, names: Mapping[int, str], metres: float) -> tuple[trimesh.Trimesh, tuple[Part, ...]]:
    """The outer faces of a VTK data set: of its solid cells where it has any; and their labels, which may be
    named."""
    import pyvista
    import trimesh

    if isinstance(grid, pyvista.MultiBlock):
        grid = grid.combine()
    parts: tuple[Part, ...] = ()
    if isinstance(grid, pyvista.UnstructuredGrid):
        solid = np.isin(grid.celltypes, _SOLID)
        if solid.any():
            grid = grid.extract_cells(np.flatnonzero(solid).tolist())
            parts = labels(grid, names, metres)
    if not isinstance(grid, pyvista.PolyData):
        grid = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)
    shell = grid.triangulate()
    if shell.n_cells == 0 or not len(shell.faces):
        return trimesh.Trimesh(), parts
    faces = shell.faces.reshape(-1, 4)[:, 1:]
    return trimesh.Trimesh(np.asarray(shell.points, dtype=float), faces), parts


_SOLID = (10, 11, 12, 13, 14, 24, 25, 26, 27, 29, 37)
"""VTK's numbers of tetrahedra, voxels, hexahedra, wedges and pyramids, linear and quadratic."""


def _cleaned(shell: trimesh.Trimesh) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    """One node a place, no triangle twice or flat, no wall between bodies that touch; what was joined."""
    shell.merge_vertices(merge_tex=True, merge_norm=True)
    shell.update_faces(shell.nondegenerate_faces(height=1e-12 * max(float(shell.scale), 1e-12)))
    open_walls = _without_walls(shell)
    words: tuple[str, ...] = ()
    if open_walls is None:
        shell.update_faces(shell.unique_faces())
    else:
        shell, words = open_walls, ("bodies that touch joined",)
    shell.remove_unreferenced_vertices()
    return shell, words


def _without_walls(shell: trimesh.Trimesh) -> trimesh.Trimesh | None:
    """The shell without pairs of flat faces within the same edges that look opposite ways, as bodies have
    that share a face, whichever way each is cut into triangles; None where there are none, or where that
    leaves it open, as of a surface drawn on both sides."""
    if shell.is_watertight:
        return None
    flat = shell.face_adjacency[shell.face_adjacency_angles < _FLAT]
    graph = coo_matrix((np.ones(len(flat)), flat.T), shape=(len(shell.faces),) * 2)
    _, face = connected_components(graph, directed=False)
    edges = shell.edges.reshape(-1, 3, 2)
    order = np.argsort(face, kind="stable")
    outlines = [_outline(edges[own]) for own in np.split(order, np.cumsum(np.bincount(face))[:-1])]
    known = set(outlines)
    wall = np.array([frozenset((b, a) for a, b in outline) in known for outline in outlines])
    if not wall.any():
        return None
    kept = shell.copy()
    kept.update_faces(~wall[face])
    kept.update_faces(kept.unique_faces())
    kept.remove_unreferenced_vertices()
    return kept if len(kept.faces) and kept.is_watertight else None


def _outline(edges: np.ndarray) -> frozenset[tuple[int, int]]:
    """The directed edges of triangles (k, 3, 2) that none of them has the other way."""
    own = {(int(a), int(b)) for a, b in edges.reshape(-1, 2)}
    return frozenset((a, b) for a, b in own if (b, a) not in own)


def _check_size(name: str, size: float, unit: str) -> None:
    """Refuse a size that no object has; warn, before a mesh is made, of one that another unit makes usual."""
    least, greatest = USUAL_M
    fits = [name for name, metres in UNITS.items() if least <= size * metres <= greatest]
    hint = f"these look like {' or '.join(fits)}: give --unit {fits[0]}" if fits else "mend its scale"
    across = f"'{name}' is {size:.4g} {unit} across"
    if not LEAST_M <= size * UNITS[unit] <= GREATEST_M:
        raise SurfaceError(f"{across}; {LEAST_M:g} to {GREATEST_M:g} m are allowed: {hint}")
    if fits and unit not in fits:
        warnings.warn(f"{across}, {size * UNITS[unit]:.2g} m: {hint}", PalpateWarning, stacklevel=4)
