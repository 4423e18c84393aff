"""What a dragged press feels of a scene's map of stiffness: spots in the map may be the field's own, or the
picture's.

A tip is pressed straight in to one depth and dragged at that depth over three lines: over the first inclusion
(else the middle), down the side to the foot, and round the foot. The force into the surface along a line is
parted by a Gaussian of 4 mm in what is smooth and a ripple, whose limit is what a finger tells apart, 7 % of
a force (Jones 1989).
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.timing import table

TOLD_APART = 0.07
SPEED_M_PER_S, SMOOTH_M, END_M = 0.02, 0.004, 0.006
_TICK_S, _APPROACH, _POINTS = 1e-3, 500, 600


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The scene, the depth, and the height of the line round the foot."""
    parser.add_argument("--scene", default="nodule", help="scene, MODEL or phantom (default: nodule)")
    parser.add_argument("--depth", type=float, default=0.003, metavar="M", help="of the press [m]")
    parser.add_argument("--height", type=float, default=0.006, metavar="M", help="of the foot's line [m]")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Drag, print the ripples; returns {line: {least_n, most_n, ripple_rms, ripple_most}}."""
    from palpate.operations._shared import with_friction
    from palpate.render.options import RenderOptions
    from palpate.render.registry import create
    from palpate.scenes.build import model_of
    from palpate.scenes.scene import load_scene

    scene = load_scene(arguments.scene)
    renderer = create("fem", model_of(scene), with_friction(RenderOptions(), scene))
    found: dict[str, Any] = {}
    for name, line in _lines(renderer, arguments.height).items():
        way, force = dragged(renderer, line, arguments.depth)
        found[name] = ripple(way, force)
    rows = [[name, 1e3 * f["least_n"], 1e3 * f["most_n"], 100 * f["ripple_rms"], 100 * f["ripple_most"],
             f["ripple_most"] / TOLD_APART] for name, f in found.items()]  # fmt: skip
    print(f"{scene.name}, {1e3 * arguments.depth:g} mm deep, dragged at {1e3 * SPEED_M_PER_S:g} mm/s")
    header = ["line", "least [mN]", "most [mN]", "ripple, rms [%]", "most [%]", "over what is told apart"]
    print(table(header, rows))
    return found


def _lines(renderer: Any, height_m: float) -> dict[str, np.ndarray]:
    """Name to (n, 3) m points of the contact surface, in the order of the drag."""
    from palpate.mechanics.frames import tangents

    model, arrays = renderer.model, renderer.contact.arrays
    up, foot = model.support.normal, model.support.point
    across, along = tangents(up)
    balls = list(model.material.inclusions.values())
    middle = arrays.vertices.mean(axis=0)
    over = middle if not balls else np.asarray(balls[0].centre_m)
    size = float(np.linalg.norm(np.ptp(arrays.vertices, axis=0)))
    reach = np.linspace(-0.03, 0.03, _POINTS)[:, None]
    axis = middle - ((middle - foot) @ up) * up
    heights = np.linspace(0.03, 0.003, _POINTS)[:, None]
    turn = np.linspace(0, 2 * np.pi, 2 * _POINTS)[:, None]
    round_about = np.cos(turn) * across + np.sin(turn) * along
    aside = (across + along) / np.sqrt(2)
    low = axis + height_m * up
    return {
        "over the nodule" if balls else "over the top": _hits(arrays, over + reach * across + size * up, -up),
        "down to the foot": _hits(arrays, axis + size * aside + heights * up, -aside),
        "round the foot": _hits(arrays, low + size * round_about, -round_about),
    }


def _hits(arrays: Any, begin: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Where rays from (n, 3) m first meet the surface, where they do."""
    surface = _surface(arrays)
    ends = begin + 2 * np.linalg.norm(np.ptp(arrays.vertices, axis=0)) * along
    line = []
    for a, b in zip(begin, ends, strict=True):
        hits = surface.ray_trace(a, b)[0]  # its `first_point` may be the last
        if len(hits):
            line.append(hits[np.argmin(np.linalg.norm(hits - a, axis=1))])
    return np.array(line)


def _surface(arrays: Any) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(np.array(arrays.vertices), np.array(arrays.triangles))


def _normals(arrays: Any, points: np.ndarray) -> np.ndarray:
    """(n, 3), the contact normals at points of the surface, interpolated in their triangles."""
    triangles = arrays.triangles[_surface(arrays).find_closest_cell(points)]
    a, b, c = (arrays.vertices[triangles[:, k]] for k in range(3))
    whole = np.cross(b - a, c - a)
    parts = [np.cross(c - b, points - b), np.cross(a - c, points - c), np.cross(b - a, points - a)]
    weights = np.column_stack([(part * whole).sum(axis=1) for part in parts])
    return np.einsum("nk,nkx->nx", weights, arrays.normals[triangles])


def dragged(renderer: Any, line: np.ndarray, depth_m: float) -> tuple[np.ndarray, np.ndarray]:
    """(way (n,) m, force into the surface (n,) N) of a tip that is pressed in and dragged along points
    (k, 3) m."""
    arrays = renderer.contact.arrays
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    even = np.arange(0.0, way[-1], SPEED_M_PER_S * _TICK_S)
    normals = _normals(arrays, line)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points, normals = (np.column_stack([np.interp(even, way, v) for v in x.T]) for x in (line, normals))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    radius = renderer.model.tool.tip_radius_m
    depth = np.concatenate([np.linspace(-0.002, depth_m, _APPROACH), np.full(len(even), depth_m)])
    at = np.concatenate([np.zeros(_APPROACH, dtype=int), np.arange(len(even))])
    state = renderer.start([radius], dt_s=_TICK_S)
    tips = points[at] + (radius - depth)[:, None] * normals[at]
    forces = np.array([renderer.step(state, tip[None])[1][0].copy() for tip in tips])[_APPROACH:]
    return even, (forces * normals).sum(axis=1)


def ripple(way: np.ndarray, force: np.ndarray) -> dict[str, float]:
    """Range of a force along its way, and what is left beside its mean over SMOOTH_M, as shares of that."""
    from scipy.ndimage import gaussian_filter1d

    step = way[1] - way[0]
    smooth = gaussian_filter1d(force, SMOOTH_M / step)
    inner = (way > END_M) & (way < way[-1] - END_M)
    off = (force[inner] - smooth[inner]) / smooth[inner]
    return {
        "least_n": float(force[inner].min()),
        "most_n": float(force[inner].max()),
        "ripple_rms": float(np.sqrt((off**2).mean())),
        "ripple_most": float(np.abs(off).max()),
    }
