"""fTetWild by the paper's volumetric detour: a grid labelled inside or outside, and the surface between the
labels (section 2.2).
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.errors import SurfaceError
from palpate.reconstruction.steps.s5_mesh.registry import Mesher
from palpate.reconstruction.steps.s5_mesh.tetwild import tetrahedralize

if TYPE_CHECKING:
    from palpate.reconstruction.steps.s4_surface import Surface
    from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions

_PITCH = 0.8  # of sigma, a voxel: corners are cut by as much, and the mesh keeps to it within 0.4
_ENVELOPE = 0.4  # of sigma: voxels are rough, and a wide one smooths that away

_LEFT_OUT = 0.9
"""Share of the contour's triangles that the mesher does without: flat places need few."""


def prepared(surface: Surface, options: MeshingOptions) -> Mesher:
    """As `registry.prepared`. Raises SurfaceError where the object is thinner than a voxel."""
    sigma, frame = options.surface_distance_m, surface.frame
    flat = (surface.vertices - surface.support_point) @ frame.T
    vertices, triangles = voxel_surface(flat, surface.triangles, _PITCH * sigma)
    vertices = vertices @ frame + surface.support_point
    envelope_m = _ENVELOPE * sigma
    fill = partial(
        tetrahedralize, vertices, triangles, edge_m=options.mesh_size_m, envelope_m=envelope_m, simplify=True
    )
    return Mesher(fill, envelope_m)


def voxel_surface(
    vertices: np.ndarray, triangles: np.ndarray, pitch_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) between voxels of edge `pitch_m` labelled inside and the
    others.

    Support frame. Layers are placed so that the base comes to lie on z = 0 again. The surface is the labels'
    mean level after one smoothing over neighbours: hull facets of poor quality are gone, corners are rounded
    by about a voxel. Raises SurfaceError where the object is thinner than a voxel.
    """
    import pyvista
    from scipy.ndimage import gaussian_filter

    inside, low = labels(vertices, triangles, pitch_m)
    if not inside.any():
        raise SurfaceError(
            f"no voxel of {pitch_m} m lies inside the surface: the object is thinner than a voxel"
        )
    # mirrored below the support, so that smoothing leaves the base plane where it is
    first = int(np.searchsorted(low[2] + pitch_m * np.arange(len(inside)), 0.0))
    upper = gaussian_filter(inside[first:].astype(float), 0.8, mode="nearest")
    level = np.zeros(inside.shape)
    level[first:] = upper
    level[first - 1] = np.minimum(upper[0], 1 - upper[0])
    grid = pyvista.ImageData(dimensions=inside.shape[::-1], spacing=(pitch_m,) * 3, origin=tuple(low))
    grid["level"] = level.ravel()
    found = grid.contour([0.5], scalars="level", method="flying_edges").triangulate().clean()
    found = found.decimate(_LEFT_OUT, volume_preservation=True)
    points, faces = np.asarray(found.points, dtype=float), found.regular_faces
    points[np.abs(points[:, 2]) < 0.1 * pitch_m, 2] = 0.0
    corner = points[faces]
    volume = np.einsum("ij,ij->i", np.cross(corner[:, 0], corner[:, 1]), corner[:, 2]).sum()
    return points, faces if volume > 0 else faces[:, ::-1]


def labels(vertices: np.ndarray, triangles: np.ndarray, pitch_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Which points of a grid lie inside a closed surface: (layers, rows, columns) bool, and its origin.

    A point is inside where its vertical line has crossed the surface an odd number of times below it.
    """
    low = vertices.min(axis=0) - 3 * pitch_m
    count = np.ceil((vertices.max(axis=0) + 3 * pitch_m - low) / pitch_m).astype(int) + 1
    # what a side gains or loses against the grid is shared with the opposite one
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    low = middle - pitch_m * (count - 1) / 2
    low[2] = -3.5 * pitch_m
    # no line through an edge: such a crossing would count for two triangles or none
    x, y = (low[i] + pitch_m * (np.arange(count[i]) + 1e-5 * (1 + i / math.e)) for i in (0, 1))
    crossings = np.zeros((count[2] + 1, count[1], count[0]), dtype=int)
    for a, b, c in vertices[triangles]:
        columns = slice(*np.searchsorted(x, [min(a[0], b[0], c[0]), max(a[0], b[0], c[0])]))
        rows = slice(*np.searchsorted(y, [min(a[1], b[1], c[1]), max(a[1], b[1], c[1])]))
        u, v = b - a, c - a
        area = u[0] * v[1] - u[1] * v[0]
        if area == 0:
            continue
        along, across = x[columns] - a[0], (y[rows] - a[1])[:, None]
        s = (along * v[1] - across * v[0]) / area
        t = (u[0] * across - u[1] * along) / area
        row, column = np.nonzero((s >= 0) & (t >= 0) & (s + t < 1))
        height = a[2] + s[row, column] * u[2] + t[row, column] * v[2]
        layer = np.clip(np.ceil((height - low[2]) / pitch_m), 0, count[2]).astype(int)
        np.add.at(crossings, (layer, row + rows.start, column + columns.start), 1)
    return np.cumsum(crossings[:-1], axis=0) % 2 == 1, low
