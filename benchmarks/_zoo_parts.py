"""Phantoms and parts of machines for the zoo, in mm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh

from benchmarks._zoo_shapes import (
    Drawn,
    ball,
    box,
    dome,
    extruded,
    implicit,
    joined,
    revolved,
    rod,
    standing,
    together,
    whole,
)


def _layers() -> Drawn:
    """A cube of three layers, each a body of its own."""
    layers = [box((50, 50, 15), (0, 0, z)) for z in (0, 15, 30)]
    return Drawn(together(layers), 50 * 50 * 45)


def _filleted() -> trimesh.Trimesh:
    def field(p: np.ndarray) -> np.ndarray:
        out = np.abs(p) - (np.array([30, 22, 18]) - 6)
        return np.linalg.norm(np.maximum(out, 0), axis=1) + np.minimum(out.max(axis=1), 0) - 6

    return implicit(field, (34, 26, 22), 1.5)


def _chamfered() -> trimesh.Trimesh:
    return extruded([(-40, 0), (40, 0), (40, 8), (36, 12), (-36, 12), (-40, 8)], 50, lying=True)


def _gear() -> trimesh.Trimesh:
    teeth, outline = 12, []
    for k in range(teeth):
        for turn, radius in ((0.0, 26), (0.3, 26), (0.4, 32), (0.8, 32)):
            angle = 2 * np.pi * (k + turn) / teeth
            outline.append((radius * np.cos(angle), radius * np.sin(angle)))
    return extruded(outline, 20)


def _handle() -> trimesh.Trimesh:
    def ring(p: np.ndarray) -> np.ndarray:
        return np.hypot(np.hypot(p[:, 0], p[:, 2] - 22) - 22, p[:, 1]) - 8

    return implicit(joined(ring, ball((0, 0, -6), (34, 24, 12)), round_mm=2), (44, 32, 56), 1.6, foot=-8)


def _shell() -> trimesh.Trimesh:
    """Half a sphere of 4 mm wall, open below."""
    angle = np.linspace(0, np.pi / 2, 33)
    outer = [(40 * np.cos(a), 40 * np.sin(a)) for a in angle[:-1]] + [(0.0, 40.0)]
    inner = [(0.0, 36.0)] + [(36 * np.cos(a), 36 * np.sin(a)) for a in angle[::-1][1:]]
    return revolved([*outer, *inner, outer[0]])


def _drilled() -> trimesh.Trimesh:
    """A plate with a hole from side to side: a ring whose outline is square."""
    count = 48
    angle = 2 * np.pi * np.arange(count) / count
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    square = around * (30 / np.abs(around).max(axis=1))[:, None]
    rings = [np.column_stack([ring, np.full(count, z)]) for z in (0, 20) for ring in (10 * around, square)]
    at, nxt = np.arange(count), np.roll(np.arange(count), -1)
    faces = []
    for a, b in ((0, 1), (1, 3), (3, 2), (2, 0)):
        a, b = a * count, b * count
        faces += [np.column_stack([a + at, b + at, b + nxt]), np.column_stack([a + at, b + nxt, a + nxt])]
    made = trimesh.Trimesh(np.vstack(rings), np.vstack(faces))
    if made.volume < 0:
        made.invert()
    return made


PHANTOMS: dict[str, Callable[[], Drawn]] = {
    "cylinder": lambda: whole(revolved([(0, 0), (30, 0), (30, 40), (0, 40)])),
    "block": lambda: whole(box((70, 60, 40))),
    "wedge": lambda: whole(extruded([(0, 0), (70, 0), (70, 35), (0, 15)], 50, lying=True)),
    "cube of three layers": _layers,
    "hemisphere": lambda: whole(dome(35, 35)),
    "dome": lambda: whole(dome()),
    "cone": lambda: whole(trimesh.creation.cone(radius=30, height=50, sections=64)),
    "ball": lambda: Drawn(trimesh.creation.icosphere(subdivisions=4, radius=30), None),
    "block of 12 triangles, 500 mm": lambda: whole(box((500, 500, 500))),
    "block of 10 mm": lambda: whole(box((10, 10, 10))),
    "cylinder of 10 mm": lambda: whole(revolved([(0, 0), (5, 0), (5, 8), (0, 8)], 1.0)),
}

_SHAFT = [(0, 0), (25, 0), (25, 15), (16, 15), (16, 35), (9, 35), (9, 50), (0, 50)]
_UMBRELLA = joined(rod((0, 0, -30), (0, 0, 10), 12), ball((0, 0, 14), (34, 34, 14)))

PARTS: dict[str, Callable[[], Drawn]] = {
    "bracket": lambda: whole(
        extruded([(0, 0), (60, 0), (60, 12), (28, 12), (12, 28), (12, 60), (0, 60)], 40, lying=True)
    ),
    "chamfered plate": lambda: whole(_chamfered()),
    "filleted block": lambda: whole(_filleted()),
    "tube": lambda: whole(standing(trimesh.creation.annulus(r_min=15, r_max=20, height=40))),
    "stepped shaft": lambda: whole(revolved(_SHAFT)),
    "hollow cup": lambda: whole(revolved([(0, 0), (25, 0), (28, 50), (23, 50), (20, 6), (0, 6)])),
    "handle on a foot": lambda: whole(_handle()),
    "L-profile": lambda: whole(extruded([(0, 0), (50, 0), (50, 8), (8, 8), (8, 50), (0, 50)], 80)),
    "gear": lambda: whole(_gear()),
    "thin shell": lambda: whole(_shell()),
    "plate of 6 mm": lambda: whole(box((60, 60, 6))),
    "beam": lambda: whole(box((10, 10, 50))),
    "plate with a hole": lambda: whole(_drilled()),
    "ring lying": lambda: Drawn(trimesh.creation.torus(30, 10, major_sections=64), None),
    "mushroom": lambda: whole(implicit(_UMBRELLA, (44, 44, 50), 2.2, foot=-24)),
}
