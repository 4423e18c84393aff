"""Tetrahedra inside a surface: base exactly on the support and fixed, everything else touchable (section
2.2).

Meshing beside the other steps: the mesher is a process of its own, and what needs no mesh goes on.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from palpate.mechanics.errors import MeshError
from palpate.mechanics.options import option
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest, distance, facings, sample
from palpate.mechanics.shape.tetmesh import EDGES, FACES, TetMesh, lone_faces
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s5_mesh.registry import AUTO, MESHERS, prepared

_SAMPLES = 4000
_TRIES = 3
_LOST = 0.02  # of the volume, what may be left out because nothing holds it
_TRIALS = 40
_SWEEPS = 40
_REACH = 0.3  # of the longest edge at the node
_MARGIN = 0.975  # of the bound; what is aimed at


@dataclass(frozen=True)
class MeshingOptions:
    """Size and fidelity of the tetrahedra."""

    mesh_size_m: float = option(0.010, "edge length l of the tetrahedra", unit="m", flag="--mesh-size")
    surface_distance_m: float = option(
        0.002, "bound sigma on the distance between mesh and surface", unit="m", flag="--surface-distance"
    )
    radius_edge_ratio: float = option(2.0, "bound rho on circumradius over shortest edge")
    mesh_source: str = option(
        AUTO,
        "what is meshed: the surface, or its voxels; auto: voxels in the paper's mode, else the surface",
        choices=(AUTO, *MESHERS),
    )


@dataclass(frozen=True)
class MeshReport:
    """Achieved quality. radius_edge_ratio: (m,). surface_distance_m: (k,) of samples of mesh and surface,
    both ways.

    edge_m: (e,) edge lengths. volume_m3 of the mesh; surface_volume_m3 of the surface it fills.
    """

    radius_edge_ratio: np.ndarray
    surface_distance_m: np.ndarray
    edge_m: np.ndarray
    volume_m3: float
    surface_volume_m3: float


@dataclass(frozen=True)
class Meshing:
    """A linear mesh in the device frame, its quality and the surface's uncertainty (n,) m at its nodes."""

    mesh: TetMesh
    report: MeshReport
    shape_uncertainty_m: np.ndarray


def mesh_surface(
    surface: Surface, options: MeshingOptions | None = None, progress: Progress = silent
) -> Meshing:
    """Fill the surface with linear tetrahedra (`mesh.quadratic()` adds mid-edge nodes), and judge them.

    Raises MeshError where the mesher fails or the mesh does not stand on the support.
    """
    return as_meshed(fill(surface, options, progress), surface)


def fill(surface: Surface, options: MeshingOptions | None = None, progress: Progress = silent) -> TetMesh:
    """The mesh of `mesh_surface` alone, which needs the surface's shape and not its uncertainty."""
    options = options or MeshingOptions()
    if not options.mesh_size_m > 0:
        raise MeshError(f"--mesh-size is {options.mesh_size_m} m; it must be greater than 0")
    progress("meshing", 0.0)
    lowest = float(((surface.vertices - surface.support_point) @ surface.support_normal).min())
    if abs(lowest) > 0.1 * options.surface_distance_m:
        raise MeshError(f"the surface ends {1e3 * lowest:.2f} mm above the support; it must stand on it")
    mesher = prepared(surface, options)
    made: list[tuple[float, TetMesh]] = []
    for take in range(_TRIES):
        progress("meshing", 0.8 * take / _TRIES)
        points, cells = mesher.fill(take=take)
        # a tetrahedron may be flattened, or beyond what relaxing mends; the mesher's next mesh is another
        try:
            mesh = _standing(points, cells, surface, mesher.envelope_m, options.radius_edge_ratio)
        except MeshError:
            if take == _TRIES - 1 and not made:
                raise
            continue
        worst = float(radius_edge_ratio(mesh.points[mesh.tetrahedra]).max())
        made.append((worst, mesh))
        if worst <= options.radius_edge_ratio:
            break
    progress("meshing", 1.0)
    return min(made, key=lambda each: each[0])[1]


def as_meshed(mesh: TetMesh, surface: Surface) -> Meshing:
    """A mesh that was there already, as what `mesh_surface` returns."""
    return Meshing(mesh, quality(mesh, surface), uncertainty_at(mesh, surface))


def _standing(
    points: np.ndarray, cells: np.ndarray, surface: Surface, envelope: float, ratio: float
) -> TetMesh:
    """The mesh put on its support and relaxed; raises MeshError where that leaves a flat tetrahedron."""
    up, origin = surface.support_normal, surface.support_point
    points, cells, fixed = _stand(points, cells, origin, up, 1.01 * envelope + 1e-6)
    on_surface = np.zeros(len(points), dtype=bool)
    on_surface[_boundary(cells)] = True
    points = relaxed(points, cells, ratio, on_surface=on_surface, fixed=fixed, up=up, limit_m=envelope)
    return TetMesh(points, cells, fixed, on_surface & ~fixed, surface.shape)


def _boundary(cells: np.ndarray) -> np.ndarray:
    return cells[:, FACES].reshape(-1, 3)[lone_faces(cells)]


def _stand(
    points: np.ndarray, cells: np.ndarray, origin: np.ndarray, up: np.ndarray, reach_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes of downward faces within `reach_m` of the support, put on it: points, tetrahedra, which nodes
    those are.

    Tetrahedra that this flattens onto the support are left out, and nodes that no tetrahedron uses.
    """
    faces = _boundary(cells)
    _, normal = facings(points, faces)
    height = (points - origin) @ up
    base = (np.abs(height[faces]) < reach_m).all(axis=1) & (normal @ up < -0.7)
    if not base.any():
        raise MeshError("the mesh has no face on the support: the surface does not stand on it")
    fixed = np.zeros(len(points), dtype=bool)
    fixed[faces[base]] = True
    points = points.copy()
    points[fixed] -= height[fixed, None] * up
    cells = _held(points, cells[~fixed[cells].all(axis=1)], fixed)
    used = np.unique(cells)
    index = np.full(len(points), -1)
    index[used] = np.arange(len(used))
    return points[used], index[cells], fixed[used]


def _held(points: np.ndarray, cells: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """The tetrahedra (m, 4) of the largest piece and of those that stand on the base themselves.

    Pieces hang together by faces. One that nothing holds (a drop of the drawing beside it, what hung on
    flattened tetrahedra) would leave the stiffness singular. Raises MeshError where that is more than
    _LOST of the volume.
    """
    faces = np.sort(cells[:, FACES].reshape(-1, 3), axis=1)
    owner = np.repeat(np.arange(len(cells)), 4)
    order = np.lexsort(faces.T)
    same = (np.diff(faces[order], axis=0) == 0).all(axis=1)
    pair = owner[order][:-1][same], owner[order][1:][same]
    graph = coo_matrix((np.ones(len(pair[0])), pair), shape=(len(cells), len(cells)))
    pieces, piece = connected_components(graph, directed=False)
    if pieces == 1:
        return cells
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    volume = np.bincount(piece, np.abs(np.linalg.det(edges)) / 6)
    standing = [len(np.unique(cells[piece == k][fixed[cells[piece == k]]])) >= 3 for k in range(pieces)]
    kept = np.array(standing) | (np.arange(pieces) == np.argmax(volume))
    lost = float(volume[~kept].sum() / volume.sum())
    if lost > _LOST:
        raise MeshError(f"the surface is in pieces: {100 * lost:.0f} % of it does not stand on the support")
    return cells[kept[piece]]


def quality(mesh: TetMesh, surface: Surface) -> MeshReport:
    """Radius-edge ratios, edge lengths, and distances between the mesh's boundary and the surface."""
    corner = mesh.points[mesh.tetrahedra[:, :4]]
    ratio = radius_edge_ratio(corner)
    edges = np.linalg.norm(corner[:, [0, 1, 2, 0, 1, 2]] - corner[:, [1, 2, 0, 3, 3, 3]], axis=2)
    shell, given = (mesh.points, mesh.surface[:, :3]), (surface.vertices, surface.triangles)
    out = distance(*given, sample(*shell, _SAMPLES))
    back = distance(*shell, sample(*given, _SAMPLES))
    return MeshReport(
        radius_edge_ratio=ratio,
        surface_distance_m=np.concatenate([out, back]),
        edge_m=edges.ravel(),
        volume_m3=float(mesh.volumes.sum()),
        surface_volume_m3=surface.volume_m3,
    )


def uncertainty_at(mesh: TetMesh, surface: Surface) -> np.ndarray:
    """(n,) the surface's uncertainty at each node: of the closest place on it; 0 on the base's nodes
    inside."""
    found = np.zeros(len(mesh.points))
    nodes = np.flatnonzero(mesh.touchable)
    _, triangle, weight = closest(surface.vertices, surface.triangles, mesh.points[nodes])
    found[nodes] = (weight * surface.uncertainty_m[surface.triangles[triangle]]).sum(axis=1)
    return found


def radius_edge_ratio(corners: np.ndarray) -> np.ndarray:
    """(...,) circumradius over shortest edge of tetrahedra (..., 4, 3); infinite where inverted or flat."""
    a, b, c = (corners[..., k, :] - corners[..., 0, :] for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    six_volumes = (a * bc).sum(axis=-1)
    lengths = (a * a).sum(axis=-1), (b * b).sum(axis=-1), (c * c).sum(axis=-1)
    centre = sum(s[..., None] * w for s, w in zip(lengths, (bc, ca, ab), strict=True))
    edge = corners[..., EDGES[:, 0], :] - corners[..., EDGES[:, 1], :]
    shortest = np.sqrt((edge * edge).sum(axis=-1).min(axis=-1))
    radius = np.linalg.norm(centre, axis=-1) / np.maximum(2 * six_volumes, 1e-300)
    good = six_volumes > 1e-9 * shortest**3
    return np.where(good, radius / np.maximum(shortest, 1e-300), np.inf)


def relaxed(
    points: np.ndarray,
    cells: np.ndarray,
    bound: float,
    *,
    on_surface: np.ndarray,
    fixed: np.ndarray,
    up: np.ndarray,
    limit_m: float,
) -> np.ndarray:
    """Nodes (n, 3) with tetrahedra (m, 4) of ratios below `bound` wherever moving nodes can do it.

    on_surface, fixed: (n,) bool. Nodes of the surface stay within `limit_m` of where they were, fixed nodes
    in their plane besides (up: its unit normal); nodes inside are free. No move makes a node's worst
    tetrahedron worse, so none turns inside out. Repeatable: the trial moves are seeded.
    """
    found, wanted = points.copy(), _MARGIN * bound
    order = np.argsort(cells.ravel(), kind="stable")
    owner = order // cells.shape[1]
    first = np.searchsorted(cells.ravel()[order], np.arange(len(points) + 1))
    random = np.random.default_rng(0)
    bad = radius_edge_ratio(found[cells]) > wanted
    for _ in range(_SWEEPS):
        if not bad.any():
            break
        for node in np.unique(cells[bad]):
            star = owner[first[node] : first[node + 1]]
            corners = found[cells[star]]
            worst = radius_edge_ratio(corners).max()
            if worst <= wanted:
                continue
            move = _trial_moves(random, _REACH * np.linalg.norm(corners - found[node], axis=2).max())
            if on_surface[node]:
                move += found[node] - points[node]
                move *= np.minimum(1, limit_m / np.maximum(np.linalg.norm(move, axis=1), 1e-300))[:, None]
                move += points[node] - found[node]
            if fixed[node]:
                move -= (move @ up)[:, None] * up
            trial = np.repeat(corners[None], _TRIALS, axis=0)
            trial[:, cells[star] == node] += move[:, None]
            score = radius_edge_ratio(trial).max(axis=1)
            best = int(np.argmin(score))
            if score[best] < worst:
                found[node] += move[best]
        bad = radius_edge_ratio(found[cells]) > wanted
    return found


def _trial_moves(random: np.random.Generator, reach_m: float) -> np.ndarray:
    """(_TRIALS, 3) m in all directions, long and short."""
    direction = random.standard_normal((_TRIALS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * (reach_m * np.exp(-3 * random.random((_TRIALS, 1))))


class BackgroundMesher(AbstractContextManager["BackgroundMesher"]):
    """Fills one surface and judges the mesh, each on demand and without waiting; a context manager.

    A mesh that is known needs no filling: `known`.
    """

    def __init__(self, options: MeshingOptions) -> None:
        self._options = options
        self._pool = ThreadPoolExecutor(1)
        self._mesh: Future[TetMesh] | None = None
        self._judged: Future[Meshing] | None = None

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()

    def begin(self, surface: Surface) -> None:
        """Fill this surface, unless one is being filled."""
        if self._mesh is None:
            self._mesh = self._pool.submit(fill, surface, self._options)

    def known(self, mesh: TetMesh) -> None:
        """Take this mesh."""
        self._mesh = Future()
        self._mesh.set_result(mesh)

    def mesh(self, surface: Surface) -> TetMesh:
        """The linear mesh, which is judged against its surface from now on. Raises MeshError."""
        self.begin(surface)
        assert self._mesh is not None
        mesh = self._mesh.result()
        self._judged = self._pool.submit(as_meshed, mesh, surface)
        return mesh

    def judged(self) -> Meshing:
        """The mesh with its quality, after `mesh`."""
        assert self._judged is not None
        return self._judged.result()
