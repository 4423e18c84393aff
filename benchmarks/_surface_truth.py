"""Known shapes and a hand that touches them, for measuring surfaces: geometry alone, no mechanics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyvista
from scipy.spatial import cKDTree

from palpate.mechanics.shape.nearest import closest, sample
from palpate.reconstruction.shapes.fit import Evidence

TIP_RADIUS_M = 0.005


@dataclass(frozen=True)
class Truth:
    """A closed triangle surface in its own frame: base on z = 0, z up; m."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray

    @property
    def volume_m3(self) -> float:
        """Enclosed volume."""
        corner = self.vertices[self.triangles]
        return float(np.einsum("ij,ij->i", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]).sum() / 6)


def phantom_truth(name: str) -> Truth:
    """An embedded phantom."""
    from palpate.scenes.phantoms import phantom

    found = phantom(name)
    return Truth(name, found.vertices, found.faces)


def _stack(name: str, outline: np.ndarray, levels: list[tuple[float, float]]) -> Truth:
    """Outline (n, 2) scaled and lifted by each (scale, z), fanned to the middle below and above."""
    from palpate.reconstruction.shapes.shape import rings_to_mesh

    rings = np.array([np.column_stack([s * outline, np.full(len(outline), z)]) for s, z in levels])
    return Truth(name, *rings_to_mesh(rings, np.array([0, 0, levels[-1][1]])))


def _dense(corners: list[tuple[float, float]], step: float = 0.002) -> np.ndarray:
    points = []
    for a, b in zip(np.array(corners), np.roll(corners, -1, axis=0), strict=True):
        count = max(1, int(np.linalg.norm(b - a) / step))
        points.append(a + (b - a) * np.arange(count)[:, None] / count)
    return np.vstack(points)


def frustum() -> Truth:
    """A square pyramid cut flat: 100 mm wide below, 60 mm above, 45 mm high."""
    outline = _dense([(0.05, -0.05), (0.05, 0.05), (-0.05, 0.05), (-0.05, -0.05)])
    wall = [(1 - 0.4 * u, 0.045 * u) for u in np.linspace(0, 1, 24)]
    return _stack("frustum", outline, [*wall, *((0.6 * u, 0.045) for u in np.linspace(1, 0.02, 16)[1:])])


def cone() -> Truth:
    """A round cone cut flat: radius 50 mm below, 28 mm above, 60 mm high."""
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    outline = 0.05 * np.column_stack([np.cos(angle), np.sin(angle)])
    wall = [(1 - 0.44 * u, 0.06 * u) for u in np.linspace(0, 1, 30)]
    return _stack("cone", outline, [*wall, *((0.56 * u, 0.06) for u in np.linspace(1, 0.02, 14)[1:])])


def hexagon() -> Truth:
    """An upright hexagonal block, 50 mm to a corner, 40 mm high."""
    angle = np.radians([-90, -30, 30, 90, 150, 210])
    outline = _dense([(0.05 * np.cos(a), 0.05 * np.sin(a)) for a in angle])
    wall = [(1.0, 0.04 * u) for u in np.linspace(0, 1, 20)]
    return _stack("hexagon", outline, [*wall, *((u, 0.04) for u in np.linspace(1, 0.02, 20)[1:])])


def ellipsoid() -> Truth:
    """Half of an ellipsoid with semi-axes 65, 45, 50 mm."""
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    outline = np.column_stack([0.065 * np.cos(angle), 0.045 * np.sin(angle)])
    return _stack("ellipsoid", outline, [(np.cos(t), 0.05 * np.sin(t)) for t in np.linspace(0, 1.55, 50)])


def blob() -> Truth:
    """A lopsided smooth lump on a pear-shaped base, 45 mm high."""
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    radius = 0.048 * (1 + 0.15 * np.cos(angle - 0.5) + 0.06 * np.cos(3 * angle))
    truth = _stack(
        "blob",
        radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]),
        [(np.cos(t) ** 0.8, 0.045 * np.sin(t)) for t in np.linspace(0, 1.56, 60)],
    )
    vertices = truth.vertices.copy()
    z = vertices[:, 2].copy()
    vertices[:, 2] *= 1 + 2.0 * vertices[:, 0] - 1.2 * vertices[:, 1]
    vertices[:, 1] += 0.1 * z
    return Truth("blob", vertices, truth.triangles)


def angle_piece() -> Truth:
    """An L-shaped block, limbs 100 and 80 mm long and 40 mm wide, 40 mm high."""
    outline = _dense(
        [(-0.02, -0.02), (0.08, -0.02), (0.08, 0.02), (0.02, 0.02), (0.02, 0.06), (-0.02, 0.06)], 0.002
    )
    wall = [(1.0, 0.04 * u) for u in np.linspace(0, 1, 20)]
    return _stack("angle-piece", outline, [*wall, *((u, 0.04) for u in np.linspace(1, 0.02, 40)[1:])])


def soap() -> Truth:
    """A block 110 mm by 70 mm, 40 mm high, all upper edges rounded by 12 mm."""
    outline = _dense([(0.055, -0.035), (0.055, 0.035), (-0.055, 0.035), (-0.055, -0.035)], 0.0015)
    truth = _stack(
        "soap",
        outline,
        [(1.0, 0.04 * u) for u in np.linspace(0, 1, 20)] + [(u, 0.04) for u in np.linspace(1, 0.01, 60)[1:]],
    )
    vertices = truth.vertices.copy()
    inside = np.minimum(0.055 - np.abs(vertices[:, 0]), 0.035 - np.abs(vertices[:, 1]))
    drop = 0.012 - np.sqrt(np.maximum(0.012**2 - np.maximum(0.012 - inside, 0) ** 2, 0))
    vertices[:, 2] = np.minimum(vertices[:, 2], 0.04 - drop)
    return Truth("soap", vertices, truth.triangles)


def _height_field(name: str, outline: np.ndarray, height: Callable[[np.ndarray], np.ndarray]) -> Truth:
    """Upright walls over an outline (n, 2) up to `height(xy (k, 2)) -> (k,)`, drawn finely."""
    wall = [(1.0, u) for u in np.linspace(0, 1, 24)]
    flat = _stack(name, outline, [*wall, *((u, 1.0) for u in np.linspace(1, 0.01, 70)[1:])])
    vertices = flat.vertices.copy()
    vertices[:, 2] *= height(vertices[:, :2])
    return Truth(name, vertices, flat.triangles)


def _rectangle(length: float, width: float) -> np.ndarray:
    x, y = length / 2, width / 2
    return _dense([(x, -y), (x, y), (-x, y), (-x, -y)], 0.0015)


def gable() -> Truth:
    """A house: 100 mm by 70 mm, walls 30 mm, ridge 52 mm high."""
    return _height_field("gable", _rectangle(0.1, 0.07), lambda p: 0.052 - 0.022 * np.abs(p[:, 1]) / 0.035)


def vault() -> Truth:
    """A barrel vault: 100 mm long, 80 mm wide, an arch of 40 mm radius on walls of 12 mm."""
    return _height_field(
        "vault", _rectangle(0.1, 0.08), lambda p: 0.012 + np.sqrt(np.maximum(0.04**2 - p[:, 1] ** 2, 0))
    )


def saddle() -> Truth:
    """A round block of radius 50 mm whose top is a saddle between 35 and 51 mm."""
    angle = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    outline = 0.05 * np.column_stack([np.cos(angle), np.sin(angle)])
    return _height_field("saddle", outline, lambda p: 0.043 + 3.2 * (p[:, 0] ** 2 - p[:, 1] ** 2))


def bullet() -> Truth:
    """An upright column of radius 35 mm with a half-ball on top, 70 mm high."""
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    outline = 0.035 * np.column_stack([np.cos(angle), np.sin(angle)])
    ball = [(np.cos(t), 0.035 + 0.035 * np.sin(t)) for t in np.linspace(0, 1.56, 30)]
    return _stack("bullet", outline, [*((1.0, z) for z in np.linspace(0, 0.034, 14)), *ball])


def horseshoe() -> Truth:
    """A horseshoe of rounded section: mean radius 45 mm, 36 mm wide and high; no point sees its whole
    outline."""
    turn = np.linspace(-2.1, 2.1, 120)
    middle = 0.045 * np.column_stack([np.cos(turn), np.sin(turn)])
    x, y = np.meshgrid(np.arange(-0.075, 0.075, 0.0015), np.arange(-0.075, 0.075, 0.0015), indexing="ij")
    z = np.arange(-0.0015, 0.045, 0.0015)
    away = cKDTree(middle).query(np.column_stack([x.ravel(), y.ravel()]))[0].reshape(x.shape)
    level = ((away[..., None] / 0.018) ** 3 + np.maximum(z / 0.036, 0) ** 3) ** (1 / 3) - 1
    level[..., 0] = np.maximum(-level[..., 1], 0.05)
    grid = pyvista.ImageData(dimensions=level.shape, spacing=(0.0015,) * 3, origin=(-0.075, -0.075, -0.0015))
    grid["level"] = level.ravel(order="F")
    found = grid.contour([0.0], scalars="level").triangulate().clean()
    vertices, triangles = np.asarray(found.points, dtype=float), found.regular_faces
    vertices[vertices[:, 2] < 1e-9, 2] = 0.0
    truth = Truth("horseshoe", vertices, triangles)
    return truth if truth.volume_m3 > 0 else Truth("horseshoe", vertices, triangles[:, ::-1])


OWN: dict[str, Callable[[], Truth]] = {
    f().name: f
    for f in (
        frustum,
        cone,
        hexagon,
        ellipsoid,
        blob,
        angle_piece,
        soap,
        gable,
        vault,
        saddle,
        bullet,
        horseshoe,
    )
}
"""Shapes that no phantom has."""


def touch(
    truth: Truth, seed: int = 0, *, places: int = 28, repeats: int = 10, centre_error_m: float = 6e-5
) -> tuple[Evidence, Callable[[np.ndarray], np.ndarray]]:
    """What a hand would tell of the shape, and the map from the device frame back to the shape's own.

    Places are spread over the surface above 12 mm and 9 mm away from edges; first-force normals are wrong by
    6 degrees a component; the tracing leans in by 0.25 mm in the mean and up to 0.6 mm.
    """
    rng = np.random.default_rng(seed)
    turn, shift = _frame(rng)
    shell = pyvista.PolyData.from_regular_faces(truth.vertices, truth.triangles)
    points = sample(truth.vertices, truth.triangles, 6000, seed)
    points = points[points[:, 2] > 0.012]
    _, index, _ = closest(truth.vertices, truth.triangles, points)
    corner = truth.vertices[truth.triangles[index]]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = shell.extract_feature_edges(
        feature_angle=30, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    kept = np.ones(len(points), dtype=bool)
    if edges.n_points:
        kept &= cKDTree(edges.points).query(points)[0] > 0.009
    centres = points + TIP_RADIUS_M * normals
    free = np.linalg.norm(closest(truth.vertices, truth.triangles, centres)[0] - centres, axis=1)
    kept &= free > TIP_RADIUS_M - 1e-4
    points, normals, centres = points[kept], normals[kept], centres[kept]
    chosen = [int(rng.integers(len(points)))]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < places and away.max() > 0.012:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    chosen += list(rng.choice(chosen, repeats))
    n = normals[chosen]
    centres = (
        centres[chosen] + (rng.normal(0, centre_error_m, len(chosen)) - 0.5 * centre_error_m)[:, None] * n
    )
    felt = n + np.radians(6) * rng.normal(size=n.shape)
    felt /= np.linalg.norm(felt, axis=1, keepdims=True)
    path = _trace(shell, rng)
    tangent = np.roll(path, -2, axis=0) - np.roll(path, 2, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    outward = np.column_stack([tangent[:, 1], -tangent[:, 0], np.zeros(len(path))])
    traced = np.column_stack([path, np.full(len(path), TIP_RADIUS_M)])
    rim = np.column_stack([path, np.zeros(len(path))]) - TIP_RADIUS_M * outward

    def to_device(p: np.ndarray) -> np.ndarray:
        return p @ turn.T + shift

    evidence = Evidence(
        to_device(np.zeros(3)),
        turn @ np.array([0, 0, 1.0]),
        to_device(rim),
        to_device(traced),
        to_device(centres),
        felt @ turn.T,
        np.full(len(centres), centre_error_m / 2),
        TIP_RADIUS_M,
    )
    return evidence, lambda p: (p - shift) @ turn


def _frame(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn)), rng.uniform(-0.1, 0.1, 3)


def _trace(shell: pyvista.PolyData, rng: np.random.Generator) -> np.ndarray:
    """(k, 2), counter-clockwise: where the centre of a tip on the support goes round, leaning in a little."""
    low, high = np.array(shell.bounds[::2])[:2] - 0.012, np.array(shell.bounds[1::2])[:2] + 0.012
    count = np.ceil((high - low) / 0.001).astype(int) + 1
    axes = [low[k] + 0.001 * np.arange(count[k]) for k in (0, 1)]
    plane = pyvista.RectilinearGrid(*axes, [TIP_RADIUS_M]).compute_implicit_distance(shell)
    field = np.asarray(plane["implicit_distance"]).reshape(count[::-1])
    level = TIP_RADIUS_M - 0.00025
    lines = pyvista.RectilinearGrid(*axes, [0.0])
    lines["d"] = field.ravel()
    curve = lines.contour([level], scalars="d").strip()
    cell = max((curve.get_cell(i) for i in range(curve.n_cells)), key=lambda c: c.n_points)
    path = np.asarray(cell.points)[:, :2]
    x, y = path[:-1].T
    if np.sum(x * path[1:, 1] - y * path[1:, 0]) < 0:
        path = path[::-1]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.arange(0, length[-1], 0.0006)
    path = np.column_stack([np.interp(at, length, path[:, k]) for k in (0, 1)])
    # the lean wanders along the path
    wave = sum(
        rng.normal(0, 0.00009) * np.cos(k * 2 * np.pi * at / length[-1] + rng.uniform(0, 6.3))
        for k in range(1, 7)
    )
    tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return path + np.clip(wave, -0.00035, 0.00025)[:, None] * np.column_stack([tangent[:, 1], -tangent[:, 0]])
