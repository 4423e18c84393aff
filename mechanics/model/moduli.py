"""The moduli of elements, derived from the parts of a material: always over the object's global modulus.

Everything multiplies; what comes out at last is held within MODULUS_LIMITS.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from palpate.mechanics.model.material import Ball, Gradient, Skin
from palpate.mechanics.shape.nearest import distance
from palpate.mechanics.shape.tetmesh import TetMesh

MODULUS_LIMITS = (0.05, 50.0)
"""Of an element over the global modulus: what is harder still feels the same."""

# points that share a tetrahedron evenly: centres of the 20 tetrahedra and holes of a cut in three
_GRID = np.array(
    [[i, j, k, 3 - i - j - k] for i in range(4) for j in range(4 - i) for k in range(4 - i - j)], dtype=float
)
_SAMPLES = (_GRID + 0.25) / 4


def share_inside(
    mesh: TetMesh, centre_m: np.ndarray, radius_m: float, elements: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """(m,) share of each tetrahedron (or of `elements` alone) in a sphere, from 20 points in each."""
    points = points_inside(mesh, elements)
    return (np.linalg.norm(points - centre_m, axis=2) < radius_m).mean(axis=1)


def points_inside(mesh: TetMesh, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
    """(m, 20, 3) m, points that share each tetrahedron (or each of `elements`) evenly."""
    return np.einsum("qc,mcx->mqx", _SAMPLES, mesh.points[mesh.tetrahedra[elements, :4]])


def inclusion_ratio(mesh: TetMesh, centre_m: np.ndarray, radius_m: float, modulus_ratio: float) -> np.ndarray:
    """(m,) modulus over the global one of a sphere `modulus_ratio` times as stiff.

    A tetrahedron that the sphere cuts takes `mixed_ratio` of its share.
    """
    return mixed_ratio(share_inside(mesh, centre_m, radius_m), modulus_ratio)


def mixed_ratio(share: np.ndarray, modulus_ratio: float) -> np.ndarray:
    """Modulus of a matrix (1) that holds a share of balls `modulus_ratio` times as stiff, incompressible.

    After Mori and Tanaka (1973), for stiff balls the lower bound of Hashin and Shtrikman: it keeps the far
    effect of what a tetrahedron holds; the geometric mean has 10 % more of it.
    """
    return 1 + share * (modulus_ratio - 1) / (1 + 0.4 * (1 - share) * (modulus_ratio - 1))


def balls_ratio(mesh: TetMesh, balls: Iterable[Ball]) -> np.ndarray:
    """(m,) of all balls: 1 outside; those that overlap multiply. No limits."""
    ratio = np.ones(len(mesh.tetrahedra))
    for ball in balls:
        ratio *= inclusion_ratio(mesh, np.array(ball.centre_m), ball.radius_m, ball.modulus_ratio)
    return ratio


def with_balls(mesh: TetMesh, matrix_ratio: np.ndarray | None, balls: Iterable[Ball]) -> np.ndarray:
    """(m,) of balls in a matrix of ratio (m,), None for 1, within limits."""
    return within_limits(balls_ratio(mesh, balls) * (1.0 if matrix_ratio is None else matrix_ratio))


def height_share(mesh: TetMesh, support_point: np.ndarray, support_normal: np.ndarray) -> np.ndarray:
    """(m,) height of the tetrahedra's centres over the support, as a share of the object's. support_normal:
    (3,) unit, into the object."""
    highest = ((mesh.points - support_point) @ support_normal).max()
    centroid = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    return ((centroid - support_point) @ support_normal) / highest


def gradient_ratio(gradient: Gradient, height: np.ndarray) -> np.ndarray:
    """(m,) at the tetrahedra's centres, of which `height_share` is (m,)."""
    return gradient.ratio_base + (gradient.ratio_top - gradient.ratio_base) * height


def skin_ratio(mesh: TetMesh, skin: Skin) -> np.ndarray:
    """(m,) modulus over that of the object within: 1 + (modulus_ratio - 1) of each element's share of skin.

    The arithmetic mean, since a skin is stretched along with what it covers.
    """
    points = points_inside(mesh)
    triangles = mesh.touchable_surface[:, :3]
    depth = distance(mesh.points, triangles, points.reshape(-1, 3)).reshape(points.shape[:2])
    return 1 + (skin.modulus_ratio - 1) * (depth < skin.thickness_m).mean(axis=1)


def within_limits(ratio: np.ndarray) -> np.ndarray:
    """The ratio held within MODULUS_LIMITS."""
    return np.clip(ratio, *MODULUS_LIMITS)
