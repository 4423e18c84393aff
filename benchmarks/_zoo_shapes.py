"""Organs, phantoms and parts of machines for the zoo, drawn in mm from public descriptions of their forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

Field = Callable[[np.ndarray], np.ndarray]
"""(k, 3) mm to (k,) mm, some distance to a surface: negative inside."""


@dataclass(frozen=True)
class Drawn:
    """A mesh as its file has it; the volume of the object that it means, mm^3 (None: its own, or not known);
    the unit of its lengths, and the direction in which it stands."""

    mesh: trimesh.Trimesh
    volume_mm3: float | None
    unit: str = "mm"
    up: str = "+z"

    @property
    def sound(self) -> bool:
        """Whether the mesh encloses a volume as it is."""
        return bool(self.unit == "mm" and self.mesh.is_watertight and self.mesh.is_winding_consistent)


def whole(mesh: trimesh.Trimesh) -> Drawn:
    """A sound mesh: it means its own volume."""
    return Drawn(mesh, abs(float(mesh.volume)))


def standing(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Moved so that it stands on z = 0."""
    mesh.apply_translation([0, 0, -mesh.bounds[0, 2]])
    return mesh


def together(meshes: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """All of them in one file."""
    both = trimesh.util.concatenate(list(meshes))
    assert isinstance(both, trimesh.Trimesh)
    return both


def box(extents: Sequence[float], at: Sequence[float] = (0, 0, 0)) -> trimesh.Trimesh:
    """Its foot's middle at `at`."""
    made = trimesh.creation.box(extents=extents)
    made.apply_translation(np.array(at) + [0, 0, extents[2] / 2])
    return made


def revolved(profile: Sequence[tuple[float, float]], spacing: float = 4.0) -> trimesh.Trimesh:
    """Round z of (radius, height) points that begin and end on the axis, or at their beginning."""
    corners = np.array(profile, dtype=float)
    points = [corners[:1]]
    for a, b in zip(corners[:-1], corners[1:], strict=True):
        count = max(1, round(float(np.linalg.norm(b - a)) / spacing))
        points.append(a + (b - a) * np.arange(1, count + 1)[:, None] / count)
    made = trimesh.creation.revolve(np.vstack(points), sections=64)
    made.merge_vertices()
    return _outward(made)


def extruded(outline: Sequence[tuple[float, float]], height: float, lying: bool = False) -> trimesh.Trimesh:
    """An outline (x, y), anticlockwise, drawn up by `height`; lying: the outline is (x, z), drawn along y."""
    import pyvista

    flat = np.array(outline, dtype=float)
    count = len(flat)
    low = np.column_stack([flat, np.zeros(count)])
    number = np.arange(count)
    lines = np.column_stack([np.full(count, 2), number, np.roll(number, -1)])
    flat_lid = pyvista.PolyData(low, lines=lines.ravel()).triangulate_contours()
    lid: np.ndarray = np.asarray(flat_lid.regular_faces)
    nxt = np.roll(number, -1)
    walls = np.vstack(
        [np.column_stack([number, nxt, nxt + count]), np.column_stack([number, nxt + count, number + count])]
    )
    a, b, c = (flat[lid[:, k]] for k in range(3))
    if np.linalg.det(np.stack([b - a, c - a], axis=1)).sum() < 0:
        lid = lid[:, ::-1]
    faces = np.vstack([lid[:, ::-1], lid + count, walls])
    made = trimesh.Trimesh(np.vstack([low, low + [0, 0, height]]), faces)
    if lying:
        made.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    return standing(made)


def implicit(field: Field, half: Sequence[float], step: float, foot: float | None = None) -> trimesh.Trimesh:
    """The body where a field is negative, inside of a box of half the edges `half` about the origin; foot:
    height at which it is cut off flat."""
    import pyvista

    edges = np.array(half, dtype=float)
    count = np.ceil(2 * edges / step).astype(int) + 1
    grid = pyvista.ImageData(dimensions=tuple(count), spacing=tuple(2 * edges / (count - 1)), origin=-edges)
    grid["field"] = field(np.asarray(grid.points))
    shell = grid.contour([0.0], scalars="field", method="flying_edges").triangulate().clean()
    made = _outward(trimesh.Trimesh(np.asarray(shell.points, dtype=float), shell.regular_faces))
    return standing(made) if foot is None else flat_below(made, foot)


def flat_below(mesh: trimesh.Trimesh, height: float) -> trimesh.Trimesh:
    """Everything lower is moved up to that height, where it stands then."""
    mesh.vertices[:, 2] = np.maximum(mesh.vertices[:, 2], height)
    return standing(mesh)


def _outward(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def ball(at: Sequence[float], radii: Sequence[float] | float) -> Field:
    """An ellipsoid with its middle at `at`."""
    size = np.broadcast_to(np.asarray(radii, dtype=float), 3)
    return lambda p: (np.linalg.norm((p - at) / size, axis=1) - 1) * size.min()


def rod(a: Sequence[float], b: Sequence[float], radius: float) -> Field:
    """Between two points, with round ends."""
    start, way = np.array(a, dtype=float), np.subtract(b, a).astype(float)

    def field(p: np.ndarray) -> np.ndarray:
        along = np.clip((p - start) @ way / (way @ way), 0, 1)
        return np.linalg.norm(p - start - along[:, None] * way, axis=1) - radius

    return field


def joined(*fields: Field, round_mm: float = 4.0) -> Field:
    """Where one of them is, with fillets."""
    return lambda p: -round_mm * np.log(sum(np.exp(-np.clip(f(p), -90, 90) / round_mm) for f in fields))


def without(one: Field, other: Field, round_mm: float = 3.0) -> Field:
    """Where the first is and the second is not, rounded."""
    return lambda p: (
        round_mm
        * np.log(np.exp(np.clip(one(p), -90, 90) / round_mm) + np.exp(np.clip(-other(p), -90, 90) / round_mm))
    )


def dome(radius: float = 30.0, height: float = 40.0) -> trimesh.Trimesh:
    """A half ellipsoid whose flat foot lies on z = 0."""
    angle = np.linspace(0, np.pi / 2, 25)
    profile = np.column_stack([radius * np.cos(angle), height * np.sin(angle)])
    profile[-1, 0] = 0.0
    foot = np.column_stack([np.linspace(0, radius, 8)[:-1], np.zeros(7)])
    made = trimesh.creation.revolve(np.vstack([foot, profile]), sections=64)
    made.merge_vertices()
    return made


def organ(seed: int = 0, subdivisions: int = 4) -> trimesh.Trimesh:
    """A lumpy ellipsoid of 120 x 80 x 60 mm without a flat foot."""
    made = trimesh.creation.icosphere(subdivisions=subdivisions, radius=1.0)
    random = np.random.default_rng(seed)
    lumps = sum(
        0.06 * np.sin(made.vertices @ random.normal(0, 2.5, 3) + random.uniform(0, 6)) for _ in range(4)
    )
    made.vertices = made.vertices * (1 + lumps)[:, None] * [60, 40, 30]
    return made


def _liver() -> trimesh.Trimesh:
    lobes = joined(ball((-25, 0, 0), (50, 40, 30)), ball((38, 8, -4), (36, 28, 17)), round_mm=5)
    return implicit(without(lobes, ball((12, -44, -5), 18)), (90, 60, 40), 3.0, foot=-20)


def _kidney() -> trimesh.Trimesh:
    return implicit(
        without(ball((0, 0, 0), (52, 28, 24)), ball((0, -36, 0), 16), 5), (60, 40, 30), 2.5, foot=-16
    )


def _heart() -> trimesh.Trimesh:
    muscle = joined(ball((0, 0, 0), (36, 30, 42)), ball((14, 8, 22), 24), ball((-16, 4, 22), 20))
    return implicit(joined(muscle, rod((4, 2, 30), (10, 4, 56), 9)), (56, 48, 70), 3.0, foot=-30)


def _breast() -> trimesh.Trimesh:
    return implicit(joined(ball((0, 0, 0), (55, 52, 42)), ball((0, -6, 42), 6)), (70, 66, 60), 3.0, foot=0)


def _brain() -> trimesh.Trimesh:
    def folded(p: np.ndarray) -> np.ndarray:
        folds = np.sin(p[:, 0] / 5 + 2 * np.sin(p[:, 1] / 9)) * np.sin(p[:, 1] / 6 + np.sin(p[:, 2] / 7))
        return ball((0, 0, 0), (70, 55, 48))(p) + 1.6 * folds

    cleft = ball((0, 0, 62), (90, 4, 26))
    return implicit(without(folded, cleft, 2), (84, 66, 60), 2.5, foot=-24)


def _stomach() -> trimesh.Trimesh:
    body = joined(ball((-20, 10, 0), (34, 38, 26)), rod((-10, -15, 0), (30, -22, 0), 16), round_mm=5)
    return implicit(joined(body, rod((30, -22, 0), (48, -4, 0), 11)), (80, 70, 40), 3.0, foot=-15)


def _prostate() -> trimesh.Trimesh:
    walnut = joined(ball((-9, 0, 0), (15, 16, 14)), ball((9, 0, 0), (15, 16, 14)), round_mm=1.5)
    return implicit(walnut, (34, 26, 24), 1.2, foot=-9)


def _finger() -> trimesh.Trimesh:
    joints = [ball((x, 0, 0), (9, 9.3, 8.8)) for x in (-12, 14)]
    return implicit(joined(rod((-38, 0, 0), (32, 0, 0), 8), *joints, round_mm=2), (56, 16, 16), 1.0, foot=-6)


def _tongue() -> trimesh.Trimesh:
    bent = joined(ball((0, 0, 0), (40, 22, 12)), ball((-26, 0, 8), (22, 23, 16)), round_mm=3)
    return implicit(without(bent, rod((-30, 0, 25), (36, 0, 13), 2), 2), (62, 32, 34), 1.6, foot=-7)


def _spleen() -> trimesh.Trimesh:
    return implicit(without(ball((0, 0, 0), (55, 34, 20)), ball((0, 0, 32), 26), 6), (64, 42, 28), 2.2)


ORGANS: dict[str, Callable[[], Drawn]] = {
    "liver with lobes": lambda: whole(_liver()),
    "kidney": lambda: whole(_kidney()),
    "heart": lambda: whole(_heart()),
    "breast": lambda: whole(_breast()),
    "brain": lambda: whole(_brain()),
    "stomach": lambda: whole(_stomach()),
    "prostate": lambda: whole(_prostate()),
    "finger": lambda: whole(_finger()),
    "tongue": lambda: whole(_tongue()),
    "spleen without a flat foot": lambda: Drawn(_spleen(), None),
}
