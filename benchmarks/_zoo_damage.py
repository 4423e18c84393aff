"""Meshes of the zoo as scanners and converters leave them, in mm unless they say otherwise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh

from benchmarks._zoo_shapes import (
    Drawn,
    box,
    dome,
    flat_below,
    organ,
    standing,
    together,
    whole,
)


def _less(mesh: trimesh.Trimesh, gone: np.ndarray) -> trimesh.Trimesh:
    mesh = mesh.copy()
    mesh.update_faces(~gone)
    mesh.remove_unreferenced_vertices()
    return mesh


def _scan() -> Drawn:
    """A scan of a dome on a table: nothing below 2 to 5 mm was seen, and what was ends at `low`."""
    mesh = dome()
    x, _, z = mesh.triangles_center.T
    seen = _less(mesh, z < 3.5 + 1.5 * np.sin(x / 8))
    low = float(seen.bounds[0, 2])
    return Drawn(seen, np.pi * 30**2 * ((40 - low) - (40**3 - low**3) / (3 * 40**2)))


def _scanned_organ() -> Drawn:
    """An organ from above, ragged below, in metres."""
    mesh = standing(organ(5))
    x, y, z = mesh.triangles_center.T
    seen = _less(mesh, z < 8 + np.sin(x / 7) + np.cos(y / 5))
    seen.apply_scale(1e-3)
    return Drawn(seen, None, "m")


def _noisy() -> Drawn:
    mesh = dome()
    noisy = mesh.copy()
    up = noisy.vertices[:, 2] > 1e-6
    noisy.vertices[up] += np.random.default_rng(1).normal(0, 0.15, (int(up.sum()), 3))
    return Drawn(noisy, mesh.volume)


def _pierced() -> Drawn:
    mesh = dome()
    return Drawn(_less(mesh, np.linalg.norm(mesh.triangles_center - [28, 0, 15], axis=1) < 9), mesh.volume)


def _many() -> Drawn:
    """327,680 triangles."""
    return whole(flat_below(organ(1, subdivisions=7), -20))


def _decimated() -> Drawn:
    import pyvista

    mesh = flat_below(organ(2), -20)
    volume = float(mesh.volume)
    few = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces).decimate(0.95)
    return Drawn(trimesh.Trimesh(np.asarray(few.points), few.regular_faces), volume)


def _tilted(degrees: float) -> Drawn:
    mesh = dome()
    volume = float(mesh.volume)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), [1, 0.4, 0]))
    return Drawn(mesh, volume)


def _flipped() -> Drawn:
    mesh = dome()
    faces = np.array(mesh.faces)
    faces[::3] = faces[::3, ::-1]
    return Drawn(trimesh.Trimesh(mesh.vertices, faces, process=False), mesh.volume)


def _inverted() -> Drawn:
    mesh = dome()
    mesh.invert()
    return Drawn(mesh, abs(mesh.volume))


def _soup() -> Drawn:
    """Every triangle by itself, its corners off by micrometres."""
    mesh = dome()
    corners = np.array(mesh.triangles).reshape(-1, 3)
    corners += np.random.default_rng(2).normal(0, 2e-3, corners.shape)
    return Drawn(trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False), mesh.volume)


def _twice() -> Drawn:
    """Every third triangle is there twice."""
    mesh = dome()
    return Drawn(
        trimesh.Trimesh(mesh.vertices, np.vstack([mesh.faces, mesh.faces[::3]]), process=False), mesh.volume
    )


def _of_no_area() -> Drawn:
    """Triangles of no area on edges: two corners the same, or three on a line."""
    mesh = dome()
    a, b, _ = mesh.faces[200:260].T
    middle = len(mesh.vertices) + np.arange(len(a))
    points = np.vstack([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    more = np.vstack([np.column_stack([a, a, b]), np.column_stack([a, middle, b])])
    return Drawn(trimesh.Trimesh(points, np.vstack([mesh.faces, more]), process=False), mesh.volume)


def _t_junctions() -> Drawn:
    """Some triangles are halved at an edge, those beside them are not."""
    mesh = box((60, 50, 40)).subdivide().subdivide()
    a, b, c = mesh.faces[::7].T
    middle = len(mesh.vertices) + np.arange(len(a))
    points = np.vstack([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    kept = np.delete(mesh.faces, np.s_[::7], axis=0)
    halves = np.vstack([np.column_stack([a, middle, c]), np.column_stack([middle, b, c])])
    return Drawn(trimesh.Trimesh(points, np.vstack([kept, halves]), process=False), mesh.volume)


def _crossing() -> Drawn:
    """Two blocks that go through one another."""
    both = together([box((80, 30, 30)), box((30, 80, 40))])
    return Drawn(both, 80 * 30 * 30 + 30 * 80 * 40 - 30 * 30 * 30)


def _self_crossing() -> Drawn:
    """One surface that a fold pushes through itself."""
    mesh = dome()
    near = np.linalg.norm(mesh.vertices - [24, 0, 24], axis=1) < 8
    volume = float(mesh.volume)
    mesh.vertices[near] += [6, 0, -14]
    return Drawn(mesh, volume)


def _touching() -> Drawn:
    """Two blocks side by side, which share a face's plane."""
    return Drawn(together([box((40, 40, 30)), box((30, 40, 45), (35, 0, 0))]), 40 * 40 * 30 + 30 * 40 * 45)


def _chest() -> Drawn:
    """Two organs beside one another, one 12 mm higher."""
    left, right = organ(3), organ(4)
    left.apply_translation([70, 0, 0])
    right.apply_translation([-70, 0, 12])
    return Drawn(together([left, right]), None)


def _with_fin() -> Drawn:
    """A fan of sheets at one edge stands in a block: that edge has three triangles."""
    block = box((60, 50, 40))
    fin = trimesh.Trimesh(block.vertices[[1, 5, 3]] * 0.6 + [0, 0, 8], [[0, 1, 2]], process=False)
    return Drawn(together([block, fin]), block.volume)


def _edge_of_four() -> Drawn:
    """Two blocks that share an edge, to which four triangles belong."""
    both = together([box((30, 40, 30)), box((30, 40, 30), (30, 40, 0))])
    both.merge_vertices()
    return Drawn(both, 2 * 30 * 40 * 30)


def _specks() -> Drawn:
    """Dust of a scanner beside and above a dome."""
    mesh, random = dome(), np.random.default_rng(7)
    dust = []
    for at in random.uniform([35, -30, 2], [60, 30, 60], (12, 3)):
        speck = trimesh.creation.icosphere(subdivisions=0, radius=0.6)
        speck.apply_translation(at)
        dust.append(speck)
    return Drawn(together([mesh, *dust]), mesh.volume)


def _hanging() -> Drawn:
    """A block, and another that hangs in the air beside it."""
    return Drawn(together([box((60, 60, 30)), box((30, 30, 20), (60, 0, 40))]), 60 * 60 * 30)


def _in(unit: str, millimetres: float) -> Drawn:
    mesh = dome()
    volume = float(mesh.volume)
    mesh.apply_scale(1 / millimetres)
    return Drawn(mesh, volume, unit)


SCANS: dict[str, Callable[[], Drawn]] = {
    "dome, scanned on a table": _scan,
    "organ, scanned from above, metres": _scanned_organ,
    "dome, noisy": _noisy,
    "dome, a hole in its side": _pierced,
    "organ of 300,000 triangles": _many,
    "organ, decimated": _decimated,
    "organ without a flat foot": lambda: Drawn(organ(), None),
    "capsule lying": lambda: Drawn(trimesh.creation.capsule(radius=20, height=60), None, up="+x"),
}

BROKEN: dict[str, Callable[[], Drawn]] = {
    "dome, inside out": _inverted,
    "dome, some triangles turned": _flipped,
    "dome, a soup": _soup,
    "dome, triangles twice": _twice,
    "dome, triangles of no area": _of_no_area,
    "block, T-junctions": _t_junctions,
    "crossing blocks": _crossing,
    "dome, folded through itself": _self_crossing,
    "two blocks touching": _touching,
    "two organs": _chest,
    "block with a fin": _with_fin,
    "two blocks at one edge": _edge_of_four,
    "dome with specks": _specks,
    "block and one hanging": _hanging,
    "dome, tilted by 7.5 degrees": lambda: _tilted(7.5),
    "dome in inches": lambda: _in("in", 25.4),
}
