"""Local refinement of tetrahedra by bisection of longest edges (Rivara 1984): conforming and graded.

Meshes of the laboratory: a coarse one of the whole object, and quadratic ones graded towards a touch. In
mm.
"""

from __future__ import annotations

import contextlib
import hashlib
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.writing import atomic_file, temporary_folder
from palpate.mechanics.errors import MeshError
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])

_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def boundary_faces(tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(faces (k, 3) outward, their tetrahedra (k,)): faces that belong to one tetrahedron only."""
    faces = tetrahedra[:, _FACES].reshape(-1, 3)
    # one number a face, of at most 2 million nodes: whole rows are compared byte by byte, ten times as slow
    a, b, c = np.sort(faces.astype(np.int64), axis=1).T
    nodes = np.int64(tetrahedra.max()) + 1
    _, index, count = np.unique((a * nodes + b) * nodes + c, return_index=True, return_counts=True)
    single = index[count == 1]
    return faces[single], single // 4


def refine(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    size: Callable[[np.ndarray], np.ndarray],
    project: Callable[[np.ndarray, np.ndarray], np.ndarray],
    *,
    most: int = 120_000,
) -> tuple[np.ndarray, np.ndarray]:
    """Bisect until no tetrahedron's longest edge exceeds `size(its centroid)`.

    `project(midpoints, half_lengths)` moves new nodes of boundary edges onto the true surface. Stops at
    `most` tetrahedra. Returns (points, tetrahedra), orientation kept.
    """
    for _ in range(200):
        edges = np.sort(tetrahedra[:, _EDGES].reshape(-1, 2), axis=1)
        keys = edges[:, 0] * np.int64(len(points)) + edges[:, 1]
        unique, inverse = np.unique(keys, return_inverse=True)
        ends = np.column_stack([unique // len(points), unique % len(points)])
        lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
        # a strict order of all edges (length, then number), so that each tetrahedron has one longest edge
        rank = np.empty(len(unique), dtype=np.int64)
        rank[np.lexsort((np.arange(len(unique)), np.round(lengths, 9)))] = np.arange(len(unique))
        of_tetrahedron = inverse.reshape(-1, 6)
        longest = of_tetrahedron[np.arange(len(tetrahedra)), rank[of_tetrahedron].argmax(axis=1)]
        too_long = lengths[longest] > size(points[tetrahedra].mean(axis=1))
        if not too_long.any() or len(tetrahedra) > most:
            return points, tetrahedra
        marked = np.zeros(len(unique), dtype=bool)
        marked[longest[too_long]] = True
        while True:
            touched = marked[of_tetrahedron].any(axis=1)
            more = touched & ~marked[longest]
            if not more.any():
                break
            marked[longest[more]] = True
        shared = np.bincount(of_tetrahedron.ravel(), minlength=len(unique))
        as_longest = np.bincount(longest, minlength=len(unique))
        split = marked & (shared == as_longest)
        points, tetrahedra = _bisect(points, tetrahedra, ends, longest, split, project)
    return points, tetrahedra


def _bisect(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    ends: np.ndarray,
    longest: np.ndarray,
    split: np.ndarray,
    project: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    numbers = np.full(len(split), -1)
    numbers[split] = len(points) + np.arange(split.sum())
    a, b = ends[split].T
    middles = (points[a] + points[b]) / 2
    shell, _ = boundary_faces(tetrahedra)
    shell_edges = np.sort(shell[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    on_shell = np.isin(ends[split] @ [len(points), 1], shell_edges @ [len(points), 1])
    half = np.linalg.norm(points[a] - points[b], axis=1) / 2
    if on_shell.any():
        middles[on_shell] = project(middles[on_shell], half[on_shell])
    parents = np.flatnonzero(split[longest])
    edge = longest[parents]
    first, second = tetrahedra[parents].copy(), tetrahedra[parents].copy()
    first[first == ends[edge, 1][:, None]] = np.repeat(
        numbers[edge], (first == ends[edge, 1][:, None]).sum(1)
    )
    second[second == ends[edge, 0][:, None]] = np.repeat(
        numbers[edge], (second == ends[edge, 0][:, None]).sum(1)
    )
    keep = np.ones(len(tetrahedra), dtype=bool)
    keep[parents] = False
    return np.vstack([points, middles]), np.vstack([tetrahedra[keep], first, second])


COARSE_MM = 18.0
"""Edge length of the coarse mesh."""


def laboratory_cache() -> Path:
    """Where solved curves and meshes are kept."""
    return cache_folder() / "laboratory"


def surface_key(phantom: Phantom) -> str:
    """A content key of the phantom's surface."""
    digest = hashlib.sha256()
    digest.update(np.round(phantom.vertices * 1e6).astype(np.int64).tobytes())
    digest.update(phantom.faces.tobytes())
    if len(round_rim(phantom)):
        digest.update(f"its foot's rim drawn to {RIM_MM} mm".encode())
    return digest.hexdigest()[:20]


RIM_MM = 3.0
"""Edge length at the rim of a foot that a round underside ends in: no crease of the coarse mesh draws it, and
what its corners miss is not held."""
_GENTLE = 0.5


def round_rim(phantom: Phantom) -> np.ndarray:
    """(k, 3) mm: the rim of the foot, where the surface goes on beyond it at less than 60 degrees; else
    none."""
    corners = phantom.vertices[phantom.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    down = -across[:, 2] / np.maximum(np.linalg.norm(across, axis=1), 1e-300)
    foot = (corners[:, :, 2] < 1e-9).all(axis=1)
    rim = np.intersect1d(phantom.faces[foot], phantom.faces[~foot])
    beyond = np.isin(phantom.faces, rim).any(axis=1) & ~foot
    if not beyond.any() or np.median(down[beyond]) < _GENTLE:
        return np.zeros((0, 3))
    return phantom.vertices[rim] * 1e3


def coarse_mesh(phantom: Phantom, cache: Path | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(points (n, 3) mm, tetrahedra (m, 4)) of the whole object; made once for a surface and then cached.

    The mesher is not deterministic: whoever wants the same numbers again keeps the cache.
    """
    folder = (cache or laboratory_cache()) / "meshes"
    path = folder / f"{surface_key(phantom)}-{COARSE_MM:g}.npz"
    if (kept := _kept(path)) is not None:
        return _grounded(*kept)
    import pytetwild
    import pyvista

    shell = pyvista.PolyData(
        phantom.vertices * 1e3, np.column_stack([np.full(len(phantom.faces), 3), phantom.faces]).ravel()
    )
    wanted = shell.area / (0.433 * COARSE_MM**2)
    if wanted < len(phantom.faces):
        shell = shell.decimate(1 - wanted / len(phantom.faces))
    # the mesher leaves a file of its own in the working directory
    with temporary_folder("mesh-") as scratch, contextlib.chdir(scratch):
        points, tetrahedra = pytetwild.tetrahedralize(
            np.asarray(shell.points, dtype=float),
            shell.faces.reshape(-1, 4)[:, 1:].astype(np.int32),
            edge_length_abs=COARSE_MM,
            epsilon=2e-3,
            num_threads=1,
        )
    tetrahedra = _outward(points, tetrahedra.astype(np.int64))
    surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
    points = _snap(points, tetrahedra, surface)
    with atomic_file(path) as temporary:
        np.savez(temporary, points=points, tetrahedra=tetrahedra)
    return _grounded(points, tetrahedra)


NEAR_SUPPORT_MM = 0.4
"""Height of a corner that belongs to the foot, at most: the mesher may leave the surface by 0.2 % of the
object's size, and thinning the surface leaves its plane too."""


def _grounded(points: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same with the foot's corners on z = 0: a face of which one hangs above is no base, and not held."""
    shell = np.unique(boundary_faces(tetrahedra)[0])
    foot = shell[np.abs(points[shell, 2]) < NEAR_SUPPORT_MM]
    points = points.copy()
    points[foot, 2] = 0.0
    return points, tetrahedra


def _kept(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """A mesh of the cache; None where it is absent or damaged, and made anew."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            points, tetrahedra = stored["points"], stored["tetrahedra"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None
    whole = points.ndim == tetrahedra.ndim == 2 and points.shape[1] == 3 and tetrahedra.shape[1] == 4
    inside = whole and len(tetrahedra) > 0 and 0 <= tetrahedra.min() and tetrahedra.max() < len(points)
    sound = inside and np.isfinite(points).all() and (_volumes(points, tetrahedra) > 0).all()
    return (points, tetrahedra) if sound else None


def _volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    a, b, c, d = (points[tetrahedra[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def _outward(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    turned = _volumes(points, tetrahedra) < 0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return tetrahedra


def _snap(points: np.ndarray, tetrahedra: np.ndarray, surface: TriangleSurface) -> np.ndarray:
    """Boundary nodes moved onto the surface, except where that would flatten a tetrahedron."""
    shell = np.unique(boundary_faces(tetrahedra)[0])
    before = _volumes(points, tetrahedra)
    moved = points.copy()
    moved[shell] = surface.nearest(points[shell])[0]
    for _ in range(20):
        bad = _volumes(moved, tetrahedra) < 0.3 * before
        if not bad.any():
            break
        back = np.unique(tetrahedra[bad])
        moved[back] = points[back]
    return moved


@dataclass(frozen=True)
class QuadraticMesh:
    """points (n, 3) mm; cells (m, 10): corners, then edges 01 02 03 12 13 23; fixed (n,) bool: nodes of
    the base.

    faces (k, 6): boundary faces off the base, corners then edges 01 12 20; base (b, 6): faces on the
    support.
    """

    points: np.ndarray
    cells: np.ndarray
    fixed: np.ndarray
    faces: np.ndarray
    base: np.ndarray


def quadratic(points: np.ndarray, tetrahedra: np.ndarray, surface: TriangleSurface | None) -> QuadraticMesh:
    """Mid-edge nodes added; those of boundary edges lie on the true surface where the elements stay valid."""
    n = len(points)
    edges = np.sort(tetrahedra[:, _EDGES].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1, 6)
    straight = points[unique].mean(axis=1)
    cells = np.hstack([tetrahedra, n + inverse])
    shell, _ = boundary_faces(tetrahedra)
    number = {tuple(e): n + k for k, e in enumerate(unique.tolist())}
    mids = np.array(
        [[number[tuple(sorted((f[i], f[(i + 1) % 3])))] for i in range(3)] for f in shell.tolist()]
    )
    everything = np.vstack([points, straight])
    if surface is not None:
        everything = _bend(everything, cells, np.unique(mids), unique, n, surface)
    faces = np.hstack([shell, mids])
    low = np.abs(everything[:, 2]) < 1e-3
    on_base = low[faces].all(axis=1)
    fixed = np.zeros(len(everything), dtype=bool)
    fixed[np.unique(faces[on_base])] = True
    if not fixed.any():
        raise MeshError("no face lies on the support: the object must stand on z = 0 of its frame")
    everything[fixed, 2] = 0.0
    return QuadraticMesh(everything, cells, fixed, faces[~on_base], faces[on_base])


def _bend(
    points: np.ndarray,
    cells: np.ndarray,
    mids: np.ndarray,
    edges: np.ndarray,
    corners: int,
    surface: TriangleSurface,
) -> np.ndarray:
    target, distance, _ = surface.nearest(points[mids])
    ends = points[edges[mids - corners]]
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    # an edge that cuts across a rim is left straight
    smooth = distance < 0.12 * length
    bent = points.copy()
    bent[mids[smooth]] = target[smooth]
    for _ in range(10):
        bad = _least_jacobian(bent, cells) < 0.2 * _least_jacobian(points, cells)
        if not bad.any():
            return bent
        back = np.unique(cells[bad][:, 4:])
        bent[back] = points[back]
    return points


def _least_jacobian(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    gradients = np.array([shape_gradients(*b) for b in np.vstack([GAUSS, np.eye(4)[:, 1:]])])
    jacobian = np.einsum("gax,eay->egxy", gradients, points[cells])
    return np.linalg.det(jacobian).min(axis=1)


GAUSS = np.full((4, 3), 0.1381966011250105)
GAUSS[[1, 2, 3], [0, 1, 2]] = 0.5854101966249685
"""Four-point rule on the unit tetrahedron, each of weight 1/24 (exact to degree 2)."""


def shape_gradients(r: float, s: float, t: float) -> np.ndarray:
    """(10, 3) gradients of the quadratic shape functions with respect to (r, s, t)."""
    barycentric = np.array([1 - r - s - t, r, s, t])
    slope = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    corner = (4 * barycentric - 1)[:, None] * slope
    middle = np.array([4 * (barycentric[i] * slope[j] + barycentric[j] * slope[i]) for i, j in _EDGES])
    return np.vstack([corner, middle])


def graded_mesh(
    phantom: Phantom,
    point: np.ndarray,
    *,
    finest: float = 1.5,
    reach: float = 5.0,
    growth: float = 0.45,
    balls: tuple[tuple[np.ndarray, float], ...] = (),
    cache: Path | None = None,
) -> QuadraticMesh:
    """A quadratic mesh that is `finest` mm within `reach` mm of `point` (mm) and grows from there.

    balls: (centre, radius) mm of inclusions, which are resolved by elements of half their radius.
    """
    points, tetrahedra = coarse_mesh(phantom, cache)
    surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
    rim = round_rim(phantom)
    near_rim = cKDTree(rim) if len(rim) else None

    def size(at: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(at - point, axis=1)
        wanted = finest + growth * np.maximum(distance - reach, 0.0)
        for centre, radius in balls:
            outside = np.maximum(np.linalg.norm(at - centre, axis=1) - radius, 0.0)
            wanted = np.minimum(wanted, 0.6 * radius + 0.6 * outside)
        if near_rim is not None:
            wanted = np.minimum(wanted, RIM_MM + growth * near_rim.query(at)[0])
        return wanted * 1.35

    def project(middles: np.ndarray, half: np.ndarray) -> np.ndarray:
        target, distance, _ = surface.nearest(middles)
        return np.where((distance < 0.25 * half)[:, None], target, middles)

    points, tetrahedra = refine(points, tetrahedra, size, project)
    return quadratic(points, tetrahedra, surface)
