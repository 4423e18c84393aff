"""Holes of a surface of triangles: small, flat or at the support they are closed, others refused with their
place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.errors import SurfaceError

if TYPE_CHECKING:
    import trimesh

_SMALL, _FLAT = 0.1, 0.01
"""Of the object's size: how wide a hole may be that is closed, how far off its plane the rim of a wider
one."""
_BOTTOM, _LEAN, _AT_IT = 0.15, 0.85, 0.002
"""A hole at the support: how high its rim lies at most, of the height; least cosine between its plane's
normal and up; how near the support, of the size, a node of it lies on it."""


def close(shell: trimesh.Trimesh, name: str, metres: float, up: np.ndarray | None = None) -> tuple[str, ...]:
    """Close small and flat holes of the shell in place; what was done. metres: in its unit of length.

    up: (3,) unit, out of the support. A hole at the bottom (a scan of what stands on a table) is closed in
    the plane of the lowest node, down to which its rim is drawn. Raises SurfaceError for other holes.
    """
    if shell.is_watertight:
        _wind(shell)
        return ()
    _wind(shell)
    size = float(np.ptp(shell.vertices, axis=0).max())
    rims, vertices, new, notes = _rims(shell), np.array(shell.vertices), [], []
    for rim in rims:
        points = shell.vertices[rim]
        width, middle = float(np.ptp(points, axis=0).max()), points.mean(axis=0)
        plane = np.linalg.svd(points - middle)[2][2]
        if width <= _SMALL * size or np.abs((points - middle) @ plane).max() <= _FLAT * size:
            new += _lid(vertices, rim)
        elif up is not None and _at_the_support(shell.vertices, points, plane, up):
            vertices, skirt, rim = _drawn_down(vertices, rim, up, _AT_IT * size)
            new += [*skirt, *_lid(vertices, rim)]
            notes.append(f"a hole {1e3 * metres * width:.4g} mm wide closed at the support")
        else:
            place = ", ".join(f"{1e3 * metres * x:.4g}" for x in middle)
            raise SurfaceError(
                f"'{name}' is open: a hole {1e3 * metres * width:.4g} mm wide at ({place}) mm, neither small "
                "nor flat nor at the support (--up); close it in the program that made the file"
            )
    shell.vertices, shell.faces = vertices, np.vstack([shell.faces, np.array(new).reshape(-1, 3)])
    _wind(shell)
    if not shell.is_watertight:
        edges, counts = np.unique(shell.edges_sorted, axis=0, return_counts=True)
        bad = shell.vertices[edges[counts != 2]].reshape(-1, 3).mean(axis=0)
        place = ", ".join(f"{1e3 * metres * x:.4g}" for x in bad)
        raise SurfaceError(
            f"'{name}' is not closed near ({place}) mm: every edge must belong to two triangles; mend it in "
            "the program that made the file"
        )
    others = len(rims) - len(notes)
    return (*[f"{others} hole{'s' * (others > 1)} closed"] * bool(others), *notes)


def _at_the_support(vertices: np.ndarray, rim: np.ndarray, plane: np.ndarray, up: np.ndarray) -> bool:
    """Whether a rim (k, 3), its plane's unit normal given, lies at the bottom and looks down."""
    height = vertices @ up
    high = (rim @ up).max() - height.min()
    return bool(high <= _BOTTOM * np.ptp(height) and abs(plane @ up) >= _LEAN)


def _drawn_down(
    vertices: np.ndarray, rim: np.ndarray, up: np.ndarray, near: float
) -> tuple[np.ndarray, list[tuple[int, int, int]], np.ndarray]:
    """A rim drawn down to the lowest plane: all vertices, the triangles between, and the rim there.

    Nodes nearer than `near` to it are moved onto it, of the others copies stand there.
    """
    high = vertices[rim] @ up - (vertices @ up).min()
    far = high > near
    vertices = vertices.copy()
    vertices[rim[~far]] -= np.outer(high[~far], up)
    lower = rim.copy()
    lower[far] = len(vertices) + np.arange(far.sum())
    vertices = np.vstack([vertices, vertices[rim[far]] - np.outer(high[far], up)])
    made = []
    for a, b, c, d in zip(rim, np.roll(rim, -1), np.roll(lower, -1), lower, strict=True):
        made += [(int(i), int(j), int(k)) for i, j, k in ((a, b, c), (a, c, d)) if len({i, j, k}) == 3]
    return vertices, made, lower


def _wind(shell: trimesh.Trimesh) -> None:
    """Turn triangles in place so that neighbours agree, outward."""
    import pyvista

    if shell.is_winding_consistent:
        return
    drawn = pyvista.PolyData.from_regular_faces(np.asarray(shell.vertices), np.asarray(shell.faces))
    drawn = drawn.compute_normals(
        cell_normals=True, point_normals=False, consistent_normals=True, auto_orient_normals=True
    )
    shell.faces = drawn.regular_faces


def _rims(shell: trimesh.Trimesh) -> list[np.ndarray]:
    """Closed chains of the nodes along edges of one triangle alone."""
    directed = shell.edges
    _, inverse, counts = np.unique(shell.edges_sorted, axis=0, return_inverse=True, return_counts=True)
    following: dict[int, list[int]] = {}
    for a, b in directed[counts[inverse.ravel()] == 1]:
        following.setdefault(int(a), []).append(int(b))
        following.setdefault(int(b), []).append(int(a))
    rims = []
    while following:
        start = next(iter(following))
        chain = [start]
        while following.get(chain[-1]):
            nxt = following[chain[-1]].pop()
            following[nxt].remove(chain[-1])
            if nxt == start:
                break
            chain.append(nxt)
        for node in [n for n, others in following.items() if not others]:
            del following[node]
        if len(chain) > 2:
            rims.append(np.array(chain))
    return rims


def _lid(vertices: np.ndarray, rim: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles over a rim, in its own plane; a fan where it crosses itself there."""
    import pyvista

    points, number = vertices[rim] - vertices[rim].mean(axis=0), np.arange(len(rim))
    flat = points @ np.linalg.svd(points, full_matrices=False)[2][:2].T
    lines = np.column_stack([np.full(len(rim), 2), number, np.roll(number, -1)])
    drawn = pyvista.PolyData(np.column_stack([flat, np.zeros(len(rim))]), lines=lines.ravel())
    made = drawn.triangulate_contours()
    if made.n_points != len(rim) or made.n_cells != len(rim) - 2:
        return [(int(rim[0]), int(rim[k]), int(rim[k + 1])) for k in range(1, len(rim) - 1)]
    return [(int(a), int(b), int(c)) for a, b, c in rim[made.regular_faces]]
